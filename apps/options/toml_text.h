#pragma once

#include <memory>
#include <string>
#include <vector>

#include "nephele/modeling/felt/diagnostic.h"

namespace nephele::apps {

/// A string of a TOML file: what is wrong with what it says is shown where it stands in the file.
class TomlText {
 public:
  /// `literal` is the string with its quotes, `value` what it says.
  TomlText(std::shared_ptr<const felt::Sources> file, const felt::Span& literal, const std::string& value);

  /// All of it is at fault.
  felt::ScriptError fault(felt::Code code, std::string message, std::string hint = {}) const;
  /// The faults of an expression that begins `from` bytes into the string.
  felt::ScriptError moved(const felt::ScriptError& error, std::size_t from) const;

 private:
  std::shared_ptr<const felt::Sources> file_;
  felt::Span literal_;
  /// By byte of the value and for its end: where it stands in the file.
  std::vector<int> offsets_;
};

}  // namespace nephele::apps

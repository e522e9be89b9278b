#pragma once

#include <memory>
#include <string>
#include <vector>

// toml++ is slow to compile: only what reads TOML files includes this header.
#include <toml++/toml.h>

#include "apps/options/toml_text.h"
#include "nephele/modeling/felt/diagnostic.h"

namespace nephele::apps {

/// A TOML file, and what is found wrong with it: faults are shown as those of scripts are, all of a file
/// together.
class TomlFile {
 public:
  /// The whole file that `option` names. @throws CLI::ValidationError naming option and file where it cannot
  /// be read or is a folder; felt::ScriptError where it is not TOML, has a text with a byte of zero in it,
  /// or keys that nest more than 32 deep, which toml++ would follow until the stack ends.
  static TomlFile read(const std::string& option, const std::string& path);
  /// A text that is called `name`. @throws felt::ScriptError as above.
  TomlFile(std::string name, std::string text);

  const toml::table& table() const { return table_; }
  /// "cloud.toml:7", for messages that show nothing.
  std::string placeOf(const toml::node& node) const;
  felt::Span spanOf(const toml::source_region& region) const;
  /// The string, or what else is to stand in for one, for messages of what it says.
  std::shared_ptr<const TomlText> textOf(const toml::node& node, const std::string& value) const;

  /// @throws felt::ScriptError with this one fault.
  [[noreturn]] void refuse(felt::Code code, const toml::source_region& where, std::string message,
                           std::string hint = {}) const;
  /// Says that `key`, now called `name`, is none of `known`: "'name' is `isNot`", and which one was probably
  /// meant. @throws felt::ScriptError with this one fault.
  [[noreturn]] void refuseKey(const toml::key& key, const std::string& name, const std::string& isNot,
                              const std::vector<std::string>& known, bool listsThem = true) const;

  /// Carries out `check` and keeps the faults that it throws, so that others are found, too.
  template <class Check>
  void collect(Check&& check) {
    try {
      check();
    } catch (const felt::ScriptError& error) {
      faults_.insert(faults_.end(), error.diagnostics().begin(), error.diagnostics().end());
    }
  }
  /// @throws felt::ScriptError with all faults that were collected, if there are any.
  void throwFaults() const;

 private:
  int offsetOf(const toml::source_position& position) const;

  std::shared_ptr<const felt::Sources> source_;
  toml::table table_;
  std::vector<felt::Diagnostic> faults_;
};

}  // namespace nephele::apps

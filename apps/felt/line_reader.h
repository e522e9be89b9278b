#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace nephele::apps {

/// Lines of the standard input. At a terminal they can be edited, the arrows go through those entered before,
/// which are kept from session to session, and the tabulator completes words.
class LineReader {
 public:
  /// `words` gives what there is to complete.
  explicit LineReader(std::function<std::vector<std::string>()> words);
  ~LineReader();

  /// The next line, or nothing at the end of the input. The prompt is shown at terminals only.
  std::optional<std::string> next(const std::string& prompt);
  bool isTerminal() const { return isTerminal_; }

 private:
  bool isTerminal_;
};

}  // namespace nephele::apps

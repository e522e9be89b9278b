#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/felt/source.h"

/// What is wrong with a script, and how it is said.
namespace nephele::felt {

/// Kinds of faults. `codeName` gives the name that tools see.
enum class Code {
  // Of the text.
  badCharacter,
  badNumber,
  openString,
  openComment,
  expected,
  tooDeep,
  // Of names.
  unknownName,
  unknownFunction,
  unknownType,
  unknownParameter,
  declaredTwice,
  // Of types.
  noSuchCall,
  ambiguousCall,
  wrongType,
  noSuchMember,
  noSuchIndex,
  // Of statements.
  notAssignable,
  noReturn,
  outsideFunction,
  outsideLoop,
  notAtTop,
  badRange,
  outOfRange,
  importFailed,
  divisionOfIntegers,
  // Of a run.
  noValue,
  divisionByZero,
  overflow,
  limit,
  failed,
};

/// All codes.
std::vector<Code> allCodes();
/// As "unknown-name".
std::string_view codeName(Code code);

enum class Severity { error, warning };

/// One fault.
struct Diagnostic {
  Code code;
  Span span;
  /// A sentence with the value that is wrong, without a full stop.
  std::string message;
  /// What to do, or empty. May have several lines.
  std::string hint{};
  Severity severity = Severity::error;
  /// The calls that led here, innermost first.
  std::vector<Span> calls{};
};

/// The fault as people read it: "file:line:column: error: sentence", the line of the source with all of
/// the span underlined, and the hint.
std::string formatted(const Diagnostic& diagnostic, const Sources& sources);
/// The fault as editors read it: one JSON object with file, line, column, endLine, endColumn, severity,
/// code, message and hint.
std::string formattedAsJson(const Diagnostic& diagnostic, const Sources& sources);

/// What a built-in function throws to have its own code; other errors are told as Code::failed.
class CallError : public Error {
 public:
  CallError(Code code, const std::string& message, std::string hint = {})
      : Error(message), code_(code), hint_(std::move(hint)) {}

  Code code() const { return code_; }
  const std::string& hint() const { return hint_; }

 private:
  Code code_;
  std::string hint_;
};

/// A script, or another text of which places can be shown, that cannot be used: all of its faults. `what()`
/// is their text without a line end at the end.
class ScriptError : public Error {
 public:
  ScriptError(std::vector<Diagnostic> diagnostics, const Sources& sources);

  const std::vector<Diagnostic>& diagnostics() const { return diagnostics_; }
  /// One JSON object per line.
  const std::string& json() const { return json_; }
  /// Whether the script itself is at fault; otherwise it is what it was run with: files, values, limits.
  bool isOfScript() const;

 private:
  std::vector<Diagnostic> diagnostics_;
  std::string json_;
};

}  // namespace nephele::felt

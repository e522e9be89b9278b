#include "nephele/modeling/felt/diagnostic.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include "nephele/modeling/base/printable.h"

namespace nephele::felt {

namespace {

struct NamedCode {
  Code code;
  std::string_view name;
};

constexpr std::array kCodes{
    NamedCode{Code::badCharacter, "bad-character"},
    NamedCode{Code::badNumber, "bad-number"},
    NamedCode{Code::openString, "open-string"},
    NamedCode{Code::openComment, "open-comment"},
    NamedCode{Code::expected, "expected"},
    NamedCode{Code::tooDeep, "too-deep"},
    NamedCode{Code::unknownName, "unknown-name"},
    NamedCode{Code::unknownFunction, "unknown-function"},
    NamedCode{Code::unknownType, "unknown-type"},
    NamedCode{Code::unknownParameter, "unknown-parameter"},
    NamedCode{Code::declaredTwice, "declared-twice"},
    NamedCode{Code::noSuchCall, "no-such-call"},
    NamedCode{Code::ambiguousCall, "ambiguous-call"},
    NamedCode{Code::wrongType, "wrong-type"},
    NamedCode{Code::noSuchMember, "no-such-member"},
    NamedCode{Code::noSuchIndex, "no-such-index"},
    NamedCode{Code::notAssignable, "not-assignable"},
    NamedCode{Code::noReturn, "no-return"},
    NamedCode{Code::outsideFunction, "outside-function"},
    NamedCode{Code::outsideLoop, "outside-loop"},
    NamedCode{Code::notAtTop, "not-at-top"},
    NamedCode{Code::badRange, "bad-range"},
    NamedCode{Code::outOfRange, "out-of-range"},
    NamedCode{Code::importFailed, "import-failed"},
    NamedCode{Code::divisionOfIntegers, "division-of-integers"},
    NamedCode{Code::noValue, "no-value"},
    NamedCode{Code::divisionByZero, "division-by-zero"},
    NamedCode{Code::overflow, "overflow"},
    NamedCode{Code::limit, "limit"},
    NamedCode{Code::failed, "failed"},
};

constexpr std::size_t kLongestLine = 160;

std::size_t characters(std::string_view text) {
  return std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; });
}

std::string placeText(const Source& source, int offset) {
  const Place place = source.placeOf(offset);
  return printable(source.name()) + ":" + std::to_string(place.line) + ":" + std::to_string(place.column);
}

/// The line of the source and the mark below it; tabs are one space, so that both have the same columns.
std::string marked(const Source& source, const Span& span) {
  std::string line(source.lineAt(span.begin));
  const std::size_t begin = std::min<std::size_t>(span.begin - source.lineStart(span.begin), line.size());
  std::size_t end = std::min<std::size_t>(begin + (span.end - span.begin), line.size());
  end = std::max(end, begin);
  std::replace(line.begin(), line.end(), '\t', ' ');
  std::string before = printable(line.substr(0, begin)), at = printable(line.substr(begin, end - begin)),
              after = printable(line.substr(end));
  // Of lines that no terminal shows whole, the part around the fault.
  const std::size_t most = kLongestLine / 2;
  if (before.size() > most) {
    std::size_t from = before.size() - most;
    while (from < before.size() && (before[from] & 0xC0) == 0x80) ++from;
    before = "..." + before.substr(from);
  }
  at = printable(at, kLongestLine);
  after = printable(after, most);
  const std::size_t length = std::max<std::size_t>(characters(at), 1);
  return "  " + before + at + after + "\n  " + std::string(characters(before), ' ') + "^" +
         std::string(length - 1, '~');
}

std::string indented(const std::string& text, const std::string& first) {
  std::string result = "  " + first;
  for (const char c : text) {
    result += c;
    if (c == '\n') result += std::string(2 + first.size(), ' ');
  }
  return result;
}

std::string quotedForJson(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      result += '\\';
      result += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      char code[8];
      std::snprintf(code, sizeof code, "\\u%04x", c);
      result += code;
    } else {
      result += c;
    }
  }
  if (isUtf8(result)) return result + "\"";
  for (char& c : result)
    if (static_cast<unsigned char>(c) >= 0x80) c = '?';
  return result + "\"";
}

/// As they stand in the files.
const std::vector<Diagnostic>& inOrder(std::vector<Diagnostic>& diagnostics) {
  std::stable_sort(diagnostics.begin(), diagnostics.end(), [](const Diagnostic& a, const Diagnostic& b) {
    return std::pair(a.span.file, a.span.begin) < std::pair(b.span.file, b.span.begin);
  });
  return diagnostics;
}

std::string allFormatted(const std::vector<Diagnostic>& diagnostics, const Sources& sources) {
  std::string text;
  for (const Diagnostic& diagnostic : diagnostics) {
    if (!text.empty()) text += "\n";
    text += formatted(diagnostic, sources);
  }
  return text;
}

}  // namespace

std::vector<Code> allCodes() {
  std::vector<Code> codes;
  for (const NamedCode& named : kCodes) codes.push_back(named.code);
  return codes;
}

std::string_view codeName(Code code) {
  for (const NamedCode& named : kCodes)
    if (named.code == code) return named.name;
  return "failed";
}

std::string formatted(const Diagnostic& diagnostic, const Sources& sources) {
  const Source& source = sources[diagnostic.span.file];
  std::string text = placeText(source, diagnostic.span.begin);
  text += diagnostic.severity == Severity::error ? ": error: " : ": warning: ";
  text += diagnostic.message + "\n" + marked(source, diagnostic.span);
  if (!diagnostic.hint.empty()) {
    text += '\n';
    text += indented(diagnostic.hint, "hint: ");
  }
  constexpr std::size_t kShownCalls = 8;
  for (std::size_t i = 0; i < diagnostic.calls.size(); ++i) {
    if (i == kShownCalls) {
      text += "\n  ... and " + std::to_string(diagnostic.calls.size() - i) + " calls more";
      break;
    }
    const Span& call = diagnostic.calls[i];
    text += "\n  called at ";
    text += placeText(sources[call.file], call.begin);
  }
  return text;
}

std::string formattedAsJson(const Diagnostic& diagnostic, const Sources& sources) {
  const Source& source = sources[diagnostic.span.file];
  const Place begin = source.placeOf(diagnostic.span.begin), end = source.placeOf(diagnostic.span.end);
  return "{\"file\": " + quotedForJson(source.name()) + ", \"line\": " + std::to_string(begin.line) +
         ", \"column\": " + std::to_string(begin.column) + ", \"endLine\": " + std::to_string(end.line) +
         ", \"endColumn\": " + std::to_string(end.column) +
         ", \"severity\": " + (diagnostic.severity == Severity::error ? "\"error\"" : "\"warning\"") +
         ", \"code\": " + quotedForJson(codeName(diagnostic.code)) +
         ", \"message\": " + quotedForJson(diagnostic.message) +
         ", \"hint\": " + quotedForJson(diagnostic.hint) + "}";
}

ScriptError::ScriptError(std::vector<Diagnostic> diagnostics, const Sources& sources)
    : Error(allFormatted(inOrder(diagnostics), sources)), diagnostics_(std::move(diagnostics)) {
  for (const Diagnostic& diagnostic : diagnostics_) json_ += formattedAsJson(diagnostic, sources) + "\n";
}

bool ScriptError::isOfScript() const {
  return std::any_of(diagnostics_.begin(), diagnostics_.end(), [](const Diagnostic& diagnostic) {
    return diagnostic.severity == Severity::error && diagnostic.code != Code::failed &&
           diagnostic.code != Code::importFailed;
  });
}

}  // namespace nephele::felt

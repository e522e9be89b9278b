#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/felt/detail/token.h"
#include "nephele/modeling/felt/type.h"

namespace nephele::felt {

namespace {

constexpr std::array<std::string_view, 13> kKeywords{"func",   "for",   "while",    "if",     "else",
                                                     "return", "break", "continue", "import", "param",
                                                     "true",   "false", "in"};

/// Longest first, so that the first that fits is the right one.
constexpr std::array<std::string_view, 34> kMarks{
    "++", "--", "+=", "-=", "*=", "/=", "^=", "==", "!=", "<=", ">=", "&&", "||", "+", "-", "*", "/",
    "^",  "%",  "<",  ">",  "=",  "!",  "(",  ")",  "[",  "]",  "{",  "}",  ",",  ";", ".", "?", ":"};

bool isLetter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}
bool isDigit(char c) {
  return c >= '0' && c <= '9';
}

class Lexer {
 public:
  Lexer(const Sources& sources, int file, std::vector<Diagnostic>& diagnostics)
      : text_(sources[file].text()), file_(file), diagnostics_(diagnostics) {}

  Tokens run() {
    while (skipToToken()) readToken();
    result_.tokens.push_back({TokenKind::end, {file_, size(), size()}});
    return std::move(result_);
  }

 private:
  int size() const { return static_cast<int>(text_.size()); }
  char at(int offset) const { return offset < size() ? text_[offset] : '\0'; }
  char here() const { return at(place_); }
  Span since(int begin) const { return {file_, begin, place_}; }
  void fault(Code code, const Span& span, std::string message, std::string hint = {}) {
    diagnostics_.push_back({code, span, std::move(message), std::move(hint)});
  }

  /// Past spaces and comments; false at the end.
  bool skipToToken() {
    while (place_ < size()) {
      const char c = here();
      if (c == ' ' || c == '\t' || c == '\r' || c == '\n') {
        if (c == '\n') codeInLine_ = false;
        ++place_;
      } else if (c == '/' && at(place_ + 1) == '/') {
        skipLineComment();
      } else if (c == '/' && at(place_ + 1) == '*') {
        skipBlockComment();
      } else {
        codeInLine_ = true;
        return true;
      }
    }
    return false;
  }
  void skipLineComment() {
    const int begin = place_;
    while (place_ < size() && here() != '\n' && here() != '\r') ++place_;
    int end = place_;
    while (end > begin && (text_[end - 1] == ' ' || text_[end - 1] == '\t')) --end;
    result_.comments.push_back({{file_, begin, end}, codeInLine_});
  }
  void skipBlockComment() {
    const int begin = place_;
    const std::size_t end = text_.find("*/", begin + 2);
    if (end == std::string_view::npos) {
      place_ = size();
      fault(Code::openComment, {file_, begin, begin + 2}, "this comment has no end", "end it with */");
    } else {
      place_ = static_cast<int>(end) + 2;
    }
    result_.comments.push_back({since(begin), codeInLine_});
  }

  void readToken() {
    const char c = here();
    if (isLetter(c)) return readName();
    if (isDigit(c) || (c == '.' && isDigit(at(place_ + 1)))) return readNumber();
    if (c == '"') return readString();
    for (const std::string_view mark : kMarks)
      if (text_.substr(place_, mark.size()) == mark) {
        const int begin = place_;
        place_ += static_cast<int>(mark.size());
        result_.tokens.push_back({TokenKind::mark, since(begin), std::string(mark)});
        return;
      }
    skipBadCharacter();
  }
  void skipBadCharacter() {
    const int begin = place_++;
    while (place_ < size() && (here() & 0xC0) == 0x80) ++place_;
    const Span span = since(begin);
    const std::string written = printable(text_.substr(begin, place_ - begin));
    std::string hint;
    if (written == "&" || written == "|") hint = "and is &&, or is ||, not is !";
    if (written == "'") hint = "strings stand between \"";
    if (written == "#") hint = "comments begin with //";
    fault(Code::badCharacter, span, quoted(written) + " means nothing here", hint);
  }

  void readName() {
    const int begin = place_;
    while (isLetter(here()) || isDigit(here())) ++place_;
    result_.tokens.push_back(
        {TokenKind::name, since(begin), std::string(text_.substr(begin, place_ - begin))});
  }

  void readNumber() {
    const int begin = place_;
    bool isInteger = true;
    while (isDigit(here())) ++place_;
    if (here() == '.' && at(place_ + 1) != '.') {
      isInteger = false;
      ++place_;
      while (isDigit(here())) ++place_;
    }
    if (here() == 'e' || here() == 'E') {
      const int sign = at(place_ + 1) == '+' || at(place_ + 1) == '-' ? 1 : 0;
      if (isDigit(at(place_ + 1 + sign))) {
        isInteger = false;
        place_ += 2 + sign;
        while (isDigit(here())) ++place_;
      }
    }
    const std::string_view digits = text_.substr(begin, place_ - begin);
    Token token{isInteger ? TokenKind::integer : TokenKind::number, {}};
    const auto reading = std::from_chars(digits.data(), digits.data() + digits.size(), token.number);
    bool good = reading.ec == std::errc() && std::isfinite(token.number);
    if (isInteger)
      good = good &&
             std::from_chars(digits.data(), digits.data() + digits.size(), token.integer).ec == std::errc();
    if (!isInteger && (here() == 'f' || here() == 'F') && !isLetter(at(place_ + 1)) &&
        !isDigit(at(place_ + 1)))
      ++place_;
    if (here() == '%' && !continuesAfterPercent()) {
      token.kind = TokenKind::percent;
      ++place_;
    } else if (here() == 'x' && !isLetter(at(place_ + 1)) && !isDigit(at(place_ + 1))) {
      token.kind = TokenKind::perSide;
      ++place_;
    }
    while (isLetter(here()) || isDigit(here())) {
      good = false;
      ++place_;
    }
    token.span = since(begin);
    if (!good) {
      fault(Code::badNumber, token.span,
            quoted(text_.substr(begin, place_ - begin), 40) + " is no number of this language",
            "write 3, 0.5, 1e-3, 2.5% of the longest side, or 6x for six per longest side; integers end at "
            "9223372036854775807");
      token.kind = TokenKind::number;
      token.number = 1;
    }
    result_.tokens.push_back(token);
  }
  /// `5%3` is a remainder, `5%` followed by anything else a length.
  bool continuesAfterPercent() const {
    const char next = at(place_ + 1);
    return isLetter(next) || isDigit(next) || next == '(' || next == '.';
  }

  void readString() {
    const int begin = place_++;
    std::string text;
    while (place_ < size() && here() != '"' && here() != '\n') {
      char c = text_[place_++];
      if (c == '\\' && place_ < size() && here() != '\n') {
        c = text_[place_++];
        if (c == 'n')
          c = '\n';
        else if (c == 't')
          c = '\t';
        else if (c != '"' && c != '\\')
          fault(Code::badCharacter, {file_, place_ - 2, place_},
                std::string("'\\").append(printable(std::string(1, c))).append("' means nothing in a string"),
                "there are \\n, \\t, \\\" and \\\\");
      }
      text += c;
    }
    if (here() != '"')
      fault(Code::openString, since(begin), "this string has no end", "end it with \" in the same line");
    else
      ++place_;
    result_.tokens.push_back({TokenKind::text, since(begin), std::move(text)});
  }

  std::string_view text_;
  int file_;
  std::vector<Diagnostic>& diagnostics_;
  Tokens result_;
  int place_ = 0;
  bool codeInLine_ = false;
};

}  // namespace

Tokens tokensOf(const Sources& sources, int file, std::vector<Diagnostic>& diagnostics) {
  return Lexer(sources, file, diagnostics).run();
}

bool isKeyword(std::string_view name) {
  return std::find(kKeywords.begin(), kKeywords.end(), name) != kKeywords.end() ||
         (kindOf(name).has_value() && name != "any");
}

}  // namespace nephele::felt

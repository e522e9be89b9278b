#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "nephele/modeling/felt/diagnostic.h"

namespace nephele::felt {

enum class TokenKind { name, integer, number, percent, perSide, text, mark, end };

/// A word, number, string or mark of a script.
struct Token {
  TokenKind kind = TokenKind::end;
  Span span;
  /// Of names, marks and strings; strings without their quotes and with escapes resolved.
  std::string text{};
  std::int64_t integer = 0;
  /// Of `number`; of `percent` and `perSide` the number before the mark.
  double number = 0;

  bool is(std::string_view mark) const {
    return (kind == TokenKind::mark || kind == TokenKind::name) && text == mark;
  }
};

/// A comment, which only the formatter needs.
struct Comment {
  Span span;
  /// Whether anything of the script stands before it in its line.
  bool followsCode = false;
};

struct Tokens {
  /// Ends with one of kind `end`.
  std::vector<Token> tokens;
  std::vector<Comment> comments;
};

/// Takes `sources[file]` apart; faults are added to `diagnostics`, and what is wrong is left out.
Tokens tokensOf(const Sources& sources, int file, std::vector<Diagnostic>& diagnostics);

/// Whether `name` is a word of the language itself, which nothing may be called.
bool isKeyword(std::string_view name);

}  // namespace nephele::felt

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nephele/modeling/felt/detail/syntax.h"
#include "nephele/modeling/felt/detail/token.h"

namespace nephele::felt {

/// Ends what is being parsed; the fault itself has been noted.
struct Unreadable {};

/// Parses expressions: the tokens at hand, and what may follow. Functions throw Unreadable after a fault.
class ExpressionParser {
 public:
  ExpressionParser(const Sources& sources, int file, std::vector<Diagnostic>& diagnostics)
      : sources_(sources),
        firstFault_(diagnostics.size()),
        tokens_(tokensOf(sources, file, diagnostics).tokens),
        tokenFaults_(diagnostics.size() - firstFault_),
        diagnostics_(diagnostics) {}

  ExpressionPtr expression();

 protected:
  const Token& here() const { return tokens_[place_]; }
  const Token& ahead(std::size_t by) const { return tokens_[std::min(place_ + by, tokens_.size() - 1)]; }
  Token take();
  bool accept(std::string_view mark);
  Span since(const Span& begin) const { return Span::joining(begin, last_); }
  [[noreturn]] void fault(Code code, const Span& span, std::string message, std::string hint = {});
  static std::string written(const Token& token);
  [[noreturn]] void unexpected(const std::string& what, std::string hint = {});
  void expect(std::string_view mark, const std::string& where);
  Token expectName(const std::string& what);

  /// A bracket, block or sign deeper, for as long as it lives.
  struct Level {
    explicit Level(ExpressionParser& parser);
    ~Level() { --parser_.depth_; }

   private:
    ExpressionParser& parser_;
  };

  std::optional<Kind> kindHere() const;
  ExpressionPtr node(ExpressionKind kind, const Span& span, std::string name = {});
  void adopt(Expression& parent, ExpressionPtr part);
  static ExpressionPtr copyOf(const Expression& from);
  /// What a target holds before it is assigned to.
  static ExpressionPtr readAgain(const Expression& target);
  ExpressionPtr operation(const Token& mark, const std::string& name, ExpressionPtr a, ExpressionPtr b);
  /// Operators of `kLevels[level]` and tighter.
  ExpressionPtr binary(std::size_t level);
  ExpressionPtr unary();
  ExpressionPtr power();
  ExpressionPtr postfix();
  ExpressionPtr literal(const Token& token, Value value, Kind kind);
  ExpressionPtr primary();
  ExpressionPtr named();
  void arguments(Expression& call);
  ExpressionPtr bracketed();
  ExpressionPtr array();

  /// Whether something in the line is no token at all, which has been told and explains the rest.
  bool isUnreadableLine(const Span& span) const;

  const Sources& sources_;
  std::size_t firstFault_;
  std::vector<Token> tokens_;
  std::size_t tokenFaults_;
  std::vector<Diagnostic>& diagnostics_;
  std::size_t place_ = 0;
  int depth_ = 0;
  Span last_{};
};

}  // namespace nephele::felt

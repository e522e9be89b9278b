#include "nephele/modeling/felt/detail/expression_parser.h"

#include <algorithm>

#include "nephele/modeling/base/printable.h"

namespace nephele::felt {

namespace {

constexpr int kDeepest = 200;
/// Chains like a + b + c + ... lean to one side and are as high as they are long.
constexpr int kHighest = 2000;

}  // namespace

ExpressionParser::Level::Level(ExpressionParser& parser) : parser_(parser) {
  if (++parser.depth_ <= kDeepest) return;
  --parser.depth_;
  parser.fault(Code::tooDeep, parser.here().span,
               "more than " + std::to_string(kDeepest) + " brackets or blocks in each other");
}

Token ExpressionParser::take() {
  Token token = here();
  last_ = token.span;
  if (place_ + 1 < tokens_.size()) ++place_;
  return token;
}

bool ExpressionParser::accept(std::string_view mark) {
  if (!here().is(mark)) return false;
  take();
  return true;
}

void ExpressionParser::fault(Code code, const Span& span, std::string message, std::string hint) {
  if (code != Code::expected || !isUnreadableLine(span))
    diagnostics_.push_back({code, span, std::move(message), std::move(hint)});
  throw Unreadable();
}

bool ExpressionParser::isUnreadableLine(const Span& span) const {
  const Source& source = sources_[span.file];
  for (std::size_t i = 0; i < tokenFaults_; ++i)
    if (const Span& fault = diagnostics_[firstFault_ + i].span;
        fault.file == span.file && source.lineStart(fault.begin) == source.lineStart(span.begin))
      return true;
  return false;
}

std::string ExpressionParser::written(const Token& token) {
  switch (token.kind) {
    case TokenKind::end:
      return "the end of the text";
    case TokenKind::text:
      return "a string";
    case TokenKind::name:
    case TokenKind::mark:
      return quoted(token.text, 40);
    default:
      return "a number";
  }
}

void ExpressionParser::unexpected(const std::string& what, std::string hint) {
  Span span = here().span;
  if (here().kind == TokenKind::end && last_.end > 0) span = {last_.file, last_.end, last_.end};
  fault(Code::expected, span, "expected " + what + ", found " + written(here()), std::move(hint));
}

void ExpressionParser::expect(std::string_view mark, const std::string& where) {
  if (accept(mark)) return;
  if (mark != ";" || last_.end == 0) unexpected(quoted(mark) + " " + where);
  // A missing semicolon is missing where the statement ends, and what begins in the next line is read as if
  // it were there.
  const Source& source = sources_[last_.file];
  const bool goesOn = here().kind != TokenKind::end &&
                      source.placeOf(here().span.begin).line > source.placeOf(last_.end - 1).line;
  const Span place{last_.file, last_.end, last_.end};
  if (!isUnreadableLine(place))
    diagnostics_.push_back(
        {Code::expected, place, "expected ';' before " + (goesOn ? "the end of the line" : written(here()))});
  if (!goesOn) throw Unreadable();
}

Token ExpressionParser::expectName(const std::string& what) {
  if (here().kind != TokenKind::name) unexpected(what);
  if (isKeyword(here().text))
    fault(Code::expected, here().span, "'" + here().text + "' is a word of the language, not " + what);
  return take();
}

std::optional<Kind> ExpressionParser::kindHere() const {
  if (here().kind != TokenKind::name) return std::nullopt;
  const auto kind = kindOf(here().text);
  return kind && *kind != Kind::anything ? kind : std::nullopt;
}

ExpressionPtr ExpressionParser::node(ExpressionKind kind, const Span& span, std::string name) {
  auto result = std::make_unique<Expression>();
  result->kind = kind;
  result->span = span;
  result->name = std::move(name);
  result->nameSpan = span;
  return result;
}

void ExpressionParser::adopt(Expression& parent, ExpressionPtr part) {
  parent.height = std::max(parent.height, part->height + 1);
  if (parent.height > kHighest)
    fault(Code::tooDeep, part->span,
          "an expression of more than " + std::to_string(kHighest) + " operations in each other",
          "give names to its parts");
  parent.parts.push_back(std::move(part));
  parent.partNames.emplace_back();
  parent.partNameSpans.emplace_back();
}

ExpressionPtr ExpressionParser::operation(const Token& mark, const std::string& name, ExpressionPtr a,
                                          ExpressionPtr b) {
  ExpressionPtr result = node(ExpressionKind::call, Span::joining(a->span, b->span), "operator" + name);
  result->nameSpan = mark.span;
  adopt(*result, std::move(a));
  adopt(*result, std::move(b));
  return result;
}

ExpressionPtr ExpressionParser::copyOf(const Expression& from) {
  auto copy = std::make_unique<Expression>();
  copy->kind = from.kind;
  copy->span = from.span;
  copy->name = from.name;
  copy->nameSpan = from.nameSpan;
  copy->literal = from.literal;
  copy->type = from.type;
  copy->partNames = from.partNames;
  copy->partNameSpans = from.partNameSpans;
  copy->height = from.height;
  for (const ExpressionPtr& part : from.parts) copy->parts.push_back(copyOf(*part));
  return copy;
}

ExpressionPtr ExpressionParser::readAgain(const Expression& target) {
  ExpressionPtr old = copyOf(target);
  if (old->kind == ExpressionKind::index) {
    Expression& index = *old->parts[1];
    const Span span = index.span;
    index = Expression{};
    index.kind = ExpressionKind::targetIndex;
    index.span = span;
    index.type = {Kind::integer};
  }
  return old;
}

ExpressionPtr ExpressionParser::expression() {
  const Level level(*this);
  ExpressionPtr first = binary(0);
  if (!here().is("?")) return first;
  take();
  ExpressionPtr result = node(ExpressionKind::conditional, first->span);
  adopt(*result, std::move(first));
  adopt(*result, expression());
  expect(":", "between the two values of '?'");
  adopt(*result, expression());
  result->span = since(result->span);
  return result;
}

ExpressionPtr ExpressionParser::binary(std::size_t level) {
  static const std::vector<std::vector<std::string_view>> kLevels{
      {"||"}, {"&&"}, {"==", "!="}, {"<", "<=", ">", ">="}, {"+", "-"}, {"*", "/", "%"}};
  if (level == kLevels.size()) return unary();
  ExpressionPtr left = binary(level + 1);
  for (;;) {
    const auto& marks = kLevels[level];
    const Token mark = here();
    if (mark.kind != TokenKind::mark || std::find(marks.begin(), marks.end(), mark.text) == marks.end())
      return left;
    take();
    ExpressionPtr right = binary(level + 1);
    if (level < 2) {
      ExpressionPtr result = node(ExpressionKind::logical, Span::joining(left->span, right->span), mark.text);
      result->nameSpan = mark.span;
      adopt(*result, std::move(left));
      adopt(*result, std::move(right));
      left = std::move(result);
    } else {
      left = operation(mark, mark.text, std::move(left), std::move(right));
    }
  }
}

ExpressionPtr ExpressionParser::unary() {
  if (!here().is("-") && !here().is("!") && !here().is("+")) return power();
  const Level level(*this);
  const Token mark = take();
  ExpressionPtr value = unary();
  if (mark.text == "+") return value;
  ExpressionPtr result =
      node(ExpressionKind::call, Span::joining(mark.span, value->span), "operator" + mark.text);
  result->nameSpan = mark.span;
  adopt(*result, std::move(value));
  return result;
}

ExpressionPtr ExpressionParser::power() {
  ExpressionPtr base = postfix();
  if (!here().is("^")) return base;
  const Level level(*this);
  const Token mark = take();
  return operation(mark, "^", std::move(base), unary());
}

ExpressionPtr ExpressionParser::postfix() {
  ExpressionPtr value = primary();
  for (;;) {
    if (here().is("[")) {
      take();
      ExpressionPtr result = node(ExpressionKind::index, value->span);
      adopt(*result, std::move(value));
      adopt(*result, expression());
      expect("]", "after the index");
      result->span = since(result->span);
      value = std::move(result);
    } else if (here().is(".")) {
      take();
      if (here().kind != TokenKind::name) unexpected("x, y or z after '.'");
      const Token name = take();
      ExpressionPtr result = node(ExpressionKind::member, Span::joining(value->span, name.span), name.text);
      result->nameSpan = name.span;
      adopt(*result, std::move(value));
      value = std::move(result);
    } else {
      return value;
    }
  }
}

ExpressionPtr ExpressionParser::literal(const Token& token, Value value, Kind kind) {
  ExpressionPtr result = node(ExpressionKind::literal, token.span);
  result->literal = std::move(value);
  result->type = {kind};
  return result;
}

ExpressionPtr ExpressionParser::primary() {
  const Token token = here();
  switch (token.kind) {
    case TokenKind::integer:
      take();
      return literal(token, token.integer, Kind::integer);
    case TokenKind::number:
      take();
      return literal(token, token.number, Kind::number);
    case TokenKind::percent:
    case TokenKind::perSide: {
      take();
      ExpressionPtr result =
          literal(token, token.kind == TokenKind::percent ? token.number * 0.01 : token.number, Kind::number);
      result->kind = token.kind == TokenKind::percent ? ExpressionKind::percent : ExpressionKind::perSide;
      return result;
    }
    case TokenKind::text:
      take();
      return literal(token, token.text, Kind::text);
    case TokenKind::name:
      return named();
    case TokenKind::mark:
      if (token.text == "(") return bracketed();
      if (token.text == "[") return array();
      break;
    case TokenKind::end:
      break;
  }
  unexpected("a value");
}

ExpressionPtr ExpressionParser::named() {
  const Token token = here();
  if (token.is("true") || token.is("false")) {
    take();
    return literal(token, token.text == "true", Kind::boolean);
  }
  const bool isType = kindHere().has_value() && !token.is("void");
  if (isKeyword(token.text) && !isType) unexpected("a value");
  take();
  if (here().is("(")) {
    ExpressionPtr call = node(ExpressionKind::call, token.span, token.text);
    arguments(*call);
    call->span = since(token.span);
    return call;
  }
  if (isType)
    fault(Code::expected, token.span, "expected a value, found the type '" + token.text + "'",
          "convert a value by " + token.text + "(...)");
  return node(ExpressionKind::variable, token.span, token.text);
}

void ExpressionParser::arguments(Expression& call) {
  expect("(", "before the arguments");
  while (!here().is(")")) {
    std::string name;
    Span nameSpan = here().span;
    if (here().kind == TokenKind::name && ahead(1).is("=")) {
      name = take().text;
      take();
    }
    adopt(call, expression());
    call.partNames.back() = std::move(name);
    call.partNameSpans.back() = nameSpan;
    if (!accept(",")) break;
  }
  expect(")", "after the arguments");
}

ExpressionPtr ExpressionParser::bracketed() {
  const Span begin = here().span;
  take();
  ExpressionPtr first = expression();
  if (accept(")")) {
    // The brackets belong to what an error underlines.
    first->span = since(begin);
    return first;
  }
  ExpressionPtr result = node(ExpressionKind::triple, begin);
  adopt(*result, std::move(first));
  while (accept(",")) adopt(*result, expression());
  expect(")", "after the components");
  result->span = since(begin);
  if (result->parts.size() != 3)
    fault(Code::expected, result->span,
          "a vector has 3 components, not " + std::to_string(result->parts.size()));
  return result;
}

ExpressionPtr ExpressionParser::array() {
  ExpressionPtr result = node(ExpressionKind::array, here().span);
  take();
  while (!here().is("]")) {
    adopt(*result, expression());
    if (!accept(",")) break;
  }
  expect("]", "after the elements of the array");
  result->span = since(result->span);
  return result;
}

}  // namespace nephele::felt

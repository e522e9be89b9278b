#include "nephele/modeling/felt/detail/parser.h"

#include <algorithm>

#include "nephele/modeling/base/nearest_name.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/felt/detail/expression_parser.h"

namespace nephele::felt {

namespace {

constexpr std::size_t kMostFaults = 50;

class Parser : public ExpressionParser {
 public:
  using ExpressionParser::ExpressionParser;

  SyntaxTree all() {
    SyntaxTree tree;
    while (here().kind != TokenKind::end && diagnostics_.size() < kMostFaults)
      if (StatementPtr statement = recovering(true)) tree.statements.push_back(std::move(statement));
    return tree;
  }

  ExpressionPtr onlyExpression() {
    try {
      ExpressionPtr result = expression();
      if (here().kind != TokenKind::end) unexpected("the end of the expression");
      return result;
    } catch (const Unreadable&) {
      return nullptr;
    }
  }

  ParsedSignature signature() {
    ParsedSignature result;
    result.declaration.result = type(true);
    header(result.declaration, &result.isOpen);
    return result;
  }

 private:
  /// A statement, or null where it could not be read; then whatever is left of it is skipped.
  StatementPtr recovering(bool atTop);
  /// The name that an unreadable declaration would have introduced, so that it is not told as unknown later;
  /// or null.
  StatementPtr brokenDeclaration(std::size_t begin);
  void skipStatement(std::size_t begin);
  /// Whether a declaration begins here: a type, then a name or brackets; `float(x)` is a conversion.
  bool declarationBegins() const;
  StatementPtr made(StatementKind kind, const Span& begin);
  StatementPtr finished(StatementPtr statement);
  StatementPtr statement(bool atTop);
  StatementPtr block();
  ExpressionPtr condition();
  StatementPtr branch(const Span& begin);
  StatementPtr forLoop(const Span& begin);
  /// A declaration, an assignment or an expression, without its semicolon.
  StatementPtr simpleStatement();
  [[noreturn]] void unknownType();
  StatementPtr stepped(const Span& begin, ExpressionPtr target, const Token& mark);
  StatementPtr assigned(const Span& begin, ExpressionPtr target, ExpressionPtr value);
  Type type(bool mayBeNothing);
  /// A name, with the brackets of an array behind it as C has them.
  DeclaredName declaredName(const Type& type, const std::string& what);
  StatementPtr declaration(const Span& begin);
  /// Name, parameters in brackets.
  void header(FunctionDeclaration& function, bool* isOpen);
  StatementPtr function(const Span& begin);
  StatementPtr parameter(const Span& begin);
  StatementPtr import(const Span& begin);
};

StatementPtr Parser::recovering(bool atTop) {
  const std::size_t begin = place_;
  try {
    return statement(atTop);
  } catch (const Unreadable&) {
    StatementPtr broken = brokenDeclaration(begin);
    skipStatement(begin);
    return broken;
  }
}

StatementPtr Parser::brokenDeclaration(std::size_t begin) {
  std::size_t at = begin + (tokens_[begin].is("param") ? 1 : 0);
  const auto tokenAt = [&](std::size_t i) -> const Token& {
    return tokens_[std::min(i, tokens_.size() - 1)];
  };
  const auto kind = tokenAt(at).kind == TokenKind::name ? kindOf(tokenAt(at).text) : std::nullopt;
  if (!kind) return nullptr;
  const bool isArray = tokenAt(at + 1).is("[") && tokenAt(at + 2).is("]");
  at += isArray ? 3 : 1;
  if (tokenAt(at).kind != TokenKind::name || isKeyword(tokenAt(at).text)) return nullptr;
  StatementPtr result = made(StatementKind::declaration, tokens_[begin].span);
  result->isBroken = true;
  DeclaredName name;
  name.type = {*kind, isArray};
  name.name = tokenAt(at).text;
  name.nameSpan = tokenAt(at).span;
  result->names.push_back(std::move(name));
  return result;
}

void Parser::skipStatement(std::size_t begin) {
  int open = 0;
  // Braces that have been opened already by the part that was read.
  for (std::size_t i = begin; i < place_; ++i) {
    if (tokens_[i].is("{")) ++open;
    if (tokens_[i].is("}")) open = std::max(0, open - 1);
  }
  while (here().kind != TokenKind::end) {
    if (here().is("{")) ++open;
    if (here().is("}")) {
      if (open <= 1) {
        if (open == 1 || depth_ == 0) take();
        return;
      }
      --open;
    }
    const bool ends = here().is(";") && open == 0;
    take();
    if (ends) return;
  }
}

bool Parser::declarationBegins() const {
  if (!kindHere()) return false;
  if (ahead(1).is("[")) return ahead(2).is("]");
  return ahead(1).kind == TokenKind::name;
}

StatementPtr Parser::made(StatementKind kind, const Span& begin) {
  auto statement = std::make_unique<Statement>();
  statement->kind = kind;
  statement->span = begin;
  return statement;
}

StatementPtr Parser::finished(StatementPtr statement) {
  statement->span = since(statement->span);
  return statement;
}

StatementPtr Parser::statement(bool atTop) {
  const Level level(*this);
  const Span begin = here().span;
  if (here().is("{")) return block();
  if (accept(";")) return finished(made(StatementKind::block, begin));
  if (here().is("func") || here().is("param") || here().is("import")) {
    if (!atTop)
      fault(Code::notAtTop, begin, "'" + here().text + "' stands inside of a block",
            "functions, parameters and imports stand outside of all braces");
    if (accept("func")) return function(begin);
    if (accept("param")) return parameter(begin);
    take();
    return import(begin);
  }
  if (accept("if")) return branch(begin);
  if (accept("for")) return forLoop(begin);
  if (accept("while")) {
    StatementPtr loop = made(StatementKind::whileLoop, begin);
    loop->expressions.push_back(condition());
    loop->parts.push_back(statement(false));
    return finished(std::move(loop));
  }
  if (accept("return")) {
    StatementPtr result = made(StatementKind::giveBack, begin);
    if (!here().is(";")) result->expressions.push_back(expression());
    expect(";", "");
    return finished(std::move(result));
  }
  if (here().is("break") || here().is("continue")) {
    const bool leaves = take().text == "break";
    expect(";", "");
    return finished(made(leaves ? StatementKind::leaveLoop : StatementKind::nextTurn, begin));
  }
  if (here().is("else")) unexpected("a statement", "this else has no if before it");
  StatementPtr simple = simpleStatement();
  expect(";", "");
  return finished(std::move(simple));
}

StatementPtr Parser::block() {
  StatementPtr result = made(StatementKind::block, here().span);
  expect("{", "at the beginning of a block");
  while (!here().is("}")) {
    if (here().kind == TokenKind::end) unexpected("'}' at the end of the block");
    if (diagnostics_.size() >= kMostFaults) throw Unreadable();
    if (StatementPtr part = recovering(false)) result->parts.push_back(std::move(part));
  }
  take();
  return finished(std::move(result));
}

ExpressionPtr Parser::condition() {
  expect("(", "before the condition");
  ExpressionPtr result = expression();
  if (here().is("=")) unexpected("')' after the condition", "two values are compared by ==");
  expect(")", "after the condition");
  return result;
}

StatementPtr Parser::branch(const Span& begin) {
  StatementPtr result = made(StatementKind::branch, begin);
  result->expressions.push_back(condition());
  result->parts.push_back(statement(false));
  if (accept("else")) result->parts.push_back(statement(false));
  return finished(std::move(result));
}

StatementPtr Parser::forLoop(const Span& begin) {
  StatementPtr loop = made(StatementKind::forLoop, begin);
  expect("(", "after 'for'");
  loop->parts.push_back(here().is(";") ? made(StatementKind::block, here().span) : simpleStatement());
  expect(";", "");
  loop->expressions.push_back(here().is(";") ? nullptr : expression());
  expect(";", "");
  StatementPtr after = here().is(")") ? made(StatementKind::block, here().span) : simpleStatement();
  expect(")", "at the end of the head of the loop");
  loop->parts.push_back(statement(false));
  loop->parts.push_back(std::move(after));
  return finished(std::move(loop));
}

StatementPtr Parser::simpleStatement() {
  const Span begin = here().span;
  if (declarationBegins()) return declaration(begin);
  if (here().kind == TokenKind::name && ahead(1).kind == TokenKind::name && !isKeyword(here().text) &&
      (ahead(2).is("=") || ahead(2).is(";") || ahead(2).is("(")))
    unknownType();
  if (here().is("++") || here().is("--")) {
    const Token mark = take();
    ExpressionPtr target = postfix();
    return stepped(begin, std::move(target), mark);
  }
  ExpressionPtr first = expression();
  if (here().is("++") || here().is("--")) {
    const Token mark = take();
    return stepped(begin, std::move(first), mark);
  }
  for (const std::string_view mark : {"=", "+=", "-=", "*=", "/=", "^="}) {
    if (!here().is(mark)) continue;
    const Token token = take();
    ExpressionPtr value = expression();
    if (mark != "=") {
      ExpressionPtr old = readAgain(*first);
      value = operation(token, std::string(mark.substr(0, 1)), std::move(old), std::move(value));
    }
    return assigned(begin, std::move(first), std::move(value));
  }
  StatementPtr result = made(StatementKind::expression, begin);
  result->expressions.push_back(std::move(first));
  return finished(std::move(result));
}

void Parser::unknownType() {
  std::vector<std::string> types;
  for (int kind = static_cast<int>(Kind::integer); kind <= static_cast<int>(Kind::shape); ++kind)
    types.push_back(typeName({static_cast<Kind>(kind)}));
  const std::string near = nearestName(here().text, types);
  std::string all;
  for (const std::string& name : types) all += (all.empty() ? "" : ", ") + name;
  fault(Code::unknownType, here().span, "there is no type '" + printable(here().text, 40) + "'",
        near.empty() ? "the types are " + all : "did you mean `" + near + "`?");
}

StatementPtr Parser::stepped(const Span& begin, ExpressionPtr target, const Token& mark) {
  auto one = std::make_unique<Expression>();
  one->span = mark.span;
  one->literal = std::int64_t(1);
  one->type = {Kind::integer};
  ExpressionPtr old = readAgain(*target);
  ExpressionPtr value = operation(mark, mark.text.substr(0, 1), std::move(old), std::move(one));
  return assigned(begin, std::move(target), std::move(value));
}

StatementPtr Parser::assigned(const Span& begin, ExpressionPtr target, ExpressionPtr value) {
  StatementPtr result = made(StatementKind::assignment, begin);
  result->expressions.push_back(std::move(target));
  result->expressions.push_back(std::move(value));
  return finished(std::move(result));
}

Type Parser::type(bool mayBeNothing) {
  const auto kind = here().kind == TokenKind::name ? kindOf(here().text) : std::nullopt;
  if (!kind) {
    if (here().kind == TokenKind::name && !isKeyword(here().text)) unknownType();
    unexpected("a type");
  }
  if (*kind == Kind::nothing && !mayBeNothing) unexpected("a type of values", "only functions may be void");
  take();
  Type result{*kind, false};
  if (accept("[")) {
    expect("]", "after '[' of an array's type");
    result.isArray = true;
  }
  return result;
}

DeclaredName Parser::declaredName(const Type& type, const std::string& what) {
  const Token token = expectName(what);
  DeclaredName name{type, token.text, token.span};
  if (accept("[")) {
    expect("]", "after '['");
    name.type.isArray = true;
  }
  return name;
}

StatementPtr Parser::declaration(const Span& begin) {
  StatementPtr result = made(StatementKind::declaration, begin);
  const Span typeSpan = here().span;
  const Type declared = type(false);
  do {
    DeclaredName name = declaredName(declared, "a name for the variable");
    if (accept("=")) {
      name.value = expression();
    } else if (here().is("(")) {
      auto call = std::make_unique<Expression>();
      call->kind = ExpressionKind::call;
      call->span = name.nameSpan;
      call->name = typeName(declared);
      call->nameSpan = typeSpan;
      arguments(*call);
      call->span = since(name.nameSpan);
      name.value = std::move(call);
    }
    result->names.push_back(std::move(name));
  } while (accept(","));
  return finished(std::move(result));
}

void Parser::header(FunctionDeclaration& function, bool* isOpen) {
  const bool isOperator = isOpen != nullptr;
  Token name = here();
  // Signatures of conversions and operators are named by words of the language.
  if (isOperator && name.kind == TokenKind::name) {
    take();
    if (name.text == "operator") {
      const Token mark = take();
      name.text += mark.text;
      if (mark.text == "(" || mark.text == "[") unexpected("an operator");
    }
  } else {
    name = expectName("the name of the function");
  }
  function.name = name.text;
  function.nameSpan = name.span;
  expect("(", "before the parameters");
  while (!here().is(")")) {
    if (isOpen != nullptr && here().is(".")) {
      while (accept(".")) {
      }
      *isOpen = true;
      break;
    }
    const Type declared = type(false);
    DeclaredName parameter = declaredName(declared, "a name for the parameter");
    if (accept("=")) parameter.value = expression();
    function.parameters.push_back(std::move(parameter));
    if (!accept(",")) break;
  }
  expect(")", "after the parameters");
}

StatementPtr Parser::function(const Span& begin) {
  StatementPtr result = made(StatementKind::function, begin);
  result->function = std::make_unique<FunctionDeclaration>();
  result->function->result = type(true);
  header(*result->function, nullptr);
  result->function->span = since(begin);
  if (!here().is("{")) unexpected("'{' at the beginning of the function");
  result->function->body = block();
  return finished(std::move(result));
}

StatementPtr Parser::parameter(const Span& begin) {
  StatementPtr result = made(StatementKind::parameter, begin);
  result->parameter = std::make_unique<ParameterDeclaration>();
  ParameterDeclaration& parameter = *result->parameter;
  const Type declared = type(false);
  parameter.declared = declaredName(declared, "the name of the parameter");
  expect("=", "and the value that it has if nobody sets it");
  parameter.declared.value = expression();
  if (accept("in")) {
    if (here().is("color") || here().is("colour")) {
      take();
      parameter.isColor = true;
    } else {
      expect("[", "before the lowest value or the first choice");
      do parameter.allowed.push_back(expression());
      while (accept(","));
      expect("]", "after the highest value or the last choice");
    }
  }
  if (here().kind == TokenKind::text) parameter.text = take().text;
  expect(";", "");
  return finished(std::move(result));
}

StatementPtr Parser::import(const Span& begin) {
  StatementPtr result = made(StatementKind::import, begin);
  if (here().kind != TokenKind::text) unexpected("the path of a script between \"");
  result->path = take().text;
  expect(";", "");
  return finished(std::move(result));
}

}  // namespace

std::string FunctionDeclaration::signature() const {
  std::string text = typeName(result) + " " + name + "(";
  for (std::size_t i = 0; i < parameters.size(); ++i)
    text += (i == 0 ? "" : ", ") + typeName(parameters[i].type) + " " + parameters[i].name;
  return text + ")";
}

SyntaxTree parse(const Sources& sources, int file, std::vector<Diagnostic>& diagnostics) {
  return Parser(sources, file, diagnostics).all();
}

ExpressionPtr parseExpression(const Sources& sources, int file, std::vector<Diagnostic>& diagnostics) {
  const std::size_t before = diagnostics.size();
  ExpressionPtr result = Parser(sources, file, diagnostics).onlyExpression();
  return diagnostics.size() == before ? std::move(result) : nullptr;
}

ParsedSignature parseSignature(const std::string& text) {
  Sources sources;
  std::vector<Diagnostic> diagnostics;
  const int file = sources.add("signature", text);
  try {
    ParsedSignature result = Parser(sources, file, diagnostics).signature();
    if (diagnostics.empty()) return result;
  } catch (const Unreadable&) {
  }
  throw ScriptError(std::move(diagnostics), sources);
}

}  // namespace nephele::felt

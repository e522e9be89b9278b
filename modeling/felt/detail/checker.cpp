#include "nephele/modeling/felt/detail/checker.h"

#include <algorithm>

#include "nephele/modeling/base/printable.h"

namespace nephele::felt {

int Checker::declare(const std::string& name, const Type& type) {
  const int slot = static_cast<int>(globals_.size());
  globals_.push_back({name, type, 0, true});
  given_ = slot + 1;
  scopes_.front()[name] = {slot, true};
  return slot;
}

int Checker::slotOf(const std::string& name) const {
  const auto found = scopes_.front().find(name);
  return found == scopes_.front().end() ? -1 : found->second.slot;
}

void Checker::check(std::vector<StatementPtr>& statements, std::vector<Diagnostic>& diagnostics,
                    bool mayRedeclare) {
  diagnostics_ = &diagnostics;
  mayRedeclare_ = mayRedeclare;
  const std::size_t before = diagnostics.size();
  const auto scopes = scopes_;
  const auto functions = functions_;
  collectFunctions(statements, mayRedeclare);
  for (const StatementPtr& part : statements) statement(*part);
  const bool failed =
      std::any_of(diagnostics.begin() + static_cast<std::ptrdiff_t>(before), diagnostics.end(),
                  [](const Diagnostic& diagnostic) { return diagnostic.severity == Severity::error; });
  if (failed) {
    scopes_ = scopes;
    functions_ = functions;
  }
}

void Checker::checkExpression(ExpressionPtr& expression, const Type& wanted,
                              std::vector<Diagnostic>& diagnostics) {
  diagnostics_ = &diagnostics;
  if (this->expression(expression, wanted) && wanted.kind != Kind::nothing)
    convert(expression, wanted, "the expression");
}

void Checker::fault(Code code, const Span& span, std::string message, std::string hint) {
  diagnostics_->push_back({code, span, std::move(message), std::move(hint)});
}

const Checker::Seen* Checker::find(const std::string& name) const {
  for (auto scope = scopes_.rbegin(); scope != scopes_.rend(); ++scope)
    if (const auto found = scope->find(name); found != scope->end()) return &found->second;
  return nullptr;
}

int Checker::declare(const DeclaredName& name, bool mayRedeclare) {
  Scope& scope = scopes_.back();
  const auto known = scope.find(name.name);
  // What is there before the script begins may be hidden by it.
  const bool isGiven = known != scope.end() && scopes_.size() == 1 &&
                       globals_[known->second.slot].isOutermost && known->second.slot < given_;
  if (known != scope.end() && !mayRedeclare && !isGiven)
    fault(Code::declaredTwice, name.nameSpan, "'" + name.name + "' is declared twice",
          "assign to it without a type, or choose another name");
  const bool isGlobal = function_ == nullptr;
  std::vector<Variable>& all = variables(isGlobal);
  const int slot = static_cast<int>(all.size());
  all.push_back({name.name, name.type, 0, isGlobal && scopes_.size() == 1});
  scope[name.name] = {slot, isGlobal};
  return slot;
}

std::vector<std::string> Checker::namesInSight() const {
  std::vector<std::string> names;
  for (const Scope& scope : scopes_)
    for (const auto& [name, seen] : scope) names.push_back(name);
  return names;
}

void Checker::collectFunctions(const std::vector<StatementPtr>& statements, bool mayRedeclare) {
  for (const StatementPtr& statement : statements) {
    if (statement->kind != StatementKind::function) continue;
    const FunctionDeclaration& added = *statement->function;
    const auto [begin, end] = functions_.equal_range(added.name);
    for (auto other = begin; other != end; ++other) {
      const bool same =
          std::equal(added.parameters.begin(), added.parameters.end(), other->second->parameters.begin(),
                     other->second->parameters.end(),
                     [](const DeclaredName& a, const DeclaredName& b) { return a.type == b.type; });
      if (!same) continue;
      if (!mayRedeclare)
        fault(Code::declaredTwice, added.nameSpan,
              "the function '" + added.signature() + "' is there already");
      functions_.erase(other);
      break;
    }
    functions_.emplace(added.name, &added);
  }
}

void Checker::statement(Statement& statement) {
  switch (statement.kind) {
    case StatementKind::block:
      return block(statement);
    case StatementKind::declaration:
      return declaration(statement);
    case StatementKind::assignment:
      return assignment(statement);
    case StatementKind::expression:
      expression(statement.expressions[0]);
      return;
    case StatementKind::branch:
      condition(statement.expressions[0]);
      for (const StatementPtr& part : statement.parts) {
        scopes_.emplace_back();
        this->statement(*part);
        scopes_.pop_back();
      }
      return;
    case StatementKind::forLoop:
    case StatementKind::whileLoop:
      return loop(statement);
    case StatementKind::giveBack:
      return giveBack(statement);
    case StatementKind::leaveLoop:
    case StatementKind::nextTurn:
      if (loops_ == 0)
        fault(Code::outsideLoop, statement.span,
              statement.kind == StatementKind::leaveLoop ? "this break is in no loop"
                                                         : "this continue is in no loop");
      return;
    case StatementKind::function:
      return function(*statement.function);
    case StatementKind::parameter:
      return parameter(*statement.parameter);
    case StatementKind::import:
      return;
  }
}

void Checker::block(Statement& block) {
  scopes_.emplace_back();
  for (const StatementPtr& part : block.parts) statement(*part);
  scopes_.pop_back();
}

void Checker::loop(Statement& loop) {
  scopes_.emplace_back();
  std::size_t body = 0;
  if (loop.kind == StatementKind::forLoop) {
    // Not a block of its own: what it declares is seen by the rest of the loop.
    if (loop.parts[0]->kind != StatementKind::block) statement(*loop.parts[0]);
    body = 1;
  }
  ++loops_;
  if (loop.expressions[0]) condition(loop.expressions[0]);
  scopes_.emplace_back();
  statement(*loop.parts[body]);
  scopes_.pop_back();
  if (loop.kind == StatementKind::forLoop) statement(*loop.parts[2]);
  --loops_;
  scopes_.pop_back();
}

void Checker::declaration(Statement& statement) {
  for (DeclaredName& name : statement.names) {
    if (name.value && expression(name.value, name.type))
      convert(name.value, name.type, "'" + name.name + "'");
    const bool needsValue = !statement.isBroken && !name.type.isArray && !name.value &&
                            (name.type.kind == Kind::domain || name.type.kind == Kind::scalarCache ||
                             name.type.kind == Kind::vectorCache || name.type.kind == Kind::matrixCache);
    if (needsValue)
      fault(Code::noValue, name.nameSpan,
            "the " + typeName(name.type) + " '" + name.name + "' needs arguments",
            name.type.kind == Kind::domain
                ? "domain " + name.name + "(origin, lengths, rotation, cell, cell, cell);"
                : typeName(name.type) + " " + name.name + "(domain);");
    name.slot = declare(name, mayRedeclare_ && function_ == nullptr && scopes_.size() == 1);
  }
}

void Checker::assignment(Statement& statement) {
  ExpressionPtr& target = statement.expressions[0];
  ExpressionPtr& value = statement.expressions[1];
  const bool isElement =
      target->kind == ExpressionKind::index && target->parts[0]->kind == ExpressionKind::variable;
  if (target->kind != ExpressionKind::variable && !isElement) {
    fault(Code::notAssignable, target->span, "nothing can be assigned to this",
          "assign to a variable, or to an element of an array");
    expression(value);
    return;
  }
  Expression& name = isElement ? *target->parts[0] : *target;
  if (!variable(name)) {
    expression(value);
    return;
  }
  --variables(name.isGlobal)[name.slot].reads;
  Type type = name.type;
  if (isElement) {
    if (!type.isArray) {
      fault(Code::notAssignable, target->span,
            "'" + name.name + "' is no array but " + articledName(type) +
                ", which has no elements to assign to",
            type.kind == Kind::vector ? name.name + " = vector(x, y, z) makes a new one" : "");
      return;
    }
    type = type.element();
    if (expression(target->parts[1])) convert(target->parts[1], {Kind::integer}, "an index");
  }
  target->type = type;
  if (expression(value, type)) convert(value, type, "'" + name.name + "'");
}

void Checker::condition(ExpressionPtr& expression) {
  if (this->expression(expression)) convert(expression, {Kind::boolean}, "a condition");
}

void Checker::giveBack(Statement& statement) {
  if (function_ == nullptr) {
    fault(Code::outsideFunction, statement.span, "this return is in no function");
    return;
  }
  const Type result = function_->result;
  if (statement.expressions.empty()) {
    if (result.kind != Kind::nothing)
      fault(Code::wrongType, statement.span,
            "'" + function_->name + "' returns " + articledName(result) + ", and this returns nothing");
    return;
  }
  if (!expression(statement.expressions[0], result)) return;
  if (result.kind == Kind::nothing)
    fault(Code::wrongType, statement.expressions[0]->span,
          "'" + function_->name + "' is void and returns nothing");
  else
    convert(statement.expressions[0], result, "what '" + function_->name + "' returns");
}

void Checker::function(FunctionDeclaration& function) {
  for (DeclaredName& parameter : function.parameters)
    if (parameter.value && expression(parameter.value, parameter.type))
      convert(parameter.value, parameter.type, "'" + parameter.name + "'");
  function_ = &function;
  locals_[function_];
  scopes_.emplace_back();
  const int loops = loops_;
  loops_ = 0;
  for (DeclaredName& parameter : function.parameters) parameter.slot = declare(parameter, false);
  // The body is one scope with the parameters: a second variable of their name is an error.
  for (const StatementPtr& part : function.body->parts) statement(*part);
  scopes_.pop_back();
  loops_ = loops;
  function.frameSize = static_cast<int>(locals_[function_].size());
  if (function.result.kind != Kind::nothing && !alwaysReturns(*function.body))
    fault(Code::noReturn, function.nameSpan,
          "'" + function.name + "' may end without returning " + articledName(function.result),
          "let every way through it end with return");
  function_ = nullptr;
}

bool Checker::alwaysReturns(const Statement& statement) {
  switch (statement.kind) {
    case StatementKind::giveBack:
      return true;
    case StatementKind::block:
      return std::any_of(statement.parts.begin(), statement.parts.end(),
                         [](const StatementPtr& part) { return alwaysReturns(*part); });
    case StatementKind::branch:
      return statement.parts.size() == 2 && alwaysReturns(*statement.parts[0]) &&
             alwaysReturns(*statement.parts[1]);
    default:
      return false;
  }
}

void Checker::warnOfIntegers(const Expression& call) {
  if (call.name != "operator/" || call.parts.size() != 2) return;
  const Expression &a = *call.parts[0], &b = *call.parts[1];
  if (a.kind != ExpressionKind::literal || b.kind != ExpressionKind::literal ||
      !a.literal.is<std::int64_t>() || !b.literal.is<std::int64_t>())
    return;
  const std::int64_t above = a.literal.as<std::int64_t>(), below = b.literal.as<std::int64_t>();
  if (below == 0 || above % below == 0) return;
  diagnostics_->push_back(
      {Code::divisionOfIntegers, call.span,
       std::to_string(above) + "/" + std::to_string(below) + " of integers is " +
           std::to_string(above / below),
       "write " + std::to_string(above) + ".0/" + std::to_string(below) + " for a fraction",
       Severity::warning});
}

void Checker::parameter(ParameterDeclaration& parameter) {
  DeclaredName& declared = parameter.declared;
  const Type type = declared.type;
  const bool isPlain = type.kind == Kind::integer || type.kind == Kind::number ||
                       type.kind == Kind::boolean || type.kind == Kind::text || type.kind == Kind::vector;
  if (!isPlain)
    fault(Code::wrongType, declared.nameSpan,
          "a parameter is an int, float, bool, string or vector, not " + articledName(type));
  if (expression(declared.value, type)) convert(declared.value, type, "'" + declared.name + "'");
  for (ExpressionPtr& allowed : parameter.allowed)
    if (expression(allowed, type.element())) convert(allowed, type.element(), "a value that is allowed");
  const bool isNumber = type.kind == Kind::integer || type.kind == Kind::number;
  if (isNumber && parameter.allowed.size() == 1)
    fault(Code::badRange, declared.nameSpan, "the range of '" + declared.name + "' has one end",
          "in [lowest, highest]");
  if ((type.kind == Kind::boolean || type.kind == Kind::vector) && !parameter.allowed.empty())
    fault(Code::badRange, declared.nameSpan, articledName(type) + " has no range",
          type.kind == Kind::vector ? "in color says that it is a colour" : "");
  if (parameter.isColor && type.kind != Kind::vector)
    fault(Code::badRange, declared.nameSpan, "a colour is a vector, not " + articledName(type));
  declared.slot = declare(declared, mayRedeclare_);
}

}  // namespace nephele::felt

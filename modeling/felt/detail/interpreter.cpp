#include "nephele/modeling/felt/detail/interpreter.h"

#include <algorithm>
#include <set>
#include <utility>

#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/field/constant_node.h"
#include "nephele/modeling/field/operations.h"

namespace nephele::felt {

namespace {

const void* nodeOf(const Value& value) {
  if (value.is<ScalarField>()) return value.as<ScalarField>().node().get();
  if (value.is<VectorField>()) return value.as<VectorField>().node().get();
  if (value.is<MatrixField>()) return value.as<MatrixField>().node().get();
  return nullptr;
}

bool isConstant(const Value& field) {
  if (field.is<ScalarField>()) return nephele::detail::constantOf(field.as<ScalarField>().node()) != nullptr;
  if (field.is<VectorField>()) return nephele::detail::constantOf(field.as<VectorField>().node()) != nullptr;
  return nephele::detail::constantOf(field.as<MatrixField>().node()) != nullptr;
}

double asNumber(const Value& value) {
  return value.is<std::int64_t>() ? static_cast<double>(value.as<std::int64_t>()) : value.as<double>();
}

/// Whether numbers are the ends of a range: two of them are, more are choices, as strings always are.
bool isRange(const std::vector<Value>& allowed, const Type& type) {
  return type.kind != Kind::text && allowed.size() == 2;
}

bool isAllowed(const Value& value, const Type& type, const std::vector<Value>& allowed) {
  if (allowed.empty()) return true;
  if (type.isArray)
    return std::all_of(value.as<Array>()->begin(), value.as<Array>()->end(),
                       [&](const Value& element) { return isAllowed(element, type.element(), allowed); });
  if (isRange(allowed, type))
    return asNumber(value) >= asNumber(allowed[0]) && asNumber(value) <= asNumber(allowed[1]);
  return std::any_of(allowed.begin(), allowed.end(), [&](const Value& choice) {
    return type.kind == Kind::text ? choice.as<std::string>() == value.as<std::string>()
                                   : asNumber(choice) == asNumber(value);
  });
}

std::string allowedText(const std::vector<Value>& allowed, const Type& type) {
  if (isRange(allowed, type)) return "from " + shown(allowed[0], type) + " to " + shown(allowed[1], type);
  std::string list;
  for (const Value& choice : allowed) list += (list.empty() ? "" : ", ") + shown(choice, type);
  return "one of " + list;
}

}  // namespace

void Interpreter::fail(Code code, const Span& span, std::string message, std::string hint) {
  throw RunFault{{code, span, std::move(message), std::move(hint)}};
}

void Interpreter::begin() {
  if (globals_.size() < checker_.globals().size()) globals_.resize(checker_.globals().size());
  statements_ = 0;
}

void Interpreter::run(const std::vector<StatementPtr>& statements) {
  begin();
  for (const StatementPtr& statement : statements) carryOut(*statement);
}

void Interpreter::countStatement(const Span& span) {
  if (++statements_ > context_.limits.statements)
    fail(Code::limit, span,
         "the script has carried out " + std::to_string(context_.limits.statements) + " statements",
         "is there a loop without end? the limit max-statements allows more");
  if (statements_ % 256 == 0) context_.progress->check();
}

Interpreter::Flow Interpreter::carryOut(const Statement& statement) {
  countStatement(statement.span);
  switch (statement.kind) {
    case StatementKind::block:
      return block(statement);
    case StatementKind::declaration:
      declaration(statement);
      return Flow::on;
    case StatementKind::assignment:
      assignment(statement);
      return Flow::on;
    case StatementKind::expression:
      evaluate(*statement.expressions[0]);
      return Flow::on;
    case StatementKind::branch:
      if (isTrue(*statement.expressions[0])) return carryOut(*statement.parts[0]);
      return statement.parts.size() == 2 ? carryOut(*statement.parts[1]) : Flow::on;
    case StatementKind::forLoop:
    case StatementKind::whileLoop:
      return loop(statement);
    case StatementKind::giveBack:
      result_ = statement.expressions.empty() ? Value() : evaluate(*statement.expressions[0]);
      return Flow::giveBack;
    case StatementKind::leaveLoop:
      return Flow::leaveLoop;
    case StatementKind::nextTurn:
      return Flow::nextTurn;
    case StatementKind::parameter:
      parameter(*statement.parameter);
      return Flow::on;
    case StatementKind::function:
    case StatementKind::import:
      return Flow::on;
  }
  return Flow::on;
}

Interpreter::Flow Interpreter::block(const Statement& statement) {
  for (const StatementPtr& part : statement.parts)
    if (const Flow flow = carryOut(*part); flow != Flow::on) return flow;
  return Flow::on;
}

Interpreter::Flow Interpreter::loop(const Statement& statement) {
  const bool isFor = statement.kind == StatementKind::forLoop;
  if (isFor) carryOut(*statement.parts[0]);
  const Statement& body = *statement.parts[isFor ? 1 : 0];
  while (!statement.expressions[0] || isTrue(*statement.expressions[0])) {
    countStatement(statement.span);
    const Flow flow = carryOut(body);
    if (flow == Flow::giveBack) return flow;
    if (flow == Flow::leaveLoop) break;
    if (isFor) carryOut(*statement.parts[2]);
  }
  return Flow::on;
}

void Interpreter::declaration(const Statement& statement) {
  for (const DeclaredName& name : statement.names) {
    const bool isGlobal = function_ == nullptr;
    Value value;
    if (name.value)
      value = evaluate(*name.value);
    else if (name.type.isArray)
      value = Array(std::make_shared<const std::vector<Value>>());
    variable(isGlobal, name.slot) = remembered(std::move(value), isGlobal, name.slot);
  }
}

Value Interpreter::remembered(Value value, bool isGlobal, int slot) {
  // Constants and the point itself, of depth 0, cost no more than what would be remembered.
  if (nodeOf(value) == nullptr || value.depth == 0 || value.isRemembered) return value;
  const Variable& variable = isGlobal ? checker_.globals()[slot] : checker_.locals(*function_)[slot];
  if (variable.reads < 2) return value;
  const int depth = value.depth;
  const void* const node = nodeOf(value);
  if (value.is<ScalarField>())
    value = memo(value.as<ScalarField>());
  else if (value.is<VectorField>())
    value = memo(value.as<VectorField>());
  else
    value = memo(value.as<MatrixField>());
  value.depth = depth + 1;
  value.isRemembered = true;
  // It counts as the operation that it remembers.
  if (const auto made = made_.find(node); keepsParts_ && made != made_.end())
    made_.emplace(nodeOf(value), Made{value, made->second.parts});
  return value;
}

void Interpreter::assignment(const Statement& statement) {
  const Expression& target = *statement.expressions[0];
  if (target.kind == ExpressionKind::variable) {
    Value value = evaluate(*statement.expressions[1]);
    variable(target.isGlobal, target.slot) = remembered(std::move(value), target.isGlobal, target.slot);
    return;
  }
  const Expression& name = *target.parts[0];
  const std::int64_t index = evaluate(*target.parts[1]).as<std::int64_t>();
  const std::int64_t outer = std::exchange(targetIndex_, index);
  Value value = evaluate(*statement.expressions[1]);
  targetIndex_ = outer;
  Value& array = variable(name.isGlobal, name.slot);
  const std::int64_t size = array.isSet() ? static_cast<std::int64_t>(array.as<Array>()->size()) : 0;
  if (index < 0 || index > size)
    fail(Code::outOfRange, target.parts[1]->span,
         "'" + name.name + "' has " + std::to_string(size) + " elements, and this would be number " +
             std::to_string(index),
         "elements are numbered from 0, and an array grows by one at its end");
  if (index >= context_.limits.elements)
    fail(Code::limit, target.span,
         "'" + name.name + "' has " + std::to_string(context_.limits.elements) +
             " elements, the most that an array may have",
         "the limit max-elements allows more");
  // Nobody else holds the array that is written most of the time, so that growing it stays linear.
  auto held = array.isSet() ? std::const_pointer_cast<std::vector<Value>>(array.as<Array>())
                            : std::make_shared<std::vector<Value>>();
  array = Value();
  if (held.use_count() > 1) held = std::make_shared<std::vector<Value>>(*held);
  if (index == size)
    held->push_back(std::move(value));
  else
    (*held)[static_cast<std::size_t>(index)] = std::move(value);
  array = Array(std::move(held));
}

void Interpreter::parameter(const ParameterDeclaration& parameter) {
  const DeclaredName& declared = parameter.declared;
  const auto set = settings_.find(declared.slot);
  const Expression& expression = set != settings_.end() ? *set->second : *declared.value;
  Value value = evaluate(expression);
  std::vector<Value> allowed;
  for (const ExpressionPtr& one : parameter.allowed) allowed.push_back(evaluate(*one));
  if (!isAllowed(value, declared.type, allowed))
    fail(Code::outOfRange, expression.span,
         quoted(declared.name) + " is " + printable(shown(value, declared.type), 60) + ", and may be " +
             allowedText(allowed, declared.type.element()));
  variable(true, declared.slot) = std::move(value);
}

double Interpreter::longestSide(const Expression& expression) const {
  if (!context_.longestSide)
    fail(Code::noValue, expression.span, "a share of the longest side, and there is no main shape yet",
         "read a shape first, or write the length in world units");
  return *context_.longestSide;
}

Value Interpreter::evaluate(const Expression& expression) {
  switch (expression.kind) {
    case ExpressionKind::literal:
      return expression.literal;
    case ExpressionKind::targetIndex:
      return targetIndex_;
    case ExpressionKind::percent:
      return expression.literal.as<double>() * longestSide(expression);
    case ExpressionKind::perSide:
      return expression.literal.as<double>() / longestSide(expression);
    case ExpressionKind::variable: {
      const Value& value = variable(expression.isGlobal, expression.slot);
      if (!value.isSet())
        fail(Code::noValue, expression.span, "'" + expression.name + "' has no value yet",
             "assign to it before it is read");
      return value;
    }
    case ExpressionKind::call:
      return call(expression);
    case ExpressionKind::logical: {
      const bool first = isTrue(*expression.parts[0]);
      if (first == (expression.name == "||")) return first;
      return isTrue(*expression.parts[1]);
    }
    case ExpressionKind::conditional:
      return evaluate(*expression.parts[isTrue(*expression.parts[0]) ? 1 : 2]);
    case ExpressionKind::index:
      return element(expression);
    case ExpressionKind::array: {
      auto elements = std::make_shared<std::vector<Value>>();
      for (const ExpressionPtr& part : expression.parts) elements->push_back(evaluate(*part));
      return Array(std::move(elements));
    }
    case ExpressionKind::conversion:
      return converted(evaluate(*expression.parts[0]), expression.type);
    case ExpressionKind::member:
    case ExpressionKind::triple:
      break;
  }
  fail(Code::failed, expression.span, "this cannot be evaluated");
}

Value Interpreter::element(const Expression& expression) {
  const Value array = evaluate(*expression.parts[0]);
  const std::int64_t index = evaluate(*expression.parts[1]).as<std::int64_t>();
  const std::vector<Value>& elements = *array.as<Array>();
  if (index < 0 || index >= static_cast<std::int64_t>(elements.size()))
    fail(
        Code::outOfRange, expression.parts[1]->span,
        "there is no element " + std::to_string(index) + " in an array of " + std::to_string(elements.size()),
        "elements are numbered from 0");
  return elements[static_cast<std::size_t>(index)];
}

Value Interpreter::call(const Expression& call) {
  return call.function != nullptr ? callBuiltIn(call) : callOwn(call);
}

Value Interpreter::callBuiltIn(const Expression& call) {
  std::vector<Value> arguments;
  std::vector<Type> types;
  int depth = -1;
  for (const ExpressionPtr& part : call.parts) {
    arguments.push_back(evaluate(*part));
    types.push_back(part->type);
    depth = std::max(depth, arguments.back().depth);
  }
  Call made{arguments, types, context_};
  Value result;
  try {
    result = call.function->run(made);
  } catch (const Cancelled&) {
    throw;
  } catch (const ScriptError&) {
    throw;
  } catch (const CallError& error) {
    fail(error.code(), call.span, error.what(), error.hint());
  } catch (const Error& error) {
    fail(call.function->isOfData ? Code::failed : Code::outOfRange, call.span, error.what());
  }
  if (const void* node = nodeOf(result)) {
    if (!isConstant(result)) result.depth = call.function->isSampled ? 1 : depth + 1;
    if (result.depth > context_.limits.depth)
      fail(Code::limit, call.span,
           "a field of more than " + std::to_string(context_.limits.depth) + " operations in each other",
           "sample it into a cache, or the limit max-depth allows more");
    if (keepsParts_ && made_.find(node) == made_.end()) {
      Made entry{result, {}};
      for (const Value& argument : arguments)
        if (const void* part = call.function->isSampled ? nullptr : nodeOf(argument))
          entry.parts.push_back(part);
      made_.emplace(node, std::move(entry));
    }
  }
  return result;
}

Value Interpreter::callOwn(const Expression& call) {
  const FunctionDeclaration& function = *call.declaration;
  if (calls_ >= context_.limits.calls)
    fail(Code::limit, call.span, std::to_string(calls_) + " calls are under way at the same time",
         "does '" + function.name + "' call itself for ever? the limit max-calls allows more");
  std::vector<Value> arguments;
  for (std::size_t i = 0; i < function.parameters.size(); ++i)
    arguments.push_back(evaluate(call.parts[i] ? *call.parts[i] : *function.parameters[i].value));

  const std::size_t frame = frame_;
  const FunctionDeclaration* const caller = function_;
  frame_ = locals_.size();
  function_ = &function;
  ++calls_;
  locals_.resize(frame_ + static_cast<std::size_t>(function.frameSize));
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const int slot = function.parameters[i].slot;
    locals_[frame_ + slot] = remembered(std::move(arguments[i]), false, slot);
  }
  result_ = Value();
  const auto leave = [&] {
    locals_.resize(frame_);
    frame_ = frame;
    function_ = caller;
    --calls_;
  };
  try {
    block(*function.body);
  } catch (RunFault& fault) {
    fault.diagnostic.calls.push_back(call.span);
    leave();
    throw;
  } catch (...) {
    leave();
    throw;
  }
  leave();
  return std::move(result_);
}

std::size_t Interpreter::operationsOf(const Value& field) const {
  std::set<const void*> seen;
  std::vector<const void*> open{nodeOf(field)};
  while (!open.empty()) {
    const void* node = open.back();
    open.pop_back();
    if (node == nullptr || !seen.insert(node).second) continue;
    if (const auto made = made_.find(node); made != made_.end())
      open.insert(open.end(), made->second.parts.begin(), made->second.parts.end());
  }
  return seen.size();
}

}  // namespace nephele::felt

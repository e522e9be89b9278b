#include <algorithm>
#include <limits>
#include <set>

#include "nephele/modeling/base/nearest_name.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/felt/detail/checker.h"

namespace nephele::felt {

/// A function that a call may mean.
struct Checker::Candidate {
  const Function* function = nullptr;
  const FunctionDeclaration* declaration = nullptr;

  std::size_t parameterCount() const {
    return function ? function->parameters.size() : declaration->parameters.size();
  }
  const Type& type(std::size_t i) const {
    return function ? function->parameters[i].type : declaration->parameters[i].type;
  }
  const std::string& name(std::size_t i) const {
    return function ? function->parameters[i].name : declaration->parameters[i].name;
  }
  bool hasStandard(std::size_t i) const {
    return function ? function->parameters[i].standard.has_value()
                    : declaration->parameters[i].value != nullptr;
  }
  bool isOpen() const { return function && function->isOpen; }
  std::string signature() const { return function ? function->signature : declaration->signature(); }
};

namespace {

constexpr int kNoMatch = std::numeric_limits<int>::max();
constexpr std::size_t kLeftOut = std::size_t(-1);
constexpr std::size_t kShownSignatures = 6;

/// For each parameter the argument that it gets, and further ones; empty if that does not go.
template <class Candidate>
std::vector<std::size_t> argumentsFor(const Expression& call, const Candidate& candidate) {
  std::vector<std::size_t> places(candidate.parameterCount(), kLeftOut);
  std::size_t next = 0;
  for (std::size_t i = 0; i < call.parts.size(); ++i) {
    if (call.partNames[i].empty()) {
      if (next < candidate.parameterCount() && places[next] == kLeftOut)
        places[next++] = i;
      else if (next >= candidate.parameterCount() && candidate.isOpen())
        places.push_back(i);
      else
        return {};
      continue;
    }
    std::size_t named = 0;
    while (named < candidate.parameterCount() && candidate.name(named) != call.partNames[i]) ++named;
    if (named == candidate.parameterCount() || places[named] != kLeftOut) return {};
    places[named] = i;
  }
  for (std::size_t i = 0; i < candidate.parameterCount(); ++i)
    if (places[i] == kLeftOut && !candidate.hasStandard(i)) return {};
  // Of no parameters and no arguments, which is no failure.
  if (places.empty()) places.push_back(kLeftOut);
  return places;
}

std::string typesOf(const Expression& call) {
  std::string text = "(";
  for (std::size_t i = 0; i < call.parts.size(); ++i)
    text += (i == 0 ? "" : ", ") + (call.partNames[i].empty() ? "" : call.partNames[i] + " = ") +
            typeName(call.parts[i]->type);
  return text + ")";
}

/// What it costs to hand `part` to a parameter: elements of an array that stands there are converted one by
/// one.
std::optional<int> argumentCost(const Expression& part, const Type& to) {
  const bool isEmptyArray = part.kind == ExpressionKind::array && part.parts.empty();
  if (isEmptyArray && to.isArray) return 0;
  if (part.kind != ExpressionKind::array || !to.isArray || to.kind == Kind::anything)
    return conversionCost(part.type, to);
  int cost = 0;
  for (const ExpressionPtr& element : part.parts) {
    const auto step = conversionCost(element->type, to.element());
    if (!step) return std::nullopt;
    cost = std::max(cost, *step);
  }
  return cost;
}

bool isOperator(const std::string& name) {
  return name.starts_with("operator") && name.size() > 8 && !(name[8] >= 'a' && name[8] <= 'z');
}

ExpressionPtr literalOf(const Span& span, Value value, const Type& type) {
  auto literal = std::make_unique<Expression>();
  literal->span = span;
  literal->literal = std::move(value);
  literal->type = type;
  return literal;
}

}  // namespace

bool Checker::expression(ExpressionPtr& expression, const Type& wanted) {
  // Parts of what has become a call are looked at twice.
  const bool isChecked = expression->type.kind != Kind::nothing || expression->function != nullptr ||
                         expression->declaration != nullptr;
  if (isChecked || typed(expression, wanted)) return true;
  expression->type = {};
  return false;
}

bool Checker::typed(ExpressionPtr& expression, const Type& wanted) {
  switch (expression->kind) {
    case ExpressionKind::literal:
    case ExpressionKind::percent:
    case ExpressionKind::perSide:
    case ExpressionKind::conversion:
    case ExpressionKind::targetIndex:
      return true;
    case ExpressionKind::variable:
      return variable(*expression);
    case ExpressionKind::call:
      return call(expression);
    case ExpressionKind::logical:
      return logical(*expression);
    case ExpressionKind::conditional:
      return conditional(*expression);
    case ExpressionKind::index:
      return index(expression);
    case ExpressionKind::member:
      return member(expression);
    case ExpressionKind::triple:
      return triple(expression);
    case ExpressionKind::array:
      return array(*expression, wanted);
  }
  return false;
}

bool Checker::variable(Expression& expression) {
  if (const Seen* seen = find(expression.name)) {
    Variable& variable = variables(seen->isGlobal)[seen->slot];
    expression.slot = seen->slot;
    expression.isGlobal = seen->isGlobal;
    expression.type = variable.type;
    // A global variable may be read by every call of a function.
    variable.reads += loops_ > 0 || (seen->isGlobal && function_ != nullptr) ? 2 : 1;
    return true;
  }
  std::string hint;
  if (!registry_.named(expression.name).empty() || functions_.count(expression.name) != 0) {
    hint = "`" + expression.name + "` is a function: write " + expression.name + "(...)";
  } else {
    const std::vector<std::string> variables = namesInSight();
    if (const std::string near = nearestName(expression.name, variables); !near.empty())
      hint = "did you mean `" + near + "`?";
    else if (const std::string function = nearestName(expression.name, registry_.names()); !function.empty())
      hint = "did you mean `" + function + "(...)`?";
  }
  fault(Code::unknownName, expression.span, "there is no '" + printable(expression.name, 60) + "' here",
        hint);
  return false;
}

bool Checker::convert(ExpressionPtr& expression, const Type& to, const std::string& what) {
  const bool isArray = expression->kind == ExpressionKind::array && to.isArray;
  if (isArray && (expression->parts.empty() || to.kind != Kind::anything)) {
    for (ExpressionPtr& element : expression->parts)
      if (!convert(element, to.element(), "an element of " + what)) return false;
    expression->type = to;
    return true;
  }
  const auto cost = conversionCost(expression->type, to);
  if (!cost) {
    if (expression->type.kind == Kind::nothing)
      fault(Code::wrongType, expression->span,
            what + " is " + articledName(to) + ", and this gives no value");
    else
      fault(Code::wrongType, expression->span,
            what + " is " + articledName(to) + ", and this is " + articledName(expression->type),
            to.kind == Kind::integer && expression->type == Type{Kind::number}
                ? "int(...) leaves out what is after the point"
                : "");
    return false;
  }
  if (*cost == 0 || to.kind == Kind::anything) return true;
  auto conversion = std::make_unique<Expression>();
  conversion->kind = ExpressionKind::conversion;
  conversion->span = expression->span;
  conversion->type = to;
  conversion->height = expression->height + 1;
  conversion->parts.push_back(std::move(expression));
  expression = std::move(conversion);
  return true;
}

bool Checker::call(ExpressionPtr& expression) {
  Expression& call = *expression;
  bool good = true;
  for (ExpressionPtr& part : call.parts) {
    // Arrays without elements get their type from the parameter.
    const bool isEmptyArray = part->kind == ExpressionKind::array && part->parts.empty();
    if (!isEmptyArray && !this->expression(part)) good = false;
    if (good && !isEmptyArray && part->type.kind == Kind::nothing) {
      fault(Code::wrongType, part->span, "this gives no value");
      good = false;
    }
  }
  if (!good) return false;

  std::vector<Candidate> candidates;
  const auto [begin, end] = functions_.equal_range(call.name);
  for (auto entry = begin; entry != end; ++entry) candidates.push_back({nullptr, entry->second});
  const std::size_t ownCount = candidates.size();
  for (const Function* function : registry_.named(call.name)) candidates.push_back({function, nullptr});
  if (candidates.empty()) {
    std::vector<std::string> names = registry_.names();
    for (const auto& [name, declaration] : functions_) names.push_back(name);
    const std::string near = nearestName(call.name, names);
    std::string hint = near.empty() ? "" : "did you mean `" + near + "`?";
    if (hint.empty() && find(call.name) != nullptr) hint = "'" + call.name + "' is a variable";
    fault(Code::unknownFunction, call.nameSpan, "there is no function '" + printable(call.name, 60) + "'",
          hint);
    return false;
  }

  const Candidate* best = nullptr;
  std::vector<std::size_t> bestPlaces;
  int bestCost = kNoMatch;
  bool isAmbiguous = false;
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    // Functions of the script hide those of the same name, wherever they fit.
    if (c == ownCount && best != nullptr) break;
    std::vector<std::size_t> places = argumentsFor(call, candidates[c]);
    if (places.empty()) continue;
    int cost = 0;
    for (std::size_t i = 0; i < candidates[c].parameterCount() && cost != kNoMatch; ++i) {
      if (places[i] == kLeftOut) continue;
      const auto step = argumentCost(*call.parts[places[i]], candidates[c].type(i));
      cost = step ? cost + *step : kNoMatch;
    }
    if (cost == kNoMatch || cost > bestCost) continue;
    isAmbiguous = cost == bestCost;
    best = &candidates[c];
    bestCost = cost;
    bestPlaces = std::move(places);
  }
  if (best == nullptr) {
    noSuchCall(call, candidates);
    return false;
  }
  if (isAmbiguous) {
    fault(Code::ambiguousCall, call.span,
          "several functions '" + call.name + "' take " + typesOf(call) + " equally well",
          "convert an argument by hand, as in float(...) or scalarfield(...)");
    return false;
  }
  warnOfIntegers(call);

  std::vector<ExpressionPtr> parts;
  for (std::size_t i = 0; i < best->parameterCount(); ++i) {
    if (bestPlaces[i] != kLeftOut) {
      ExpressionPtr part = std::move(call.parts[bestPlaces[i]]);
      if (!convert(part, best->type(i), "'" + best->name(i) + "'")) return false;
      parts.push_back(std::move(part));
    } else if (best->function != nullptr) {
      const Parameter& parameter = best->function->parameters[i];
      ExpressionPtr standard = literalOf(call.span, *parameter.standard, parameter.standardType);
      if (parameter.unit != Parameter::Unit::none)
        standard->kind =
            parameter.unit == Parameter::Unit::percent ? ExpressionKind::percent : ExpressionKind::perSide;
      if (!convert(standard, parameter.type, "'" + parameter.name + "'")) return false;
      parts.push_back(std::move(standard));
    } else {
      parts.push_back(nullptr);
    }
  }
  for (std::size_t i = best->parameterCount(); i < bestPlaces.size(); ++i)
    if (bestPlaces[i] != kLeftOut) parts.push_back(std::move(call.parts[bestPlaces[i]]));
  call.parts = std::move(parts);
  call.function = best->function;
  call.declaration = best->declaration;
  call.type = best->function ? best->function->result : best->declaration->result;
  return true;
}

void Checker::noSuchCall(const Expression& call, const std::vector<Candidate>& candidates) {
  if (isOperator(call.name)) {
    const std::string mark = call.name.substr(8);
    const bool comparesFields = (mark.find_first_of("<>=!") != std::string::npos) &&
                                std::any_of(call.parts.begin(), call.parts.end(),
                                            [](const ExpressionPtr& part) { return part->type.isField(); });
    const std::string message = call.parts.size() == 1
                                    ? "there is no " + mark + " of " + articledName(call.parts[0]->type)
                                    : "there is no " + mark + " of " + articledName(call.parts[0]->type) +
                                          " and " + articledName(call.parts[1]->type);
    fault(Code::noSuchCall, call.span, message,
          comparesFields ? "a field has other values elsewhere: mask(f) is 1 where f > 0, and eval(f, point) "
                           "is its value at a point"
                         : "");
    return;
  }
  // A name of an argument that nothing has is the likeliest fault.
  for (std::size_t i = 0; i < call.parts.size(); ++i) {
    if (call.partNames[i].empty()) continue;
    std::set<std::string> known;
    for (const Candidate& candidate : candidates)
      for (std::size_t p = 0; p < candidate.parameterCount(); ++p) known.insert(candidate.name(p));
    if (known.count(call.partNames[i]) != 0) continue;
    const std::string near = nearestName(call.partNames[i], {known.begin(), known.end()});
    std::string hint = near.empty() ? "it has" : "did you mean `" + near + "`?";
    if (near.empty())
      for (const std::string& name : known) hint += (name == *known.begin() ? " " : ", ") + name;
    if (known.empty()) hint = "it has none";
    fault(Code::unknownParameter, call.partNameSpans[i],
          quoted(call.name) + " has no parameter " + quoted(call.partNames[i], 40), hint);
    return;
  }
  std::string hint = candidates.size() == 1 ? "there is " : "there are\n";
  for (std::size_t i = 0; i < candidates.size() && i < kShownSignatures; ++i) {
    if (i != 0) hint += '\n';
    hint += candidates[i].signature();
  }
  if (candidates.size() > kShownSignatures)
    hint += "\nand " + std::to_string(candidates.size() - kShownSignatures) + " more";
  fault(Code::noSuchCall, call.span, "no '" + call.name + "' takes " + typesOf(call), hint);
}

bool Checker::index(ExpressionPtr& expression) {
  const bool both = this->expression(expression->parts[0]) & this->expression(expression->parts[1]);
  if (!both || !convert(expression->parts[1], {Kind::integer}, "an index")) return false;
  const Type type = expression->parts[0]->type;
  if (type.isArray) {
    expression->type = type.element();
    return true;
  }
  const bool hasComponents = type.kind == Kind::vector || type.kind == Kind::vectorField;
  if (!hasComponents && type.kind != Kind::matrix && type.kind != Kind::matrixField) {
    fault(Code::noSuchIndex, expression->span, articledName(type) + " has no elements",
          "arrays, vectors and matrices have");
    return false;
  }
  expression->kind = ExpressionKind::call;
  expression->name = hasComponents ? "component" : "row";
  expression->nameSpan = expression->span;
  return call(expression);
}

bool Checker::member(ExpressionPtr& expression) {
  if (!this->expression(expression->parts[0])) return false;
  const Type type = expression->parts[0]->type;
  const std::string names = "xyz";
  const std::size_t component =
      expression->name.size() == 1 ? names.find(expression->name[0]) : std::string::npos;
  if (component == std::string::npos || (type != Type{Kind::vector} && type != Type{Kind::vectorField})) {
    fault(Code::noSuchMember, expression->nameSpan,
          articledName(type) + " has no '." + printable(expression->name, 40) + "'",
          "vectors and vector fields have .x, .y and .z");
    return false;
  }
  expression->parts.push_back(
      literalOf(expression->nameSpan, static_cast<std::int64_t>(component), {Kind::integer}));
  expression->partNames.emplace_back();
  expression->partNameSpans.emplace_back();
  expression->kind = ExpressionKind::call;
  expression->name = "component";
  return call(expression);
}

bool Checker::triple(ExpressionPtr& expression) {
  bool good = true;
  for (ExpressionPtr& part : expression->parts) good = this->expression(part) && good;
  if (!good) return false;
  bool anyField = false, allVectors = true, allNumbers = true;
  for (const ExpressionPtr& part : expression->parts) {
    const Type type = part->type;
    anyField = anyField || type.isField();
    allVectors = allVectors && (type == Type{Kind::vector} || type == Type{Kind::vectorField});
    allNumbers = allNumbers && conversionCost(type, {Kind::scalarField}).has_value();
  }
  if (!allVectors && !allNumbers) {
    fault(Code::wrongType, expression->span,
          "this joins " + typeName(expression->parts[0]->type) + ", " + typeName(expression->parts[1]->type) +
              " and " + typeName(expression->parts[2]->type),
          "three numbers make a vector, three vectors a matrix, fields likewise");
    return false;
  }
  expression->kind = ExpressionKind::call;
  expression->name = typeName({allVectors ? (anyField ? Kind::matrixField : Kind::matrix)
                                          : (anyField ? Kind::vectorField : Kind::vector)});
  expression->nameSpan = expression->span;
  return call(expression);
}

bool Checker::array(Expression& expression, const Type& wanted) {
  if (expression.parts.empty()) {
    if (!wanted.isArray) {
      fault(Code::wrongType, expression.span, "an array of what?", "declare it, as in float[] a = [];");
      return false;
    }
    expression.type = wanted;
    return true;
  }
  bool good = true;
  for (ExpressionPtr& part : expression.parts) good = this->expression(part) && good;
  if (!good) return false;
  Type element =
      wanted.isArray && wanted.kind != Kind::anything ? wanted.element() : expression.parts[0]->type;
  for (const ExpressionPtr& part : expression.parts)
    if (!wanted.isArray && !conversionCost(part->type, element) && conversionCost(element, part->type))
      element = part->type;
  if (element.isArray) {
    fault(Code::wrongType, expression.span, "arrays hold values, not arrays");
    return false;
  }
  for (ExpressionPtr& part : expression.parts)
    if (!convert(part, element, "an element")) return false;
  expression.type = {element.kind, true};
  return true;
}

bool Checker::logical(Expression& expression) {
  bool good = true;
  for (ExpressionPtr& part : expression.parts)
    good =
        this->expression(part) && convert(part, {Kind::boolean}, "each side of " + expression.name) && good;
  expression.type = {Kind::boolean};
  return good;
}

bool Checker::conditional(Expression& expression) {
  auto& parts = expression.parts;
  bool good = this->expression(parts[0]) && convert(parts[0], {Kind::boolean}, "what stands before '?'");
  good = this->expression(parts[1]) && good;
  good = this->expression(parts[2]) && good;
  if (!good) return false;
  const Type type = conversionCost(parts[1]->type, parts[2]->type) ? parts[2]->type : parts[1]->type;
  if (!convert(parts[1], type, "the value after '?'") || !convert(parts[2], type, "the value after ':'"))
    return false;
  expression.type = type;
  return true;
}

}  // namespace nephele::felt

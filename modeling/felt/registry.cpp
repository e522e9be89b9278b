#include "nephele/modeling/felt/registry.h"

#include <algorithm>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/felt/detail/parser.h"

namespace nephele::felt {

namespace {

/// The standard value of a parameter: a literal, the negative of one, or a vector of them.
void readStandard(const Expression& expression, Parameter& parameter) {
  switch (expression.kind) {
    case ExpressionKind::literal:
      parameter.standard = expression.literal;
      parameter.standardType = expression.type;
      return;
    case ExpressionKind::percent:
    case ExpressionKind::perSide:
      parameter.standard = expression.literal;
      parameter.standardType = {Kind::number};
      parameter.unit =
          expression.kind == ExpressionKind::percent ? Parameter::Unit::percent : Parameter::Unit::perSide;
      return;
    case ExpressionKind::call:
      if (expression.name == "operator-" && expression.parts.size() == 1) {
        readStandard(*expression.parts[0], parameter);
        if (parameter.standard->is<std::int64_t>())
          parameter.standard = -parameter.standard->as<std::int64_t>();
        else
          parameter.standard = -parameter.standard->as<double>();
        return;
      }
      break;
    case ExpressionKind::triple: {
      double components[3];
      for (int i = 0; i < 3; ++i) {
        Parameter component{{Kind::number}, {}};
        readStandard(*expression.parts[i], component);
        components[i] = converted(*component.standard, {Kind::number}).as<double>();
      }
      parameter.standard = Vec3d{components[0], components[1], components[2]};
      parameter.standardType = {Kind::vector};
      return;
    }
    case ExpressionKind::array:
      if (expression.parts.empty()) {
        parameter.standard = Array(std::make_shared<const std::vector<Value>>());
        parameter.standardType = parameter.type;
        return;
      }
      break;
    default:
      break;
  }
  throw Error("the standard value of '" + parameter.name + "' is no literal");
}

}  // namespace

Function& Registry::addGeneral(std::string signature, std::string text, std::string example,
                               std::function<Value(Call&)> run) {
  ParsedSignature parsed = parseSignature(signature);
  Function function;
  function.name = parsed.declaration.name;
  function.signature = std::move(signature);
  function.text = std::move(text);
  function.example = std::move(example);
  function.group = group_;
  function.isOfData = isOfData_;
  function.result = parsed.declaration.result;
  function.isOpen = parsed.isOpen;
  function.run = std::move(run);
  for (const DeclaredName& declared : parsed.declaration.parameters) {
    Parameter parameter{declared.type, declared.name};
    if (declared.value) readStandard(*declared.value, parameter);
    function.parameters.push_back(std::move(parameter));
  }
  functions_.push_back(std::move(function));
  byName_.emplace(functions_.back().name, functions_.size() - 1);
  return functions_.back();
}

void Registry::requireKinds(const Function& function, std::span<const Type> types) {
  bool agree = types.size() == function.parameters.size();
  for (std::size_t i = 0; agree && i < types.size(); ++i)
    agree = types[i].isArray ? function.parameters[i].type.isArray : types[i] == function.parameters[i].type;
  require(agree, "'" + function.signature + "' does not agree with the function that it describes");
}

std::vector<const Function*> Registry::named(std::string_view name) const {
  std::vector<const Function*> found;
  const auto [begin, end] = byName_.equal_range(name);
  for (auto entry = begin; entry != end; ++entry) found.push_back(&functions_[entry->second]);
  return found;
}

std::vector<std::string> Registry::names() const {
  std::vector<std::string> names;
  for (auto entry = byName_.begin(); entry != byName_.end(); entry = byName_.upper_bound(entry->first))
    if (!entry->first.starts_with("operator")) names.push_back(entry->first);
  return names;
}

}  // namespace nephele::felt

#include "nephele/modeling/felt/type.h"

#include <array>
#include <utility>

namespace nephele::felt {

namespace {

constexpr std::array<std::pair<Kind, std::string_view>, 16> kNames{{
    {Kind::nothing, "void"},
    {Kind::integer, "int"},
    {Kind::number, "float"},
    {Kind::boolean, "bool"},
    {Kind::text, "string"},
    {Kind::vector, "vector"},
    {Kind::matrix, "matrix"},
    {Kind::scalarField, "scalarfield"},
    {Kind::vectorField, "vectorfield"},
    {Kind::matrixField, "matrixfield"},
    {Kind::domain, "domain"},
    {Kind::scalarCache, "scalarcache"},
    {Kind::vectorCache, "vectorcache"},
    {Kind::matrixCache, "matrixcache"},
    {Kind::shape, "shape"},
    {Kind::anything, "any"},
}};

}  // namespace

std::string typeName(const Type& type) {
  for (const auto& [kind, name] : kNames)
    if (kind == type.kind) return std::string(name) + (type.isArray ? "[]" : "");
  return "void";
}

std::string articledName(const Type& type) {
  return (type.kind == Kind::integer ? "an " : "a ") + typeName(type);
}

std::optional<Kind> kindOf(std::string_view name) {
  for (const auto& [kind, known] : kNames)
    if (known == name) return kind;
  return std::nullopt;
}

std::optional<int> conversionCost(const Type& from, const Type& to) {
  if (from == to) return 0;
  if (to.kind == Kind::anything && from.kind != Kind::nothing && (from.isArray || !to.isArray)) return 8;
  if (from.isArray || to.isArray) return std::nullopt;
  if (from.kind == Kind::integer && to.kind == Kind::number) return 1;
  if (from.kind == Kind::number && to.kind == Kind::scalarField) return 2;
  if (from.kind == Kind::integer && to.kind == Kind::scalarField) return 3;
  if (from.kind == Kind::vector && to.kind == Kind::vectorField) return 2;
  if (from.kind == Kind::matrix && to.kind == Kind::matrixField) return 2;
  return std::nullopt;
}

}  // namespace nephele::felt

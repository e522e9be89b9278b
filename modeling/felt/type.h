#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace nephele::felt {

enum class Kind {
  /// Of functions that give nothing.
  nothing,
  integer,
  number,
  boolean,
  text,
  vector,
  matrix,
  scalarField,
  vectorField,
  matrixField,
  domain,
  scalarCache,
  vectorCache,
  matrixCache,
  shape,
  /// Of parameters of built-in functions that take whatever there is.
  anything,
};

/// The type of a value: one of the kinds, or an array of it.
struct Type {
  Kind kind = Kind::nothing;
  bool isArray = false;

  bool operator==(const Type&) const = default;
  Type element() const { return {kind, false}; }
  bool isField() const {
    return !isArray && (kind == Kind::scalarField || kind == Kind::vectorField || kind == Kind::matrixField);
  }
};

/// As it is written: "scalarfield[]".
std::string typeName(const Type& type);
/// "a scalarfield", "an int".
std::string articledName(const Type& type);
/// The kind that is written so, unless there is none: "void", "int", "float", "bool", "string", "vector",
/// "matrix", "scalarfield", "vectorfield", "matrixfield", "domain", "scalarcache", "vectorcache",
/// "matrixcache", "shape"; "any" only in signatures of built-in functions.
std::optional<Kind> kindOf(std::string_view name);

/// How far a value of type `from` is from one of type `to` where it stands for it: 0 if they are the same,
/// more the more is changed, or nothing if it does not. Integers become numbers, numbers constant fields, and
/// vectors and matrices constant fields of theirs; nothing is rounded on the way.
std::optional<int> conversionCost(const Type& from, const Type& to);

}  // namespace nephele::felt

// Combinations of shapes, as other operations express them.
//
// A union or intersection of many parts is built as a balanced tree, so that restriction to a box looks at
// each part a few times only and depth stays small.
#include "nephele/modeling/shape/combinations.h"

#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/field/operations.h"

namespace nephele {
namespace {

template <class Operation>
ScalarField balanced(std::span<const ScalarField> parts, const Operation& operation) {
  if (parts.size() == 1) return parts[0];
  const std::size_t half = parts.size() / 2;
  return operation(balanced(parts.first(half), operation), balanced(parts.subspan(half), operation));
}

}  // namespace

ScalarField unionOf(const ScalarField& a, const ScalarField& b) {
  return max(a, b);
}

ScalarField unionOf(std::span<const ScalarField> parts) {
  require(!parts.empty(), "unionOf: there must be at least one part");
  return balanced(parts, [](const ScalarField& a, const ScalarField& b) { return max(a, b); });
}

ScalarField intersection(const ScalarField& a, const ScalarField& b) {
  return min(a, b);
}

ScalarField intersection(std::span<const ScalarField> parts) {
  require(!parts.empty(), "intersection: there must be at least one part");
  return balanced(parts, [](const ScalarField& a, const ScalarField& b) { return min(a, b); });
}

ScalarField cutout(const ScalarField& a, const ScalarField& b) {
  return min(a, -b);
}

ScalarField shell(const ScalarField& l, float thickness) {
  require(thickness > 0 && std::isfinite(thickness),
          "shell: thickness must be > 0 and finite, got " + numberText(thickness));
  return 0.5f * thickness - abs(l);
}

ScalarField dilate(const ScalarField& l, const ScalarField& distance) {
  return l + distance;
}

}  // namespace nephele

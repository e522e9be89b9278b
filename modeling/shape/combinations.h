#pragma once

#include <span>

#include "nephele/modeling/field/field.h"

/// Combining shapes: scalar fields that are positive inside. Results have the right sign and zero surface
/// everywhere; they are bounds of the distance, not distances, even where the operands are distances.
namespace nephele {

/// Inside either: max(a, b).
ScalarField unionOf(const ScalarField& a, const ScalarField& b);
/// Inside any; restriction to a box keeps the parts that matter there. @throws Error if `parts` is empty.
ScalarField unionOf(std::span<const ScalarField> parts);
/// Inside both: min(a, b).
ScalarField intersection(const ScalarField& a, const ScalarField& b);
/// Inside all. @throws Error if `parts` is empty.
ScalarField intersection(std::span<const ScalarField> parts);
/// Inside `a` but not inside `b`: min(a, -b).
ScalarField cutout(const ScalarField& a, const ScalarField& b);
/// The skin of a shape, `thickness` world units thick, half of it to each side of the surface: thickness / 2
/// - |l|.
/// @throws Error unless thickness > 0 and finite.
ScalarField shell(const ScalarField& l, float thickness);
/// Grown by `distance` world units (shrunk if negative): l + distance. Exact where l is a distance.
ScalarField dilate(const ScalarField& l, const ScalarField& distance);

}  // namespace nephele

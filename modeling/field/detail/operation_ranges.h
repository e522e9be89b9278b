#pragma once

#include "nephele/modeling/base/interval.h"
#include "nephele/modeling/field/detail/field_kernels.h"

namespace nephele::detail {

/// Bounds of all values of an operation whose arguments are within `a` (and `b`): as tight as interval
/// arithmetic allows, rounded outward. Arguments are treated as if they varied independently.
Interval rangeOf(Unary op, const Parameters& parameters, const Interval& a);
Interval rangeOf(Binary op, const Parameters& parameters, const Interval& a, const Interval& b);

}  // namespace nephele::detail

#pragma once

#include <fmt/format.h>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/interval.h"

namespace nephele::detail {

/// @throws Error if densities reach so far, either side of 0, that extinctions and optical depths, which are
/// floats, too, would not hold them.
inline void requireHoldableDensity(const Interval& all) {
  constexpr float most = 1e18f;
  require(all.magnitude() <= most, fmt::format("density: expected values up to {:g}, got {:g}", most,
                                               all.max > most ? all.max : all.min));
}

}  // namespace nephele::detail

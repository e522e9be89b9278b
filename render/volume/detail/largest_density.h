#pragma once

namespace nephele::detail {

/// What densities may reach, either side of 0: extinctions and optical depths are floats, too.
constexpr float kLargestDensity = 1e18f;

}  // namespace nephele::detail

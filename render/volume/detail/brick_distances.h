#pragma once

#include <cstdint>
#include <vector>

#include "nephele/modeling/base/math.h"

namespace nephele::detail {

/// Lowers entries of a table of `count` bricks, x fastest, to how many bricks it is from there to the nearest
/// that is 0, the largest of the three axes, if that is less. Entries are 0, or as far as is looked, each the
/// same.
void spreadDistances(std::vector<std::uint8_t>& distances, const Vec3i& count);

}  // namespace nephele::detail

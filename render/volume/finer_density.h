#pragma once

#include <memory>

#include "nephele/levelset/grid/brick_grid.h"

namespace nephele::detail {

/// The same density on voxels of 1 / `factor` the edge: what interpolation finds between the voxels of `grid`
/// becomes samples, so that values at any place stay the same up to rounding. Background 0; the grid is not
/// packed. Uses all cores. Cost: factor^3 times the memory of the bricks that hold anything.
/// @throws Error if the factor is not 1, 2, 4 or 8.
std::shared_ptr<const BrickGrid> finerDensity(const BrickGrid& grid, int factor);

}  // namespace nephele::detail

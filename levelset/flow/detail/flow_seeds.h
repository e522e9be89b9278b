#pragma once

#include <vector>

#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/modeling/field/field.h"

namespace nephele::detail {

/// The bricks of `to` in which 27 points of each brick of `from` arrive by the map `forward`.
/// @throws Error if a point arrives nowhere, or farther than `longest` voxels of `to` from where it was.
std::vector<Vec3i> flowSeeds(const std::vector<Vec3i>& bricks, const Lattice& from, const Lattice& to,
                             const VectorField& forward, float longest);

/// Checks the velocity itself where matter starts: a midpoint rule whose midpoint lies far away reads a
/// velocity that has nothing to do with the place. @throws Error as flowSeeds.
void requireShortSteps(const std::vector<Vec3i>& bricks, const Lattice& lattice, const VectorField& velocity,
                       float dt, float longest);

}  // namespace nephele::detail

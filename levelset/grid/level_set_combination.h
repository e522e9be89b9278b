#pragma once

#include <span>

#include "nephele/levelset/grid/voxel_grid.h"
#include "nephele/modeling/base/progress.h"

namespace nephele {

/// What several solids become.
enum class Combination {
  unionOf,       ///< What is inside any of them.
  intersection,  ///< What is inside all of them.
  cutout         ///< What is inside the first and none of the others.
};

struct CombinationOptions {
  Combination combination = Combination::unionOf;
  /// Rounds the creases where surfaces meet, world units, >= 0; see `combined`.
  float blend = 0.0f;
  /// Of the result, world units, > 0: values are cut off there.
  float halfWidth = 0.0f;
};

/// How far from its surface a level set must hold values to be combined so.
constexpr float neededHalfWidth(const CombinationOptions& options) {
  return options.halfWidth + 1.25f * options.blend;
}

/// Level sets of solids on one lattice, positive inside, as one.
///
/// Values are max(a, b), min(a, b) or min(a, -b) of those of the solids, voxel by voxel, so that the zero
/// surface is as exact as theirs: distances outside a union and inside the others, bounds of the distance
/// beyond. With a blend w the larger of a and b becomes m + h^2 / (4 w), h = max(w - |a - b|, 0), the smaller
/// one likewise lower: creases are filled, or hollowed, where both surfaces are within w, by w / 4 at most.
/// Solids are taken one after the other; with a blend their order counts by a little. The background and all
/// that is not in the grids is outside. All cores; the same bits at any number of threads. Cost: one pass
/// over the bricks. Source of the blend: I. Quilez, Smooth minimum (the quadratic one).
/// @throws Error if there are none, lattices differ, or an option is out of its range; Cancelled.
VoxelGrid<float> combined(std::span<const VoxelGrid<float>> solids, const CombinationOptions& options,
                          const Progress& progress = silent());

}  // namespace nephele

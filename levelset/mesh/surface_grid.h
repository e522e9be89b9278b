#pragma once

#include <functional>
#include <span>

#include "nephele/levelset/mesh/nearest_on_mesh.h"
#include "nephele/modeling/base/progress.h"
#include "nephele/modeling/field/field.h"

namespace nephele::detail {

/// Gives the 8^3 values at voxelSize * (firstVoxel + (x, y, z)), x fastest. Called from many threads.
using SampleBrick =
    std::function<void(const Vec3i& firstVoxel, float voxelSize, std::span<float, 512> values)>;

/// World units.
struct SurfaceGridOptions {
  /// Of the finest grid, > 0.
  float voxelSize;
  /// How far from the surface grids are used, >= 0.
  float band;
  /// The least and the largest value of the field: interpolation stays within.
  Interval range;
  /// A faster way to the field's values, if there is one.
  SampleBrick sample{};
};

/// `exact`, sampled once near a surface and interpolated: with `voxelSize` within four voxels of it, and on
/// grids twice as coarse for each doubling of the distance, up to `band`. Beyond: `exact` itself.
/// `exact` must be finite at finite points. The result does not depend on the number of threads.
/// @throws Error if the grid would be too large; Cancelled.
ScalarField griddedNear(const NearestOnMesh& surface, const ScalarField& exact,
                        const SurfaceGridOptions& options, const Progress& progress);

}  // namespace nephele::detail

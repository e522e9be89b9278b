#pragma once

#include <memory>
#include <optional>

#include "nephele/levelset/grid/grid_field.h"
#include "nephele/modeling/base/progress.h"

namespace nephele {

struct BakeOptions {
  /// Edge of a voxel, world units, > 0. Voxel centres lie at integer multiples of it.
  float voxelSize = 0.0f;
  /// Where to look, world units: all voxels that interpolation inside the box needs; outside them the result
  /// is `background`. Gradients of trilinear values look a voxel farther, so that they hold a voxel inside.
  Box box;
  /// Values that matter. Where the field lies wholly above or below, the grid holds one constant on that
  /// side: the nearer end of the band. Bricks that the band enters keep true values. Default: everything
  /// matters.
  Interval band = Interval::everything();
  /// Value outside the box. Default: band.min where that is finite, else 0.
  std::optional<float> background{};
  Interpolation interpolation = Interpolation::trilinear;
};

/// Samples `field` on a sparse grid and returns the grid as a field.
///
/// Walks an octree: a cell whose range leaves the band, or is a single value, is settled without evaluation;
/// others restrict the field and split, down to bricks of 8^3, which are evaluated in blocks. Bricks found to
/// be settled by their samples become constants too. Interpolation gives what a dense grid would wherever the
/// samples it reads lie inside the band; where one of them lies beyond an end, a constant may stand for it,
/// and farther out values may jump from brick to brick. So let the band reach farther than values are used:
/// for distances by two voxels (trilinear), three (their gradients), four (tricubic).
///
/// Uses all cores; the result is the same bit for bit at any thread count. Time and memory grow with the
/// bricks that hold values inside the band; a table of 4 bytes per brick position spans the box.
/// @throws Error if voxelSize is not > 0, the box is empty or unbounded or too large to number its voxels,
/// the band is empty, or the background is not finite; Cancelled.
ScalarField bake(const ScalarField& field, const BakeOptions& options, const Progress& progress = silent());

/// As `bake`, and returns the grid itself.
std::shared_ptr<BrickGrid> bakeGrid(const ScalarField& field, const BakeOptions& options,
                                    const Progress& progress = silent());

/// A vector field on three grids that share their layout. `band` must be everything; `background` is used for
/// every component. @throws as above.
VectorField bake(const VectorField& field, const BakeOptions& options, const Progress& progress = silent());

}  // namespace nephele

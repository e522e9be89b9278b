#pragma once

#include <memory>

#include "nephele/levelset/grid/grid_field.h"
#include "nephele/modeling/base/progress.h"

namespace nephele {

struct WarpGridOptions {
  /// Edge of a voxel, world units, > 0.
  double voxelSize = 0.0;
  /// Voxels on either side of the object's surface that hold samples, at least.
  double halfWidthVoxels = 3.0;
};

/// Where a map between shapes is sampled: bricks of 8^3 voxels about the surface of the object.
///
/// Voxels stand at whole multiples of the voxel size, for objects farther from the origin than a thousand of
/// their sizes relative to the middle of their box.
class WarpBricks {
 public:
  /// `object`: the level set of the object, at most as steep as a distance; `box` holds its surface.
  /// Cost: one value of `object` per brick of the box.
  /// @throws Error if the voxel size is not > 0 and finite or the box is empty or has too many bricks.
  WarpBricks(const ScalarField& object, const Box& box, const WarpGridOptions& options);

  /// The map x -> X(x) on these bricks; 0 elsewhere. All cores. @throws Error if X is not finite somewhere;
  /// Cancelled.
  VectorGrids sample(const VectorField& map, const Progress& progress = silent()) const;

  /// A level set on these bricks, elsewhere its bound on the side of `object`: ready for marchingCubes.
  /// @throws Error if it is not finite somewhere; Cancelled.
  std::shared_ptr<BrickGrid> sample(const ScalarField& levelSet, const Progress& progress = silent()) const;

  /// Voxels that hold samples.
  std::size_t voxelCount() const { return places_.size() * 512; }
  /// Bytes that a map or a level set will hold at most, from the number of bricks in the box.
  static double estimateBytes(const Box& box, double voxelSize);

 private:
  template <int N, class F>
  std::array<std::shared_ptr<BrickGrid>, N> fill(const F& field, const Progress& progress) const;

  Lattice lattice_;
  BrickBox box_;
  /// Of the bricks of the box: 0 is outside, 1 inside, 2 and more are `places_`.
  std::vector<std::int32_t> table_;
  /// Bricks in the order of the pool, from 2.
  std::vector<Vec3i> places_;
  float bound_ = 0;
};

}  // namespace nephele

#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/modeling/field/field.h"

namespace nephele {

namespace detail {
class LargeArray;
class PieceLevelSetNode;
}  // namespace detail

/// The level set of a piece: distances in bricks of 8^3 samples about its surface, one of the two ends of the
/// band elsewhere; positive inside, world units. Sample (i, j, k) stands at (i, j, k) * voxelSize().
///
/// A handle, cheap to copy, never changed once made. All pieces of one cut keep their bricks in one array,
/// which lives as long as any of them: 2 kB for each brick, and 4 bytes for each place of the table.
class PieceLevelSet {
 public:
  /// Table entries for bricks without samples.
  static constexpr std::int32_t kOutside = 0, kInside = 1;
  static constexpr std::size_t kSamples = kBrickSamples;

  /// Entry n > 1 of the table is brick n - 2 of `bricks`.
  PieceLevelSet(float voxelSize, float band, FlatBrickTable table,
                std::shared_ptr<const detail::LargeArray> bricks);

  float voxelSize() const { return voxelSize_; }
  /// How far from the surface values go, world units.
  float band() const { return band_; }
  const Vec3i& firstBrick() const { return table_->box.first; }
  const Vec3i& brickCount() const { return table_->box.count; }
  /// Bricks that hold samples.
  std::size_t storedBricks() const;
  /// Bytes of its own table and bricks.
  std::size_t memoryBytes() const;

  /// The sample at voxel (i, j, k), -band() beyond the table.
  float at(const Vec3i& voxel) const;

  /// Trilinear between the samples, read where they are: the values of `gridField(toBricks())`, without a
  /// copy, for a few samples of many pieces.
  ScalarField field() const;

  /// Volume of the marching cubes mesh of its samples, which is not made, world units cubed. The time is that
  /// of reading all bricks that hold samples: keep it.
  double volume() const;

  /// A copy with borders: for interpolation of many points, and for all that works on grids. 2.6 times the
  /// memory.
  std::shared_ptr<BrickGrid> toBricks() const;

 private:
  friend class detail::PieceLevelSetNode;

  const float* samplesOf(std::int32_t entry) const;

  float voxelSize_ = 1.0f, band_ = 0.0f;
  std::shared_ptr<const FlatBrickTable> table_;
  std::shared_ptr<const detail::LargeArray> bricks_;
};

}  // namespace nephele

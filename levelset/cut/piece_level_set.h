#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "nephele/levelset/grid/brick_box.h"
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
  static constexpr std::size_t kSamples = 512;

  /// The bricks in a table of brick positions, x fastest; entry n > 1 is brick n - 2 of `bricks`.
  struct Table {
    BrickBox bricks;
    std::vector<std::int32_t> entries;

    /// kOutside beyond the table.
    std::int32_t entryAt(const Vec3i& brick) const {
      return bricks.covers(brick) ? entries[bricks.numberOf(brick)] : kOutside;
    }
  };

  PieceLevelSet(float voxelSize, float band, Table table, std::shared_ptr<const detail::LargeArray> bricks);

  float voxelSize() const { return voxelSize_; }
  /// How far from the surface values go, world units.
  float band() const { return band_; }
  const Vec3i& firstBrick() const { return table_->bricks.first; }
  const Vec3i& brickCount() const { return table_->bricks.count; }
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
  std::shared_ptr<const Table> table_;
  std::shared_ptr<const detail::LargeArray> bricks_;
};

}  // namespace nephele

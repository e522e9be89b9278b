#pragma once

#include <cstdint>
#include <vector>

#include "nephele/levelset/grid/flat_brick_table.h"
#include "nephele/levelset/grid/lattice.h"
#include "nephele/modeling/base/box.h"
#include "nephele/modeling/base/interval.h"
#include "nephele/modeling/base/math.h"

namespace nephele {

/// Where the bricks of a sparse grid stand, and between what numbers their samples lie: all but the samples.
///
/// Bricks are kept in a pool; a table says for every brick position of a box which of them stands there. One
/// brick of the pool may stand at many positions where the grid is constant; brick 0 is all background. So
/// entries of the table are always numbers of bricks, and every brick has a range.
class BrickLayout {
 public:
  static constexpr int kBrick = kBrickSide;
  static constexpr int kBefore = 1;
  static constexpr int kAfter = 2;
  static constexpr int kWidth = kBrick + kBefore + kAfter;
  static constexpr int kVolume = kWidth * kWidth * kWidth;

  const Lattice& lattice() const { return lattice_; }
  const Affine& indexToWorld() const { return lattice_.indexToWorld; }
  const Affine& worldToIndex() const { return lattice_.worldToIndex; }
  /// Edge of a voxel in world units (cube root of the volume for maps that are not uniform).
  float voxelSize() const { return lattice_.voxelSize; }
  /// What every sample outside the table is.
  float background() const { return background_; }

  /// The brick positions of the table, numbered as its entries: x fastest, then y, then z.
  const BrickBox& places() const { return table_.box; }
  const Vec3i& firstBrick() const { return places().first; }
  const Vec3i& brickCount() const { return places().count; }
  bool covers(const Vec3i& brick) const { return places().covers(brick); }
  std::size_t tableIndex(const Vec3i& brick) const { return places().numberOf(brick); }
  const std::vector<std::int32_t>& table() const { return table_.entries; }
  /// Pool index of the brick at brick coordinates `brick`; 0 outside the table.
  std::int32_t poolIndex(const Vec3i& brick) const { return table_.at(brick); }
  /// World-space box of the table; empty for an empty table.
  Box worldBox() const;

  std::size_t poolSize() const { return ranges_.size(); }
  /// Per pool brick: range of every stored sample, hence of every interpolated value in its cells.
  const std::vector<Interval>& ranges() const { return ranges_; }

  /// Puts the voxels elsewhere. @throws Error if the voxel size is not > 0.
  void setLattice(const Lattice& lattice);
  /// Lets the brick `pool` stand at the position `brick`. From several threads for different positions.
  void place(const Vec3i& brick, std::int32_t pool);
  /// Lets bricks stand at all positions. @throws Error unless there is an entry for each, and all are bricks
  /// of the pool.
  void setTable(std::vector<std::int32_t> table);
  /// What is known of the samples of a brick: it must contain them. From several threads for different
  /// bricks.
  void setRange(std::int32_t pool, const Interval& range);

 protected:
  /// Brick 0 everywhere. @throws Error if there are too many positions, or the voxel size is not > 0.
  BrickLayout(const Lattice& lattice, const BrickBox& places, float background);

  void requirePool(std::size_t size) const;
  /// Adds bricks whose samples are all 0, and returns the number of the first. @throws Error as requirePool.
  std::int32_t appendRanges(std::size_t bricks);
  /// Bytes held.
  std::size_t layoutBytes() const;

  Lattice lattice_;
  float background_ = 0.0f;
  FlatBrickTable table_;
  std::vector<Interval> ranges_;
};

/// Offset of a stored sample in its pool brick; coordinates -1 to 9, the brick's own samples being 0 to 7.
constexpr int sampleOffset(int x, int y, int z) {
  return ((z + BrickLayout::kBefore) * BrickLayout::kWidth + y + BrickLayout::kBefore) * BrickLayout::kWidth +
         x + BrickLayout::kBefore;
}
constexpr int sampleOffset(const Vec3i& sample) {
  return sampleOffset(sample.x, sample.y, sample.z);
}

/// A pool brick that stands at exactly one position.
struct PlacedBrick {
  std::int32_t pool;
  Vec3i brick;
};

/// The pool bricks that stand at exactly one position, in the order of the pool; never the background brick.
/// Only these may be written: their borders are copies that `fillBorders` renews, the other bricks are
/// constants. So a neighbourhood operation runs over them in parallel, reads through the borders, writes own
/// samples elsewhere, copies back, and calls `fillBorders` between sweeps.
std::vector<PlacedBrick> placedBricks(const BrickLayout& grid);

}  // namespace nephele

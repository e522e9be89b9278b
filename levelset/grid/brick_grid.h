#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "nephele/levelset/grid/brick_box.h"
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
  static constexpr int kBrick = 8;
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
  const BrickBox& places() const { return places_; }
  const Vec3i& firstBrick() const { return places_.first; }
  const Vec3i& brickCount() const { return places_.count; }
  bool covers(const Vec3i& brick) const { return places_.covers(brick); }
  std::size_t tableIndex(const Vec3i& brick) const { return places_.numberOf(brick); }
  const std::vector<std::int32_t>& table() const { return table_; }
  /// Pool index of the brick at brick coordinates `brick`; 0 outside the table.
  std::int32_t poolIndex(const Vec3i& brick) const { return covers(brick) ? table_[tableIndex(brick)] : 0; }
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

  Lattice lattice_;
  float background_ = 0.0f;
  BrickBox places_;
  std::vector<std::int32_t> table_;
  std::vector<Interval> ranges_;
};

/// Sparse voxel values in bricks that are ready to be interpolated: the form that sampling and marching read.
///
/// Voxel (i, j, k) is a sample at index-space position (i, j, k); indexToWorld takes it to the world. Brick b
/// covers the cells [8 b, 8 b + 8) and stores the samples 8 b - 1 .. 8 b + 9, so that trilinear values, their
/// central differences and tricubic values never leave the brick. Sign and units are those of the field it
/// was made from: shapes are positive inside. Every brick of the pool has kVolume samples: sample (x, y, z)
/// of the stored 11^3 at (z * 11 + y) * 11 + x.
class BrickGrid : public BrickLayout {
 public:
  /// The background everywhere. @throws Error if there are too many positions for a table, or the voxel size
  /// is not > 0.
  explicit BrickGrid(const Lattice& lattice = {}, const BrickBox& places = {}, float background = 0.0f);

  /// Makes room for a pool of so many bricks in all.
  void reserve(std::size_t bricks);
  /// Adds bricks, all samples 0, and returns the number of the first. @throws Error if there are more than
  /// can be numbered.
  std::int32_t append(std::size_t bricks);
  /// Adds a brick of one value and returns its number.
  std::int32_t appendConstant(float value);

  const float* brick(std::int32_t pool) const { return values_.data() + std::size_t(pool) * kVolume; }
  /// To be written. Its range does not follow: see setRange and fillBorders.
  float* brick(std::int32_t pool) { return values_.data() + std::size_t(pool) * kVolume; }
  /// The samples of all bricks, one after the other.
  const std::vector<float>& values() const { return values_; }
  /// The sample at voxel (i, j, k). Slow; for tests and conversion.
  float at(const Vec3i& voxel) const;
  /// Multiplies all samples and the background.
  void multiply(float factor);
  /// Bytes held.
  std::size_t memoryBytes() const;

 private:
  friend class PackedGrid;

  std::vector<float> values_;
};

/// A BrickGrid that will only be sampled, in half the memory: every sample is 16 bits between the least and
/// the largest of its brick, off by at most 1/131070 of their distance; bricks of one value stay exact. Both
/// forms of a border sample are rounded within their own brick, so values jump by as much from brick to
/// brick.
class PackedGrid : public BrickLayout {
 public:
  /// How the codes of a brick become values: low + unit * code.
  struct Code {
    static constexpr float kLargest = 65535.0f;
    float low, unit;

    static constexpr Code of(const Interval& range) {
      return {range.min, (range.max - range.min) / kLargest};
    }
  };

  /// The background everywhere.
  PackedGrid(const Lattice& lattice, const BrickBox& places, float background);
  /// Gives the memory of `grid` back while it works. All cores; the result does not depend on their number.
  /// @throws Error if a sample is not finite.
  explicit PackedGrid(BrickGrid grid);

  /// As those of BrickGrid; the codes of new bricks are 0.
  void reserve(std::size_t bricks);
  std::int32_t append(std::size_t bricks);
  /// kVolume codes, in the order of samples.
  const std::uint16_t* codes(std::int32_t pool) const { return codes_.data() + std::size_t(pool) * kVolume; }
  /// Encodes kVolume samples, which lie in `range`, as those of a brick. @throws Error if it is not finite.
  void encode(std::int32_t pool, const float* samples, const Interval& range);
  /// As those of BrickGrid.
  float at(const Vec3i& voxel) const;
  std::size_t memoryBytes() const;

 private:
  std::vector<std::uint16_t> codes_;
};

/// A grid to be sampled, packed or not, which must outlive it.
struct GridView {
  GridView(const BrickGrid& grid) : layout(&grid), values(grid.brick(0)) {}
  GridView(const PackedGrid& grid) : layout(&grid), codes(grid.codes(0)) {}

  const BrickLayout* layout;
  const float* values = nullptr;
  const std::uint16_t* codes = nullptr;
};

/// Floored division of a voxel coordinate by the brick size, and what is left (0 to 7).
constexpr int brickOf(int voxel) {
  return voxel >> 3;
}
constexpr int insideBrick(int voxel) {
  return voxel & 7;
}
constexpr Vec3i brickOf(const Vec3i& voxel) {
  return {brickOf(voxel.x), brickOf(voxel.y), brickOf(voxel.z)};
}
/// Offset of a stored sample in its pool brick; coordinates -1 to 9, the brick's own samples being 0 to 7.
constexpr int sampleOffset(int x, int y, int z) {
  return ((z + BrickGrid::kBefore) * BrickGrid::kWidth + y + BrickGrid::kBefore) * BrickGrid::kWidth + x +
         BrickGrid::kBefore;
}
/// The brick of the lattice that `point` (world) lies in; far away where the point is not finite.
inline Vec3i brickAt(const Lattice& lattice, const Vec3f& point) {
  constexpr float kFar = 1e9f;
  const Vec3f q = lattice.worldToIndex(point);
  const auto along = [](float x) { return brickOf(x > -kFar && x < kFar ? int(std::floor(x)) : int(kFar)); };
  return {along(q.x), along(q.y), along(q.z)};
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

/// Copies the shared border samples of all bricks from their neighbours' own samples and recomputes the
/// ranges. Call after writing the 8^3 own samples of pool bricks that each stand at one position. Shared
/// bricks keep their samples. Uses all cores; the result does not depend on their number.
void fillBorders(BrickGrid& grid);

/// Smallest and largest of one or more samples; everything if one of them is NaN.
Interval rangeOfSamples(std::span<const float> samples);

/// Range of kVolume samples; everything if one of them is not finite, since interpolation can then give NaN.
Interval rangeOfBrick(const float* samples);

/// Voxels of the table whose sample lies strictly inside `band`. Shared bricks count at every position.
std::size_t activeVoxelCount(const BrickGrid& grid, const Interval& band);

}  // namespace nephele

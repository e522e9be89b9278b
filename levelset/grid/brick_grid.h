#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "nephele/modeling/base/box.h"
#include "nephele/modeling/base/interval.h"
#include "nephele/modeling/base/math.h"

namespace nephele {

/// Sparse voxel values in bricks that are ready to be interpolated: the form that sampling and marching read.
///
/// Voxel (i, j, k) is a sample at index-space position (i, j, k); indexToWorld takes it to the world. Brick b
/// covers the cells [8 b, 8 b + 8) and stores the samples 8 b - 1 .. 8 b + 9, so that trilinear values, their
/// central differences and tricubic values never leave the brick. Sign and units are those of the field it
/// was made from: shapes are positive inside. Outside the table every sample is `background`.
struct BrickGrid {
  static constexpr int kBrick = 8;
  static constexpr int kBefore = 1;
  static constexpr int kAfter = 2;
  static constexpr int kWidth = kBrick + kBefore + kAfter;
  static constexpr int kVolume = kWidth * kWidth * kWidth;

  Affine indexToWorld;
  Affine worldToIndex;
  /// Edge of a voxel in world units (cube root of the volume for maps that are not uniform).
  float voxelSize = 1.0f;
  float background = 0.0f;

  /// Brick coordinates of table[0], and bricks per axis. Entry of brick b: x fastest, then y, then z.
  Vec3i firstBrick{};
  Vec3i brickCount{};
  /// Index into the pool for each brick position; never negative. Pool brick 0 is all background; one pool
  /// brick may stand at many positions where the grid is constant.
  std::vector<std::int32_t> table;
  /// kVolume samples per pool brick: sample (x, y, z) of the stored 11^3 at (z * 11 + y) * 11 + x.
  std::vector<float> values;
  /// The samples of a packed grid, in the same order, in place of `values`: see `pack`.
  std::vector<std::uint16_t> codes;
  /// Per pool brick: range of every stored sample, hence of every interpolated value in its cells.
  std::vector<Interval> ranges;

  std::size_t poolSize() const { return ranges.size(); }
  bool isPacked() const { return !codes.empty(); }
  /// Samples of a brick of a grid that is not packed.
  const float* brick(std::int32_t pool) const { return values.data() + std::size_t(pool) * kVolume; }
  float* brick(std::int32_t pool) { return values.data() + std::size_t(pool) * kVolume; }
  std::size_t tableIndex(const Vec3i& b) const {
    return (std::size_t(b.z - firstBrick.z) * brickCount.y + std::size_t(b.y - firstBrick.y)) * brickCount.x +
           std::size_t(b.x - firstBrick.x);
  }
  bool covers(const Vec3i& b) const {
    return b.x >= firstBrick.x && b.y >= firstBrick.y && b.z >= firstBrick.z &&
           b.x < firstBrick.x + brickCount.x && b.y < firstBrick.y + brickCount.y &&
           b.z < firstBrick.z + brickCount.z;
  }
  /// Pool index of the brick at brick coordinates `b`; 0 outside the table.
  std::int32_t poolIndex(const Vec3i& b) const { return covers(b) ? table[tableIndex(b)] : 0; }
  /// The sample at voxel (i, j, k). Slow; for tests and conversion.
  float at(const Vec3i& voxel) const;
  /// Bytes held.
  std::size_t memoryBytes() const;
  /// World-space box of the table; empty for an empty table.
  Box worldBox() const;
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

/// How the codes of a packed brick become values: low + unit * code.
struct BrickCode {
  static constexpr float kLargest = 65535.0f;
  float low, unit;
};

constexpr BrickCode brickCode(const Interval& range) {
  return {range.min, (range.max - range.min) / BrickCode::kLargest};
}

/// Halves the memory of a grid that will only be sampled: every sample becomes 16 bits between the least and
/// the largest of its brick, off by at most 1/131070 of their distance; bricks of one value stay exact. Both
/// forms of a border sample are rounded within their own brick, so values jump by as much from brick to
/// brick. Gives the memory back while it works. Uses all cores; the result does not depend on their number.
/// @throws Error if a sample is not finite.
void pack(BrickGrid& grid);

/// A pool brick that stands at exactly one position.
struct PlacedBrick {
  std::int32_t pool;
  Vec3i brick;
};

/// The pool bricks that stand at exactly one position, in the order of the pool; never the background brick.
/// Only these may be written: their borders are copies that `fillBorders` renews, the other bricks are
/// constants. So a neighbourhood operation runs over them in parallel, reads through the borders, writes own
/// samples elsewhere, copies back, and calls `fillBorders` between sweeps.
std::vector<PlacedBrick> placedBricks(const BrickGrid& grid);

/// Copies the shared border samples of all bricks from their neighbours' own samples and recomputes `ranges`.
/// Call after writing the 8^3 own samples of pool bricks that each stand at one position. Shared bricks keep
/// their samples. Uses all cores; the result does not depend on their number.
void fillBorders(BrickGrid& grid);

/// Smallest and largest of one or more samples; everything if one of them is NaN.
Interval rangeOfSamples(std::span<const float> samples);

/// Range of kVolume samples; everything if one of them is not finite, since interpolation can then give NaN.
Interval rangeOfBrick(const float* samples);

/// Voxels of the table whose sample lies strictly inside `band`. Shared bricks count at every position.
std::size_t activeVoxelCount(const BrickGrid& grid, const Interval& band);

/// Ranges of stored samples over regions of a grid: a pyramid of block ranges, so that any region costs at
/// most 64 look-ups. The grid must outlive it and keep its samples.
class BrickRanges {
 public:
  explicit BrickRanges(const BrickGrid& grid);

  /// Contains every sample stored by the bricks [first, last], both included: exact up to 4 bricks per axis,
  /// wider for larger regions. Includes the background where the region leaves the table.
  Interval over(const Vec3i& first, const Vec3i& last) const;

 private:
  struct Level {
    Vec3i count;
    std::vector<Interval> ranges;
  };

  Interval at(std::size_t level, const Vec3i& cell) const;

  const BrickGrid& grid_;
  std::vector<Level> levels_;
};

}  // namespace nephele

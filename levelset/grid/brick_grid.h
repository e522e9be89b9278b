#pragma once

#include <functional>
#include <span>
#include <vector>

#include "nephele/levelset/grid/brick_layout.h"
#include "nephele/levelset/grid/large_buffer.h"

namespace nephele {

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
  /// The same with samples that are not set, nor are their ranges.
  std::int32_t appendUnset(std::size_t bricks);
  /// Adds a brick of one value and returns its number.
  std::int32_t appendConstant(float value);

  const float* brick(std::int32_t pool) const { return values_.data() + std::size_t(pool) * kVolume; }
  /// To be written. Its range does not follow: see setRange and fillBorders.
  float* brick(std::int32_t pool) { return values_.data() + std::size_t(pool) * kVolume; }
  /// The samples of all bricks, one after the other.
  const detail::UnsetVector<float>& values() const { return values_; }
  /// The sample at voxel (i, j, k). Slow; for tests and conversion.
  float at(const Vec3i& voxel) const;
  /// Multiplies all samples and the background.
  void multiply(float factor);
  /// Bytes held.
  std::size_t memoryBytes() const;

 private:
  friend class PackedGrid;

  detail::UnsetVector<float> values_;
};

/// Takes the samples of bricks while a grid is made, in place of the grid: that reads as 0 then, but has its
/// ranges and its layout.
struct BrickSink {
  /// Told first how many bricks the pool has, and at how many places of the table they stand.
  std::function<void(std::size_t bricks, std::size_t places)> begin;
  /// Given the kVolume samples of each brick of the pool once, from several threads.
  std::function<void(std::int32_t pool, const float* samples)> take;

  explicit operator bool() const { return bool(take); }
};

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

// Bricks of 8^3 samples stored with the border that interpolation needs, so that no sample is ever looked up
// across bricks. A brick is stored once per position, except for constants, which share one pool brick: those
// are known by standing at several positions (or by being the background) and are never written after they
// were made.
//
// fillBorders copies, for each of the 26 neighbours, the part of its own samples that overlaps the border. It
// reads own samples only and writes border samples only, so bricks are independent and can be done in
// parallel.

#include "nephele/levelset/grid/brick_grid.h"

#include <algorithm>
#include <cmath>

#include "nephele/levelset/grid/detail/brick_borders.h"
#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {

namespace {

constexpr int kBrick = BrickGrid::kBrick;
constexpr int kVolume = BrickGrid::kVolume;
constexpr std::size_t kBricksPerTask = 64;

void fillBorder(BrickGrid& grid, const PlacedBrick& placed) {
  float* brick = grid.brick(placed.pool);
  for (const detail::BorderPart& part : detail::kBorderParts) {
    if (part.side == Vec3i{}) continue;
    const float* neighbour = grid.brick(grid.poolIndex(placed.brick + part.side)) + sampleOffset(0, 0, 0);
    detail::copyPart(part, neighbour, detail::kStoredStrides, 1.0f, brick);
  }
}

}  // namespace

BrickGrid::BrickGrid(const Lattice& lattice, const BrickBox& places, float background)
    : BrickLayout(lattice, places, background), values_(kVolume, background) {}

void BrickGrid::reserve(std::size_t bricks) {
  requirePool(bricks);
  detail::reserveLarge(values_, bricks * kVolume);
  ranges_.reserve(bricks);
}

std::int32_t BrickGrid::append(std::size_t bricks) {
  const std::int32_t first = appendUnset(bricks);
  std::fill(values_.begin() + std::ptrdiff_t(first) * kVolume, values_.end(), 0.0f);
  return first;
}

std::int32_t BrickGrid::appendUnset(std::size_t bricks) {
  const std::size_t count = (poolSize() + bricks) * kVolume;
  requirePool(poolSize() + bricks);
  if (values_.capacity() < count)
    detail::reserveLarge(values_, std::max(count, values_.size() + values_.size() / 2));
  values_.resize(count);
  return appendRanges(bricks);
}

std::int32_t BrickGrid::appendConstant(float value) {
  const std::int32_t pool = append(1);
  std::fill_n(brick(pool), kVolume, value);
  setRange(pool, Interval::of(value));
  return pool;
}

float BrickGrid::at(const Vec3i& voxel) const {
  return brick(poolIndex(brickOf(voxel)))[sampleOffset(insideBrick(voxel))];
}

void BrickGrid::multiply(float factor) {
  background_ *= factor;
  for (float& value : values_) value *= factor;
  for (Interval& range : ranges_) {
    const float a = range.min * factor, b = range.max * factor;
    range = {std::min(a, b), std::max(a, b)};
  }
}

std::size_t BrickGrid::memoryBytes() const {
  return sizeof(BrickGrid) + layoutBytes() + values_.capacity() * sizeof(float);
}

Interval rangeOfSamples(std::span<const float> samples) {
  // Independent lanes, so that the compiler may use vector minima without reordering one running minimum.
  constexpr std::size_t kLanes = 16;
  const std::size_t full = samples.size() / kLanes * kLanes;
  float low[kLanes], high[kLanes];
  std::int32_t isNan[kLanes];
  std::fill_n(low, kLanes, samples[0]);
  std::fill_n(high, kLanes, samples[0]);
  std::fill_n(isNan, kLanes, 0);
  const auto take = [&](std::size_t l, float v) {
    low[l] = v < low[l] ? v : low[l];
    high[l] = v > high[l] ? v : high[l];
    isNan[l] |= v != v;
  };
  for (std::size_t i = 0; i < full; i += kLanes)
    for (std::size_t l = 0; l < kLanes; ++l) take(l, samples[i + l]);
  for (std::size_t i = full; i < samples.size(); ++i) take(i - full, samples[i]);
  Interval range{low[0], high[0]};
  for (std::size_t l = 0; l < kLanes; ++l) {
    if (isNan[l]) return Interval::everything();
    range = range.hull({low[l], high[l]});
  }
  return range;
}

Interval rangeOfBrick(const float* samples) {
  const Interval range = rangeOfSamples({samples, kVolume});
  return std::isfinite(range.min) && std::isfinite(range.max) ? range : Interval::everything();
}

void fillBorders(BrickGrid& grid) {
  const std::vector<PlacedBrick> placed = placedBricks(grid);
  parallelFor(placed.size(), kBricksPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) fillBorder(grid, placed[i]);
  });
  parallelFor(grid.poolSize(), kBricksPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      grid.setRange(std::int32_t(i), rangeOfBrick(grid.brick(std::int32_t(i))));
  });
}

std::size_t activeVoxelCount(const BrickGrid& grid, const Interval& band) {
  std::vector<int> perBrick(grid.poolSize());
  parallelFor(grid.poolSize(), kBricksPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const float* samples = grid.brick(std::int32_t(i));
      int count = 0;
      for (int z = 0; z < kBrick; ++z)
        for (int y = 0; y < kBrick; ++y) {
          const float* row = samples + sampleOffset(0, y, z);
          for (int x = 0; x < kBrick; ++x) count += row[x] > band.min && row[x] < band.max;
        }
      perBrick[i] = count;
    }
  });
  std::size_t count = 0;
  for (const std::int32_t pool : grid.table()) count += std::size_t(perBrick[std::size_t(pool)]);
  return count;
}

}  // namespace nephele

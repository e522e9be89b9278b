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

#include "nephele/levelset/grid/brick_table.h"
#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/modeling/base/assertion.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {

namespace {

constexpr int kBrick = BrickGrid::kBrick;
constexpr int kVolume = BrickGrid::kVolume;
constexpr std::size_t kBricksPerTask = 64;

/// The part of one axis that a brick's border shares with its neighbour on side -1, 0 or 1.
struct Overlap {
  int begin;
  int count;
};

constexpr Overlap overlap(int side) {
  if (side < 0) return {-BrickGrid::kBefore, BrickGrid::kBefore};
  if (side > 0) return {kBrick, BrickGrid::kAfter};
  return {0, kBrick};
}

void fillFrom(const float* neighbour, const Vec3i& side, float* brick) {
  const Overlap x = overlap(side.x), y = overlap(side.y), z = overlap(side.z);
  const int shift = sampleOffset(side.x * kBrick, side.y * kBrick, side.z * kBrick) - sampleOffset(0, 0, 0);
  for (int k = z.begin; k < z.begin + z.count; ++k)
    for (int j = y.begin; j < y.begin + y.count; ++j) {
      const int offset = sampleOffset(x.begin, j, k);
      for (int i = 0; i < x.count; ++i) brick[offset + i] = neighbour[offset - shift + i];
    }
}

void fillBorder(BrickGrid& grid, const PlacedBrick& placed) {
  float* brick = grid.brick(placed.pool);
  for (int z = -1; z <= 1; ++z)
    for (int y = -1; y <= 1; ++y)
      for (int x = -1; x <= 1; ++x) {
        const Vec3i side{x, y, z};
        if (side == Vec3i{}) continue;
        fillFrom(grid.brick(grid.poolIndex(placed.brick + side)), side, brick);
      }
}

}  // namespace

BrickLayout::BrickLayout(const Lattice& lattice, const BrickBox& places, float background)
    : background_(background), places_(places) {
  setLattice(lattice);
  require(places.count.x >= 0 && places.count.y >= 0 && places.count.z >= 0,
          "grid: the table must have one entry per brick position");
  requireHoldable("grid", places);
  table_.assign(places.size(), 0);
  ranges_.assign(1, Interval::of(background));
}

Box BrickLayout::worldBox() const {
  Box box;
  if (table_.empty()) return box;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3i b{firstBrick().x + (corner & 1 ? brickCount().x : 0),
                  firstBrick().y + (corner & 2 ? brickCount().y : 0),
                  firstBrick().z + (corner & 4 ? brickCount().z : 0)};
    box = box.including(indexToWorld()(Vec3f(b * kBrick)));
  }
  return box;
}

void BrickLayout::setLattice(const Lattice& lattice) {
  require(lattice.voxelSize > 0 && std::isfinite(lattice.voxelSize), "grid: the voxel size must be > 0");
  lattice_ = lattice;
}

void BrickLayout::place(const Vec3i& brick, std::int32_t pool) {
  NEPHELE_ASSERT(covers(brick));
  NEPHELE_ASSERT(pool >= 0 && std::size_t(pool) < poolSize());
  table_[tableIndex(brick)] = pool;
}

void BrickLayout::setTable(std::vector<std::int32_t> table) {
  require(table.size() == places_.size(), "grid: the table must have one entry per brick position");
  for (const std::int32_t pool : table)
    require(pool >= 0 && std::size_t(pool) < poolSize(), "grid: the table names a brick that is not there");
  table_ = std::move(table);
}

void BrickLayout::setRange(std::int32_t pool, const Interval& range) {
  NEPHELE_ASSERT(pool >= 0 && std::size_t(pool) < poolSize());
  ranges_[std::size_t(pool)] = range;
}

void BrickLayout::requirePool(std::size_t size) const {
  require(double(size) <= kMostBricks, "grid: there are more bricks than can be numbered; use larger voxels");
}

BrickGrid::BrickGrid(const Lattice& lattice, const BrickBox& places, float background)
    : BrickLayout(lattice, places, background), values_(kVolume, background) {}

void BrickGrid::reserve(std::size_t bricks) {
  requirePool(bricks);
  detail::reserveLarge(values_, bricks * kVolume);
  ranges_.reserve(bricks);
}

std::int32_t BrickGrid::append(std::size_t bricks) {
  const std::size_t first = poolSize();
  requirePool(first + bricks);
  const std::size_t count = (first + bricks) * kVolume;
  if (values_.capacity() < count)
    detail::reserveLarge(values_, std::max(count, values_.size() + values_.size() / 2));
  values_.resize(count);
  ranges_.resize(first + bricks, Interval::of(0.0f));
  return std::int32_t(first);
}

std::int32_t BrickGrid::appendConstant(float value) {
  const std::size_t first = poolSize();
  requirePool(first + 1);
  values_.resize((first + 1) * kVolume, value);
  ranges_.push_back(Interval::of(value));
  return std::int32_t(first);
}

float BrickGrid::at(const Vec3i& voxel) const {
  const Vec3i b = brickOf(voxel);
  if (!covers(b)) return background();
  return brick(poolIndex(b))[sampleOffset(insideBrick(voxel.x), insideBrick(voxel.y), insideBrick(voxel.z))];
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
  return sizeof(BrickGrid) + table().capacity() * sizeof(std::int32_t) + values_.capacity() * sizeof(float) +
         ranges().capacity() * sizeof(Interval);
}

std::vector<PlacedBrick> placedBricks(const BrickLayout& grid) {
  constexpr std::int64_t kNone = -1, kSeveral = -2;
  std::vector<std::int64_t> position(grid.poolSize(), kNone);
  for (std::size_t i = 0; i < grid.table().size(); ++i) {
    std::int64_t& p = position[std::size_t(grid.table()[i])];
    p = p == kNone ? std::int64_t(i) : kSeveral;
  }
  std::vector<PlacedBrick> placed;
  for (std::size_t pool = 1; pool < position.size(); ++pool) {
    if (position[pool] < 0) continue;
    const std::int64_t i = position[pool], row = i / grid.brickCount().x;
    placed.push_back({std::int32_t(pool),
                      grid.firstBrick() + Vec3i{int(i % grid.brickCount().x), int(row % grid.brickCount().y),
                                                int(row / grid.brickCount().y)}});
  }
  return placed;
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

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

#include "nephele/levelset/grid/brick_samples.h"
#include "nephele/levelset/grid/large_buffer.h"
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

float BrickGrid::at(const Vec3i& voxel) const {
  const Vec3i b = brickOf(voxel);
  if (!covers(b)) return background;
  const auto pool = std::size_t(table[tableIndex(b)]);
  const std::size_t sample =
      pool * kVolume +
      std::size_t(sampleOffset(insideBrick(voxel.x), insideBrick(voxel.y), insideBrick(voxel.z)));
  if (!isPacked()) return values[sample];
  const BrickCode code = brickCode(ranges[pool]);
  return code.low + code.unit * float(codes[sample]);
}

std::size_t BrickGrid::memoryBytes() const {
  return sizeof(BrickGrid) + table.capacity() * sizeof(std::int32_t) + values.capacity() * sizeof(float) +
         codes.capacity() * sizeof(std::uint16_t) + ranges.capacity() * sizeof(Interval);
}

Box BrickGrid::worldBox() const {
  Box box;
  if (table.empty()) return box;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3i b{firstBrick.x + (corner & 1 ? brickCount.x : 0),
                  firstBrick.y + (corner & 2 ? brickCount.y : 0),
                  firstBrick.z + (corner & 4 ? brickCount.z : 0)};
    box = box.including(indexToWorld(Vec3f(b * kBrick)));
  }
  return box;
}

void pack(BrickGrid& grid) {
  if (grid.isPacked()) return;
  for (const Interval& range : grid.ranges)
    require(std::isfinite(range.min) && std::isfinite(range.max), "pack: every sample must be finite");
  // So many that a batch of floats is worth returning to the system.
  constexpr std::size_t kBatch = 2048;
  const std::size_t bricks = grid.poolSize();
  detail::reserveLarge(grid.codes, bricks * kVolume);
  for (std::size_t first = 0; first < bricks; first += kBatch) {
    const std::size_t last = std::min(first + kBatch, bricks);
    grid.codes.resize(last * kVolume);
    parallelFor(last - first, kBricksPerTask, [&](std::size_t begin, std::size_t end) {
      for (std::size_t b = first + begin; b < first + end; ++b) {
        detail::encodeBrick(grid.values.data() + b * kVolume, grid.ranges[b],
                            grid.codes.data() + b * kVolume);
      }
    });
    detail::releasePages(grid.values.data() + first * kVolume, grid.values.data() + last * kVolume);
  }
  std::vector<float>().swap(grid.values);
}

std::vector<PlacedBrick> placedBricks(const BrickGrid& grid) {
  constexpr std::int64_t kNone = -1, kSeveral = -2;
  std::vector<std::int64_t> position(grid.poolSize(), kNone);
  for (std::size_t i = 0; i < grid.table.size(); ++i) {
    std::int64_t& p = position[std::size_t(grid.table[i])];
    p = p == kNone ? std::int64_t(i) : kSeveral;
  }
  std::vector<PlacedBrick> placed;
  for (std::size_t pool = 1; pool < position.size(); ++pool) {
    if (position[pool] < 0) continue;
    const std::int64_t i = position[pool], row = i / grid.brickCount.x;
    placed.push_back(
        {std::int32_t(pool), grid.firstBrick + Vec3i{int(i % grid.brickCount.x), int(row % grid.brickCount.y),
                                                     int(row / grid.brickCount.y)}});
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
  require(!grid.isPacked(), "fillBorders: the grid must not be packed");
  grid.ranges.resize(grid.values.size() / kVolume);
  const std::vector<PlacedBrick> placed = placedBricks(grid);
  parallelFor(placed.size(), kBricksPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) fillBorder(grid, placed[i]);
  });
  parallelFor(grid.poolSize(), kBricksPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) grid.ranges[i] = rangeOfBrick(grid.brick(std::int32_t(i)));
  });
}

std::size_t activeVoxelCount(const BrickGrid& grid, const Interval& band) {
  require(!grid.isPacked(), "activeVoxelCount: the grid must not be packed");
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
  for (const std::int32_t pool : grid.table) count += std::size_t(perBrick[std::size_t(pool)]);
  return count;
}

BrickRanges::BrickRanges(const BrickGrid& grid) : grid_(grid) {
  Vec3i count = grid.brickCount;
  while (std::max({count.x, count.y, count.z}) > 4) {
    const Vec3i finer = count;
    count = {(finer.x + 1) / 2, (finer.y + 1) / 2, (finer.z + 1) / 2};
    Level level{count, {}};
    level.ranges.reserve(std::size_t(count.x) * count.y * count.z);
    for (int z = 0; z < count.z; ++z)
      for (int y = 0; y < count.y; ++y)
        for (int x = 0; x < count.x; ++x) {
          Interval range = at(levels_.size(), {2 * x, 2 * y, 2 * z});
          for (int child = 1; child < 8; ++child) {
            const Vec3i c{2 * x + (child & 1), 2 * y + (child >> 1 & 1), 2 * z + (child >> 2)};
            if (c.x < finer.x && c.y < finer.y && c.z < finer.z) range = range.hull(at(levels_.size(), c));
          }
          level.ranges.push_back(range);
        }
    levels_.push_back(std::move(level));
  }
}

Interval BrickRanges::at(std::size_t level, const Vec3i& cell) const {
  const Vec3i& count = level == 0 ? grid_.brickCount : levels_[level - 1].count;
  const std::size_t i = (std::size_t(cell.z) * count.y + std::size_t(cell.y)) * count.x + std::size_t(cell.x);
  return level == 0 ? grid_.ranges[std::size_t(grid_.table[i])] : levels_[level - 1].ranges[i];
}

Interval BrickRanges::over(const Vec3i& first, const Vec3i& last) const {
  const Interval background = Interval::of(grid_.background);
  const Vec3i low = max(first, grid_.firstBrick),
              high = min(last, grid_.firstBrick + grid_.brickCount - Vec3i{1, 1, 1});
  if (low.x > high.x || low.y > high.y || low.z > high.z) return background;
  Vec3i a = low - grid_.firstBrick, b = high - grid_.firstBrick;
  std::size_t level = 0;
  for (; std::max({b.x - a.x, b.y - a.y, b.z - a.z}) >= 4; ++level) {
    a = {a.x / 2, a.y / 2, a.z / 2};
    b = {b.x / 2, b.y / 2, b.z / 2};
  }
  Interval range = low == first && high == last ? at(level, a) : background;
  for (int z = a.z; z <= b.z; ++z)
    for (int y = a.y; y <= b.y; ++y)
      for (int x = a.x; x <= b.x; ++x) range = range.hull(at(level, {x, y, z}));
  return range;
}

}  // namespace nephele

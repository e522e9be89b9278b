// A position needs samples of its own exactly if the 27 positions around it do not all hold one constant and
// its 11^3 samples differ: so a brick beside a block exists where interpolation reaches into that block.
// Passes run on all cores, each piece writes its own places, and pool order is table order: the result does
// not depend on the threads.
#include "nephele/levelset/grid/detail/block_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "nephele/levelset/grid/detail/brick_borders.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {

namespace {

/// Copies the 11^3 samples around one position.
void gather(const BlockTable& table, const Vec3i& brick, float* target) {
  for (const BorderPart& part : kBorderParts) {
    const std::int32_t code = table.codes.at(brick + part.side);
    if (code <= 0)
      fillPart(part, table.sign * table.constant(code), target);
    else if (table.order == BlockTable::Order::xFastest)
      copyPart(part, table.block(code), kOwnStrides, table.sign, target);
    else
      copyPart(part, table.block(code), kZFastestStrides, table.sign, target);
  }
}

const SampleStrides& stridesOf(const BlockTable& table) {
  return table.order == BlockTable::Order::xFastest ? kOwnStrides : kZFastestStrides;
}

/// Whether a constant brick stands among others as if all were like it: no sample that it stores differs.
bool isLikeAround(const BlockTable& table, const Vec3i& brick, float value) {
  for (const BorderPart& part : kBorderParts) {
    const std::int32_t code = table.codes.at(brick + part.side);
    if (code <= 0) {
      if (table.sign * table.constant(code) != value) return false;
      continue;
    }
    const SampleStrides& strides = stridesOf(table);
    const float* from =
        table.block(code) + part.source.x * strides.x + part.source.y * strides.y + part.source.z * strides.z;
    for (int z = 0; z < part.count.z; ++z)
      for (int y = 0; y < part.count.y; ++y)
        for (int x = 0; x < part.count.x; ++x)
          if (!(table.sign * from[z * strides.z + y * strides.y + x * strides.x] == value)) return false;
  }
  return true;
}

constexpr std::int32_t kSampled = -1;

/// Says for one row of bricks what stands there: kSampled, or a constant's number. Returns how many are
/// sampled.
std::uint32_t classifyRow(const BlockTable& table, Beside beside, const Vec3i& first, std::int32_t* entries) {
  const auto length = std::size_t(table.codes.box.count.x);
  const std::int32_t* own = table.codes.entries.data() + table.codes.box.numberOf(first);
  if (beside == Beside::constant) {
    std::uint32_t sampled = 0;
    for (std::size_t x = 0; x < length; ++x) {
      entries[x] = own[x] > 0 ? kSampled : -own[x];
      sampled += own[x] > 0;
    }
    return sampled;
  }
  std::vector<std::uint8_t> mixed(length, 0);
  const auto compare = [&](const std::int32_t* other) {
    for (std::size_t x = 0; x < length; ++x)
      mixed[x] |= std::uint8_t((other ? other[x] : 0) != own[x]) |
                  std::uint8_t((other && x > 0 ? other[x - 1] : 0) != own[x]) |
                  std::uint8_t((other && x + 1 < length ? other[x + 1] : 0) != own[x]);
  };
  for (int dz = -1; dz <= 1; ++dz)
    for (int dy = -1; dy <= 1; ++dy) {
      const Vec3i row = first + Vec3i{0, dy, dz};
      compare(table.codes.box.covers(row) ? table.codes.entries.data() + table.codes.box.numberOf(row)
                                          : nullptr);
    }
  std::uint32_t sampled = 0;
  for (std::size_t x = 0; x < length; ++x) {
    entries[x] = own[x] > 0 ? 0 : -own[x];
    if (!mixed[x]) continue;
    // Beside a block: only needed if a sample that interpolation reads differs.
    if (own[x] <= 0 && isLikeAround(table, first + Vec3i{int(x), 0, 0}, table.sign * table.constant(own[x])))
      continue;
    entries[x] = kSampled;
    ++sampled;
  }
  return sampled;
}

}  // namespace

void requireFinite(const float* samples, int count, const std::string& name) {
  std::uint32_t bad = 0;
  for (int i = 0; i < count; ++i)
    bad |= std::uint32_t((std::bit_cast<std::uint32_t>(samples[i]) & 0x7f800000u) == 0x7f800000u);
  if (bad) throw Error(fmt::format("grid {} holds values that are not finite", name));
}

std::shared_ptr<BrickGrid> gatherBricks(const BlockTable& blocks, const Lattice& lattice, Beside beside,
                                        const std::string& name, const BrickSink& made) {
  auto result =
      std::make_shared<BrickGrid>(lattice, blocks.codes.box, blocks.sign * blocks.constants.front());

  // A constant keeps its number in the pool; positions with samples of their own come after the constants.
  const std::vector<float>& constants = blocks.constants;
  const auto rowLength = std::size_t(blocks.codes.box.count.x),
             rowsPerSlice = std::size_t(blocks.codes.box.count.y);
  const std::size_t rowCount = rowsPerSlice * std::size_t(blocks.codes.box.count.z);
  const auto firstOfRow = [&](std::size_t row) {
    return blocks.codes.box.first + Vec3i{0, int(row % rowsPerSlice), int(row / rowsPerSlice)};
  };
  std::vector<std::int32_t> table(rowLength * rowCount);
  std::vector<std::uint32_t> rowStart(rowCount + 1, 0);
  parallelFor(rowCount, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row)
      rowStart[row + 1] = classifyRow(blocks, beside, firstOfRow(row), table.data() + row * rowLength);
  });
  for (std::size_t row = 0; row < rowCount; ++row) rowStart[row + 1] += rowStart[row];

  const std::size_t pool = constants.size() + rowStart[rowCount];
  require(double(pool) <= kMostBricks,
          fmt::format("grid {} has more bricks than can be numbered; use a coarser voxel size", name));
  requireFinite(constants.data(), int(constants.size()), name);
  result->reserve(pool);
  for (std::size_t c = 1; c < constants.size(); ++c) result->appendConstant(blocks.sign * constants[c]);
  result->appendUnset(rowStart[rowCount]);
  if (made) {
    made.begin(pool, table.size());
    for (std::int32_t c = 0; c < std::int32_t(constants.size()); ++c) made.take(c, result->brick(c));
  }
  parallelFor(rowCount, 4, [&](std::size_t begin, std::size_t end) {
    std::array<float, BrickGrid::kVolume> passed;
    for (std::size_t row = begin; row < end; ++row) {
      if (rowStart[row + 1] == rowStart[row]) continue;
      auto next = std::int32_t(constants.size() + rowStart[row]);
      for (std::size_t x = 0; x < rowLength; ++x) {
        std::int32_t& entry = table[row * rowLength + x];
        if (entry != kSampled) continue;
        entry = next++;
        float* samples = made ? passed.data() : result->brick(entry);
        gather(blocks, firstOfRow(row) + Vec3i{int(x), 0, 0}, samples);
        requireFinite(samples, BrickGrid::kVolume, name);
        result->setRange(entry, rangeOfBrick(samples));
        if (made) made.take(entry, samples);
      }
    }
  });
  result->setTable(std::move(table));
  return result;
}

}  // namespace nephele::detail

namespace nephele {

std::shared_ptr<BrickGrid> toBricks(const VoxelGrid<float>& grid, Beside beside, const BrickSink& made) {
  constexpr int kFar = std::numeric_limits<int>::max();
  Vec3i first{kFar, kFar, kFar}, last = -first;
  grid.forEachBrick([&](const Vec3i& brick, std::int32_t) {
    first = min(first, brick);
    last = max(last, brick);
  });
  detail::BlockTable blocks;
  blocks.constants = grid.constants();
  if (first.x <= last.x) {
    const Vec3i one{1, 1, 1};
    const BrickBox box{first - one, last - first + one * 3};
    requireHoldable("grid", box);
    blocks.codes = FlatBrickTable(box);
    for (std::size_t i = 0; i < grid.sampledBricks(); ++i)
      blocks.blocks.push_back(grid.samples(std::int32_t(i)));
    grid.forEachBrick([&](const Vec3i& brick, std::int32_t entry) { blocks.codes[brick] = entry + 1; });
  }
  return detail::gatherBricks(blocks, grid.lattice(), beside, "'grid'", made);
}

VoxelGrid<float> toVoxels(const BrickGrid& bricks) {
  VoxelGrid<float> grid("grid", bricks.lattice(), bricks.background());
  const Vec3i first = bricks.firstBrick(), count = bricks.brickCount();
  for (int z = 0; z < count.z; ++z)
    for (int y = 0; y < count.y; ++y)
      for (int x = 0; x < count.x; ++x) {
        const Vec3i brick = first + Vec3i{x, y, z};
        const std::int32_t pool = bricks.poolIndex(brick);
        if (pool == 0) continue;
        if (const Interval range = bricks.ranges()[std::size_t(pool)]; range.isPoint()) {
          grid.setConstant(brick, range.min);
          continue;
        }
        const float* from = bricks.brick(pool);
        std::array<float, kBrickSamples> own;
        auto to = own.begin();
        for (int k = 0; k < kBrickSide; ++k)
          for (int j = 0; j < kBrickSide; ++j) to = std::copy_n(from + sampleOffset(0, j, k), kBrickSide, to);
        // Some bricks are there for their neighbours' borders.
        if (std::ranges::any_of(own, [&](float value) { return value != bricks.background(); }))
          std::ranges::copy(own, grid.add(brick));
      }
  return grid;
}

}  // namespace nephele

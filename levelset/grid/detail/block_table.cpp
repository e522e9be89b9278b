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

#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {

namespace {

constexpr int kBrick = BrickGrid::kBrick;
constexpr int kWidth = BrickGrid::kWidth;

/// The codes of the 27 positions around one, x fastest.
using Neighbours = std::array<std::int32_t, 27>;

Neighbours neighboursOf(const BlockTable& table, const Vec3i& brick) {
  Neighbours result;
  int k = 0;
  for (int dz = -1; dz <= 1; ++dz)
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx, ++k) {
        const Vec3i b = brick + Vec3i{dx, dy, dz};
        result[std::size_t(k)] = table.box.covers(b) ? table.codes[table.box.numberOf(b)] : 0;
      }
  return result;
}

/// Where the samples of a brick lie along one axis: in the neighbour before, in the brick, in the one after.
struct AxisPart {
  int target, source, count;
};
constexpr AxisPart kAxisParts[3] = {{0, kBrick - 1, 1}, {1, 0, kBrick}, {1 + kBrick, 0, 2}};

/// Copies the 11^3 samples around one position.
template <BlockTable::Order kOrder>
void gather(const BlockTable& table, const Neighbours& around, float* target) {
  constexpr int kX = kOrder == BlockTable::Order::xFastest ? 1 : kBrick * kBrick;
  constexpr int kZ = kOrder == BlockTable::Order::xFastest ? kBrick * kBrick : 1;
  const float sign = table.sign;
  for (int k = 0; k < 27; ++k) {
    const AxisPart px = kAxisParts[k % 3], py = kAxisParts[k / 3 % 3], pz = kAxisParts[k / 9];
    const std::int32_t code = around[std::size_t(k)];
    float* out = target + (pz.target * kWidth + py.target) * kWidth + px.target;
    const auto forEach = [&](const auto& value) {
      for (int z = 0; z < pz.count; ++z)
        for (int y = 0; y < py.count; ++y)
          for (int x = 0; x < px.count; ++x) out[(z * kWidth + y) * kWidth + x] = sign * value(x, y, z);
    };
    if (code <= 0) {
      const float constant = table.constant(code);
      forEach([constant](int, int, int) { return constant; });
    } else {
      const float* in = table.block(code) + px.source * kX + py.source * kBrick + pz.source * kZ;
      forEach([in](int x, int y, int z) { return in[x * kX + y * kBrick + z * kZ]; });
    }
  }
}

void gather(const BlockTable& table, const Vec3i& brick, float* target) {
  const Neighbours around = neighboursOf(table, brick);
  if (table.order == BlockTable::Order::xFastest)
    gather<BlockTable::Order::xFastest>(table, around, target);
  else
    gather<BlockTable::Order::zFastest>(table, around, target);
}

Interval rangeOfStored(const float* samples, int count) {
  // Independent lanes let the compiler keep minima and maxima in vector registers.
  constexpr int kLanes = 16;
  float low[kLanes], high[kLanes];
  std::fill_n(low, kLanes, std::numeric_limits<float>::infinity());
  std::fill_n(high, kLanes, -std::numeric_limits<float>::infinity());
  int i = 0;
  for (; i + kLanes <= count; i += kLanes)
    for (int l = 0; l < kLanes; ++l) {
      low[l] = samples[i + l] < low[l] ? samples[i + l] : low[l];
      high[l] = samples[i + l] > high[l] ? samples[i + l] : high[l];
    }
  for (; i < count; ++i) {
    low[0] = std::min(low[0], samples[i]);
    high[0] = std::max(high[0], samples[i]);
  }
  return {*std::min_element(low, low + kLanes), *std::max_element(high, high + kLanes)};
}

void requireFinite(const float* samples, int count, const std::string& name) {
  std::uint32_t bad = 0;
  for (int i = 0; i < count; ++i)
    bad |= std::uint32_t((std::bit_cast<std::uint32_t>(samples[i]) & 0x7f800000u) == 0x7f800000u);
  if (bad) throw Error(fmt::format("grid {} holds values that are not finite", name));
}

constexpr std::int32_t kSampled = -1;

/// Says for one row of bricks what stands there: kSampled, or a constant's number. Returns how many are
/// sampled.
std::uint32_t classifyRow(const BlockTable& table, Beside beside, const Vec3i& first, std::int32_t* entries) {
  const auto length = std::size_t(table.box.count.x);
  const std::int32_t* own = table.codes.data() + table.box.numberOf(first);
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
      compare(table.box.covers(row) ? table.codes.data() + table.box.numberOf(row) : nullptr);
    }
  std::uint32_t sampled = 0;
  for (std::size_t x = 0; x < length; ++x) {
    entries[x] = own[x] > 0 ? 0 : -own[x];
    if (!mixed[x]) continue;
    if (own[x] <= 0) {
      // Beside a block: only needed if a sample that interpolation reads differs.
      float samples[BrickGrid::kVolume];
      gather(table, first + Vec3i{int(x), 0, 0}, samples);
      const float value = table.sign * table.constant(own[x]);
      if (std::all_of(samples, samples + BrickGrid::kVolume, [&](float s) { return s == value; })) continue;
    }
    entries[x] = kSampled;
    ++sampled;
  }
  return sampled;
}

}  // namespace

std::shared_ptr<BrickGrid> gatherBricks(const BlockTable& blocks, const Lattice& lattice, Beside beside,
                                        const std::string& name) {
  auto result = std::make_shared<BrickGrid>(lattice, blocks.box, blocks.sign * blocks.constants.front());

  // A constant keeps its number in the pool; positions with samples of their own come after the constants.
  const std::vector<float>& constants = blocks.constants;
  const auto rowLength = std::size_t(blocks.box.count.x), rowsPerSlice = std::size_t(blocks.box.count.y);
  const std::size_t rowCount = rowsPerSlice * std::size_t(blocks.box.count.z);
  const auto firstOfRow = [&](std::size_t row) {
    return blocks.box.first + Vec3i{0, int(row % rowsPerSlice), int(row / rowsPerSlice)};
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
  result->append(rowStart[rowCount]);
  parallelFor(rowCount, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      if (rowStart[row + 1] == rowStart[row]) continue;
      auto next = std::int32_t(constants.size() + rowStart[row]);
      for (std::size_t x = 0; x < rowLength; ++x) {
        std::int32_t& entry = table[row * rowLength + x];
        if (entry != kSampled) continue;
        entry = next++;
        float* samples = result->brick(entry);
        gather(blocks, firstOfRow(row) + Vec3i{int(x), 0, 0}, samples);
        requireFinite(samples, BrickGrid::kVolume, name);
        result->setRange(entry, rangeOfStored(samples, BrickGrid::kVolume));
      }
    }
  });
  result->setTable(std::move(table));
  return result;
}

}  // namespace nephele::detail

namespace nephele {

std::shared_ptr<BrickGrid> toBricks(const VoxelGrid<float>& grid, Beside beside) {
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
    blocks.box = {first - one, last - first + one * 3};
    requireHoldable("grid", blocks.box);
    blocks.codes.assign(blocks.box.size(), 0);
    for (std::size_t i = 0; i < grid.sampledBricks(); ++i)
      blocks.blocks.push_back(grid.samples(std::int32_t(i)));
    grid.forEachBrick([&](const Vec3i& brick, std::int32_t entry) {
      blocks.codes[blocks.box.numberOf(brick)] = entry + 1;
    });
  }
  return detail::gatherBricks(blocks, grid.lattice(), beside, "'grid'");
}

}  // namespace nephele

// A brick's borders are copies of its neighbours' samples, which a grid needs once it is sampled and not
// while it is made. So samples stay without them until they are packed: each brick is put together with its
// borders in a buffer, and only its codes are kept. Bricks are packed from below in z, and what lies more
// than a brick below those in work is given back, so that samples and codes never stand side by side.
#include "nephele/levelset/grid/brick_samples.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "nephele/levelset/grid/detail/brick_borders.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {

namespace {

constexpr auto kVolume = std::size_t(BrickGrid::kVolume);
constexpr std::size_t kBricksPerTask = 32;
/// Bricks along z that are packed before samples below them are given back.
constexpr int kGroup = 8;

/// Writes the kVolume samples of a brick with its borders to `stored`.
void withBorders(const BrickSamples& samples, const Vec3i& brick, float* stored) {
  for (const BorderPart& part : kBorderParts)
    copyPart(part, samples.pool[std::size_t(samples.table.at(brick + part.side))], kOwnStrides, 1.0f, stored);
}

}  // namespace

void BrickSamples::append(const std::vector<Vec3i>& bricks) {
  if (bricks.empty()) return;
  Store store{SampleStore(bricks.size() * kCount), bricks[0].z};
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    store.lastZ = std::max(store.lastZ, bricks[i].z);
    place(bricks[i], store.samples.data() + i * kCount, {});
  }
  stores.push_back(std::move(store));
}

void BrickSamples::appendShared(const Vec3i& brick, float* samples, const Interval& range) {
  place(brick, samples, range);
  areShared = true;
}

void BrickSamples::own(const std::vector<std::size_t>& bricks) {
  SampleStore store(bricks.size() * kCount);
  parallelFor(bricks.size(), kBricksPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      float* copy = store.data() + i * kCount;
      std::copy_n(pool[bricks[i]], kCount, copy);
      pool[bricks[i]] = copy;
    }
  });
  stores.push_back({std::move(store), std::numeric_limits<int>::max()});
}

void BrickSamples::place(const Vec3i& brick, float* samples, const Interval& range) {
  table[brick] = std::int32_t(pool.size());
  placed.push_back({std::int32_t(pool.size()), brick});
  pool.push_back(samples);
  ranges.push_back(range);
}

void BrickSamples::separate() {
  const std::size_t constants = pool.size() - placed.size();
  if (constants == 1) return;
  const std::vector<float*> sources = pool;
  const std::vector<Interval> sourceRanges = ranges;
  std::vector<Vec3i> bricks;
  std::vector<std::size_t> source;
  for (std::size_t i = 0; i < table.entries.size(); ++i) {
    const auto constant = std::size_t(table.entries[i]);
    if (constant == 0 || constant >= constants) continue;
    bricks.push_back(places().at(i));
    source.push_back(constant);
  }
  pool.erase(pool.begin() + 1, pool.begin() + std::ptrdiff_t(constants));
  ranges.erase(ranges.begin() + 1, ranges.begin() + std::ptrdiff_t(constants));
  for (PlacedBrick& brick : placed) {
    brick.pool -= std::int32_t(constants - 1);
    table[brick.brick] = brick.pool;
  }
  const std::size_t first = pool.size();
  append(bricks);
  for (std::size_t i = 0; i < source.size(); ++i) {
    std::copy_n(sources[source[i]], kCount, pool[first + i]);
    ranges[first + i] = sourceRanges[source[i]];
  }
}

std::uint32_t neighboursReadAround(int sample) {
  const auto along = [](int own) {
    constexpr int kLast = BrickGrid::kBrick - 1 - BrickGrid::kAfter;
    return std::uint32_t{2} | (own <= BrickGrid::kBefore ? 1u : 0u) | (own >= kLast ? 4u : 0u);
  };
  const std::uint32_t x = along(sample & 7), y = along(sample >> 3 & 7), z = along(sample >> 6);
  const std::uint32_t xy = ((y & 1) != 0 ? x : 0) | x << 3 | ((y & 4) != 0 ? x << 6 : 0);
  return ((z & 1) != 0 ? xy : 0) | xy << 9 | ((z & 4) != 0 ? xy << 18 : 0);
}

std::shared_ptr<PackedGrid> emptyPackedGrid(const BrickSamples& samples) {
  return std::make_shared<PackedGrid>(Lattice::uniform(samples.voxelSize), samples.places(),
                                      samples.background);
}

void appendPacked(PackedGrid& grid, BrickSamples samples, const std::vector<Packing>& packing) {
  std::vector<PlacedBrick> chosen;
  for (const PlacedBrick& brick : samples.placed)
    if (packing[std::size_t(brick.pool)] != Packing::leaveOut) chosen.push_back(brick);
  const auto groupOf = [&](const PlacedBrick& brick) {
    return (brick.brick.z - samples.places().first.z) / kGroup;
  };
  std::stable_sort(chosen.begin(), chosen.end(),
                   [&](const PlacedBrick& a, const PlacedBrick& b) { return groupOf(a) < groupOf(b); });
  const std::size_t start = grid.poolSize();
  grid.reserve(start + chosen.size());
  for (std::size_t first = 0; first < chosen.size();) {
    const int group = groupOf(chosen[first]);
    std::size_t last = first;
    while (last < chosen.size() && groupOf(chosen[last]) == group) ++last;
    grid.append(last - first);
    parallelFor(last - first, kBricksPerTask, [&](std::size_t begin, std::size_t end) {
      std::array<float, kVolume> stored;
      for (std::size_t i = first + begin; i < first + end; ++i) {
        const PlacedBrick& brick = chosen[i];
        withBorders(samples, brick.brick, stored.data());
        grid.encode(std::int32_t(start + i), samples.pool[std::size_t(brick.pool)],
                    rangeOfBrick(stored.data()), packing[std::size_t(brick.pool)] == Packing::absolute);
        grid.place(brick.brick, std::int32_t(start + i));
      }
    });
    // The next group reads one brick below its own.
    const int needed = samples.places().first.z + (group + 1) * kGroup - 1;
    for (BrickSamples::Store& store : samples.stores)
      if (store.lastZ < needed) store.samples = {};
    first = last;
  }
}

std::shared_ptr<PackedGrid> packed(BrickSamples samples) {
  std::shared_ptr<PackedGrid> grid = emptyPackedGrid(samples);
  // Constants keep their places; brick 0 is the background already.
  const std::size_t constants = samples.pool.size() - samples.placed.size();
  grid->append(constants - 1);
  for (std::size_t c = 1; c < constants; ++c) {
    const std::array<float, BrickSamples::kCount> none{};
    grid->encode(std::int32_t(c), none.data(), samples.ranges[c]);
  }
  for (std::size_t i = 0; i < samples.table.entries.size(); ++i)
    if (const std::int32_t pool = samples.table.entries[i]; pool > 0 && std::size_t(pool) < constants)
      grid->place(samples.places().at(i), pool);
  const std::vector<Packing> all(samples.pool.size(), Packing::whole);
  appendPacked(*grid, std::move(samples), all);
  return grid;
}

}  // namespace nephele::detail

// Grids that grow from seeds: a brick is evaluated, says whether it matters, and if it does its neighbours
// are asked next. One wave of bricks runs on all cores; what is asked next is decided between waves on one,
// so the order and the result are fixed. A flow takes a connected body to a connected one: a few seeds inside
// its image find all of it.
#include "nephele/levelset/grid/brick_growth.h"

#include <algorithm>
#include <cmath>

#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {
namespace {

constexpr int kBrick = BrickGrid::kBrick;
constexpr int kWidth = BrickGrid::kWidth;

template <class Body>
void forNeighbours(const Vec3i& brick, const Body& body) {
  for (int z = -1; z <= 1; ++z)
    for (int y = -1; y <= 1; ++y)
      for (int x = -1; x <= 1; ++x)
        if (x != 0 || y != 0 || z != 0) body(brick + Vec3i{x, y, z});
}

/// Where the samples of a brick come from along one axis, by the neighbour on that side (-1, 0, 1).
struct AxisPart {
  int target, source, count;
};
constexpr AxisPart kAxisParts[3] = {{0, kBrick - 1, 1}, {1, 0, kBrick}, {1 + kBrick, 0, 2}};

}  // namespace

BrickPoints::BrickPoints(const Lattice& lattice, const Vec3i& brick) {
  int i = 0;
  for (int k = 0; k < kBrick; ++k)
    for (int j = 0; j < kBrick; ++j)
      for (int l = 0; l < kBrick; ++l, ++i)
        set(i, lattice.indexToWorld(Vec3f(brick * kBrick + Vec3i{l, j, k})));
}

GrownBricks growBricks(const std::vector<Vec3i>& seeds, const GrowthOptions& options,
                       const EvaluateBrick& evaluate, const Progress& progress) {
  const std::size_t stride = std::size_t(options.components) * kOwnSamples;
  GrownBricks grown;
  grown.components = options.components;
  std::vector<Vec3i> bricks;
  std::vector<std::uint8_t> matters;
  BrickTable asked("advection");
  std::vector<Vec3i> wave;
  const auto ask = [&](const Vec3i& brick) {
    if (asked.at(brick) >= 0) return;
    asked.set(brick, std::int32_t(bricks.size() + wave.size()));
    wave.push_back(brick);
  };
  for (const Vec3i& seed : seeds) ask(seed);
  while (!wave.empty()) {
    const std::size_t start = bricks.size();
    bricks.insert(bricks.end(), wave.begin(), wave.end());
    wave.clear();
    matters.resize(bricks.size());
    grown.samples.resize(bricks.size() * stride);
    parallelFor(
        bricks.size() - start, 4,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t i = start + begin; i < start + end; ++i)
            matters[i] = std::uint8_t(evaluate(bricks[i], grown.samples.data() + i * stride));
        },
        progress);
    for (std::size_t i = start; i < bricks.size(); ++i)
      if (matters[i]) forNeighbours(bricks[i], ask);
  }

  // What is kept moves to the front, in the order in which it was asked; bricks that matter first.
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < bricks.size(); ++i)
    if (matters[i]) kept.push_back(i);
  grown.relevantCount = kept.size();
  if (options.withNeighbours)
    for (std::size_t i = 0; i < bricks.size(); ++i) {
      bool isBeside = false;
      if (!matters[i])
        forNeighbours(bricks[i], [&](const Vec3i& b) {
          const std::int32_t other = asked.at(b);
          isBeside |= other >= 0 && matters[std::size_t(other)] != 0;
        });
      if (isBeside) kept.push_back(i);
    }
  std::vector<float> samples(kept.size() * stride);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    grown.bricks.push_back(bricks[kept[i]]);
    std::copy_n(grown.samples.data() + kept[i] * stride, stride, samples.data() + i * stride);
  }
  grown.samples = std::move(samples);
  return grown;
}

std::vector<std::shared_ptr<BrickGrid>> assembleGrids(const GrownBricks& grown, const Lattice& lattice,
                                                      std::span<const float> backgrounds, Beyond beyond) {
  const std::size_t stride = std::size_t(grown.components) * kOwnSamples;
  std::vector<std::shared_ptr<BrickGrid>> grids;
  // With a background outside, bricks beside the grown ones blend towards it.
  std::vector<Vec3i> placed = grown.bricks;
  BrickTable numbers("advection");
  for (std::size_t i = 0; i < grown.bricks.size(); ++i) numbers.set(grown.bricks[i], std::int32_t(i));
  if (beyond == Beyond::background) {
    BrickTable beside("advection");
    for (const Vec3i& brick : grown.bricks)
      forNeighbours(brick, [&](const Vec3i& b) {
        if (numbers.at(b) >= 0 || beside.at(b) >= 0) return;
        beside.set(b, 0);
        placed.push_back(b);
      });
  }
  std::sort(placed.begin(), placed.end(), comesBefore);
  Vec3i first{}, last{-1, -1, -1};
  for (const Vec3i& b : placed) {
    first = &b == placed.data() ? b : min(first, b);
    last = &b == placed.data() ? b : max(last, b);
  }
  for (int c = 0; c < grown.components; ++c) {
    auto grid = std::make_shared<BrickGrid>(lattice, BrickBox{first, last - first + Vec3i{1, 1, 1}},
                                            backgrounds[std::size_t(c)]);
    const auto fill = [&](const Vec3i& brick, float* target) {
      const std::int32_t own = numbers.at(brick);
      bool isBackground = true;
      for (int k = 0; k < 27; ++k) {
        const Vec3i side{k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1};
        const AxisPart px = kAxisParts[side.x + 1], py = kAxisParts[side.y + 1], pz = kAxisParts[side.z + 1];
        const std::int32_t other = numbers.at(brick + side);
        const std::int32_t source = other >= 0 || beyond == Beyond::background ? other : own;
        const float* from =
            source >= 0 ? grown.samples.data() + std::size_t(source) * stride + std::size_t(c) * kOwnSamples
                        : nullptr;
        // A border that is not there repeats the nearest layer of the brick itself.
        const auto place = [&](const AxisPart& part, int direction, int i) {
          return other >= 0 || direction == 0 ? part.source + i : direction < 0 ? 0 : kBrick - 1;
        };
        for (int z = 0; z < pz.count; ++z)
          for (int y = 0; y < py.count; ++y)
            for (int x = 0; x < px.count; ++x) {
              const float value = from
                                      ? from[(place(pz, side.z, z) * kBrick + place(py, side.y, y)) * kBrick +
                                             place(px, side.x, x)]
                                      : grid->background();
              target[((z + pz.target) * kWidth + y + py.target) * kWidth + x + px.target] = value;
              isBackground &= value == grid->background();
            }
      }
      return !isBackground;
    };
    // Only bricks that hold something get a place; found first, so that no sample is ever moved.
    std::vector<std::int32_t> place(placed.size());
    parallelFor(placed.size(), 16, [&](std::size_t begin, std::size_t end) {
      std::array<float, BrickGrid::kVolume> samples;
      for (std::size_t i = begin; i < end; ++i)
        place[i] = beyond == Beyond::nearest || fill(placed[i], samples.data()) ? 1 : 0;
    });
    std::int32_t next = 1;
    for (std::int32_t& p : place)
      if (p > 0) p = next++;
    grid->append(std::size_t(next) - 1);
    parallelFor(placed.size(), 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        if (place[i] == 0) continue;
        float* samples = grid->brick(place[i]);
        fill(placed[i], samples);
        grid->setRange(place[i], rangeOfBrick(samples));
        grid->place(placed[i], place[i]);
      }
    });
    grids.push_back(std::move(grid));
  }
  return grids;
}

}  // namespace nephele::detail

// Grids that grow from seeds: a brick is evaluated, says whether it matters, and if it does its neighbours
// are asked next. One wave of bricks runs on all cores; what is asked next is decided between waves on one,
// so the order and the result are fixed. A flow takes a connected body to a connected one: a few seeds inside
// its image find all of it.
#include "nephele/levelset/grid/brick_growth.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "nephele/levelset/grid/detail/brick_borders.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {
namespace {

constexpr int kBrick = BrickGrid::kBrick;

template <class Body>
void forNeighbours(const Vec3i& brick, const Body& body) {
  for (int z = -1; z <= 1; ++z)
    for (int y = -1; y <= 1; ++y)
      for (int x = -1; x <= 1; ++x)
        if (x != 0 || y != 0 || z != 0) body(brick + Vec3i{x, y, z});
}

/// Stores the nearest layer, edge or corner of the brick's own samples in the place of a part that is not
/// there.
void repeatNearest(const BorderPart& part, const float* own, float* stored) {
  BorderPart nearest = part;
  SampleStrides strides = kOwnStrides;
  const auto clampAxis = [&](int axis, int& stride) {
    if (part.side[axis] == 0) return;
    nearest.source[axis] = 0;
    if (part.side[axis] > 0) own += (kBrick - 1) * stride;
    stride = 0;
  };
  clampAxis(0, strides.x);
  clampAxis(1, strides.y);
  clampAxis(2, strides.z);
  copyPart(nearest, own, strides, 1.0f, stored);
}

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
  GrownBricks grown(options.components);
  const BrickTable& numbers = grown.samples.table();
  // Of each number, the brick and whether it matters; the last ones are yet to be evaluated.
  std::vector<Vec3i> asked;
  std::vector<std::uint8_t> matters;
  const double perBrick = double(options.components) * (kBrickSamples + BrickGrid::kVolume) * sizeof(float);
  const auto ask = [&](const Vec3i& brick) {
    if (numbers.at(brick) >= 0) return;
    if (double(asked.size()) * perBrick > options.mostBytes)
      throw Error(fmt::format(
          "advection: matter spreads over more bricks than the memory limit leaves room for ({:.0f} MB); "
          "larger voxels, a coarser map or a smaller velocity need less",
          std::max(options.mostBytes, 0.0) / 1e6));
    grown.samples.add(brick);
    asked.push_back(brick);
  };
  for (const Vec3i& seed : seeds) ask(seed);
  while (matters.size() < asked.size()) {
    const std::size_t start = matters.size(), end = asked.size();
    matters.resize(end);
    parallelFor(
        end - start, 4,
        [&](std::size_t first, std::size_t last) {
          for (std::size_t i = start + first; i < start + last; ++i)
            matters[i] = std::uint8_t(evaluate(asked[i], grown.samples.samples(std::int32_t(i))));
        },
        progress);
    for (std::size_t i = start; i < end; ++i) {
      const Vec3i brick = asked[i];
      if (matters[i]) forNeighbours(brick, ask);
    }
  }

  const auto isBeside = [&](const Vec3i& brick) {
    bool is = false;
    forNeighbours(brick, [&](const Vec3i& b) {
      const std::int32_t other = numbers.at(b);
      is |= other >= 0 && matters[std::size_t(other)] != 0;
    });
    return is;
  };
  std::vector<Vec3i> beside, others;
  for (std::size_t i = 0; i < asked.size(); ++i) {
    const bool isKept = options.withNeighbours && !matters[i] && isBeside(asked[i]);
    (matters[i] ? grown.bricks : isKept ? beside : others).push_back(asked[i]);
  }
  grown.bricks.insert(grown.bricks.end(), beside.begin(), beside.end());
  for (const Vec3i& brick : others) grown.samples.table().set(brick, BrickTable::kNone);
  return grown;
}

std::vector<std::shared_ptr<BrickGrid>> assembleGrids(const GrownBricks& grown, const Lattice& lattice,
                                                      std::span<const float> backgrounds, Beyond beyond) {
  std::vector<std::shared_ptr<BrickGrid>> grids;
  // With a background outside, bricks beside the grown ones blend towards it.
  std::vector<Vec3i> placed = grown.bricks;
  if (beyond == Beyond::background) {
    BrickTable beside("advection");
    for (const Vec3i& brick : grown.bricks)
      forNeighbours(brick, [&](const Vec3i& b) {
        if (grown.samples.find(b) || beside.at(b) >= 0) return;
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
    const auto samplesOf = [&](const Vec3i& brick) -> const float* {
      const float* samples = grown.samples.find(brick);
      return samples ? samples + c * kBrickSamples : nullptr;
    };
    const auto fill = [&](const Vec3i& brick, float* target) {
      for (const BorderPart& part : kBorderParts) {
        if (const float* there = samplesOf(brick + part.side))
          copyPart(part, there, kOwnStrides, 1.0f, target);
        else if (beyond == Beyond::background)
          fillPart(part, grid->background(), target);
        else
          repeatNearest(part, samplesOf(brick), target);
      }
      return !std::all_of(target, target + BrickGrid::kVolume,
                          [&](float value) { return value == grid->background(); });
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

#pragma once

#include <algorithm>
#include <atomic>
#include <cstring>
#include <memory>
#include <numeric>
#include <random>
#include <vector>

#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/modeling/field/function_field.h"

namespace nephele::test {

/// A grid with a brick of its own at every position, whose samples are value(voxel).
template <class F>
std::shared_ptr<BrickGrid> denseGrid(const Vec3i& firstBrick, const Vec3i& brickCount, const F& value,
                                     const Affine& indexToWorld = {}, float background = 0.0f) {
  auto grid =
      std::make_shared<BrickGrid>(Lattice::of(indexToWorld), BrickBox{firstBrick, brickCount}, background);
  const int count = brickCount.x * brickCount.y * brickCount.z;
  std::vector<std::int32_t> table(grid->places().size());
  std::iota(table.begin(), table.end(), grid->append(table.size()));
  grid->setTable(std::move(table));
  for (int i = 0; i < count; ++i) {
    const Vec3i b = firstBrick + Vec3i{i % brickCount.x, i / brickCount.x % brickCount.y,
                                       i / (brickCount.x * brickCount.y)};
    for (int z = 0; z < 8; ++z)
      for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 8; ++x)
          grid->brick(i + 1)[sampleOffset(x, y, z)] =
              float(value(Vec3i{b.x * 8 + x, b.y * 8 + y, b.z * 8 + z}));
  }
  fillBorders(*grid);
  return grid;
}

/// Reproducible numbers that belong to a voxel, in [-1, 1].
inline float scatter(const Vec3i& v) {
  std::uint32_t h =
      std::uint32_t(v.x) * 73856093u ^ std::uint32_t(v.y) * 19349663u ^ std::uint32_t(v.z) * 83492791u;
  h = (h ^ h >> 13) * 0x5bd1e995u;
  return float((h ^ h >> 15) & 0xffff) / 32767.5f - 1.0f;
}

/// Small lattices of random samples, many of them 0 and next to each other.
inline std::shared_ptr<BrickGrid> randomLattice(std::uint32_t seed, int side) {
  std::mt19937 random(seed);
  const std::uint32_t kind = seed % 4;
  std::vector<float> values(std::size_t(side * side * side));
  for (float& v : values)
    v = kind == 0   ? float(random() % 3) - 1
        : kind == 1 ? float(random() % 2001) / 1000.0f - 1
        : kind == 2 ? (random() % 3 != 0 ? 1.0f : 0.0f)
                    : (float(random() % 5) - 2) / 2;
  return denseGrid(
      {-1, 0, 0}, {2, 2, 1},
      [&](const Vec3i& v) {
        const Vec3i at = v - Vec3i{-2, 5, 1};
        const bool isIn = std::min({at.x, at.y, at.z}) >= 0 && std::max({at.x, at.y, at.z}) < side;
        return isIn ? values[std::size_t((at.z * side + at.y) * side + at.x)] : -1.0f;
      },
      {}, -1.0f);
}

/// Whether two grids hold the same bricks in the same places, bit for bit.
inline bool sameGrid(const BrickGrid& a, const BrickGrid& b) {
  return a.firstBrick() == b.firstBrick() && a.brickCount() == b.brickCount() && a.table() == b.table() &&
         a.values().size() == b.values().size() &&
         std::memcmp(a.values().data(), b.values().data(), a.values().size() * sizeof(float)) == 0;
}

/// radius - |x - center| with its exact range, as a user's function that counts how often it is called.
inline ScalarField countedBall(const Vec3f& center, float radius, std::atomic<std::size_t>& calls) {
  FunctionOptions<float> options;
  options.range = [=](const Box& box) {
    double nearest = 0, farthest = 0;
    for (int a = 0; a < 3; ++a) {
      const double low = double(box.min[a]) - center[a], high = double(box.max[a]) - center[a];
      const double inside = low > 0 ? low : high < 0 ? -high : 0.0, outside = std::max(-low, high);
      nearest += inside * inside;
      farthest += outside * outside;
    }
    const float slack = 1e-5f * radius;
    return Interval{radius - float(std::sqrt(farthest)) - slack, radius - float(std::sqrt(nearest)) + slack};
  };
  return functionField(
      [&calls, center, radius](const Vec3f& p) {
        calls.fetch_add(1, std::memory_order_relaxed);
        return radius - length(p - center);
      },
      options);
}

inline ScalarField ball(const Vec3f& center, float radius) {
  static std::atomic<std::size_t> ignored;
  return countedBall(center, radius, ignored);
}

}  // namespace nephele::test

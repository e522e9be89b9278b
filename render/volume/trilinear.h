#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "nephele/levelset/grid/brick_box.h"
#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/modeling/base/math.h"

namespace nephele {

/// Between the eight nodes of a cell, node(x, y, z) with 0 or 1 along each axis; `share` of the cell lies in
/// front of the point, [0, 1] along each axis. The marching kernels do the same with vectors.
template <class Node>
float trilinear(const Vec3f& share, Node&& node) {
  const auto edge = [&](int y, int z) {
    const float first = node(0, y, z);
    return first + share.x * (node(1, y, z) - first);
  };
  const auto face = [&](int z) {
    const float first = edge(0, z);
    return first + share.y * (edge(1, z) - first);
  };
  const float first = face(0);
  return first + share.z * (face(1) - first);
}

/// The same of samples in memory: the first one of the cell is at `first`, the next along y `row` samples
/// behind it, along z `plane`.
inline float trilinear(const float* first, const Vec3f& share, int row, int plane) {
  return trilinear(share, [=](int x, int y, int z) { return first[z * plane + y * row + x]; });
}

/// Bricks on a lattice whose first brick is brick 0, each with kWidth^3 samples, kBefore of them in front of
/// its first cell along each axis.
template <int kWidth, int kBefore>
struct BrickSampler {
  static constexpr int kBrick = 8, kPlane = kWidth * kWidth;

  const float* values;
  const std::int32_t* table;
  Vec3i count;

  /// At `p` in cells; outside of the lattice as at its nearest face.
  float operator()(const Vec3f& p) const {
    Vec3i brick;
    Vec3f local;
    for (int axis = 0; axis != 3; ++axis) {
      brick[axis] = std::clamp(int(p[axis] * 0.125f), 0, count[axis] - 1);
      local[axis] = std::clamp(p[axis] - 8.0f * float(brick[axis]), 0.0f, 7.9999995f);
    }
    const Vec3i cell(local);
    return trilinear(firstOf(table[BrickBox{{}, count}.numberOf(brick)], cell), local - Vec3f(cell), kWidth,
                     kPlane);
  }

  /// The first sample of a cell of a pool brick.
  const float* firstOf(std::int32_t pool, const Vec3i& cell) const {
    return values + std::size_t(pool) * std::size_t(kPlane * kWidth) + (cell.z + kBefore) * kPlane +
           (cell.y + kBefore) * kWidth + cell.x + kBefore;
  }
};

/// Of a grid: its samples with their borders.
using GridSampler = BrickSampler<BrickGrid::kWidth, BrickGrid::kBefore>;

/// A grid at a place in index space, its background where it has no brick.
inline float sampleGrid(const BrickGrid& grid, const Vec3d& place) {
  if (!(std::fabs(place.x) < 1e8 && std::fabs(place.y) < 1e8 && std::fabs(place.z) < 1e8))
    return grid.background();
  const Vec3i cell{int(std::floor(place.x)), int(std::floor(place.y)), int(std::floor(place.z))};
  const Vec3f share{float(place.x - cell.x), float(place.y - cell.y), float(place.z - cell.z)};
  const std::int32_t pool = grid.poolIndex(brickOf(cell));
  if (grid.ranges()[std::size_t(pool)].isPoint()) return grid.ranges()[std::size_t(pool)].min;
  const float* first =
      grid.brick(pool) + sampleOffset(insideBrick(cell.x), insideBrick(cell.y), insideBrick(cell.z));
  return trilinear(first, share, BrickGrid::kWidth, BrickGrid::kWidth * BrickGrid::kWidth);
}

}  // namespace nephele

#pragma once

#include <cmath>
#include <cstdint>

#include "nephele/levelset/grid/sparse_bricks.h"
#include "nephele/modeling/base/math.h"

/// Dots as entries of the bricks that they touch.
namespace nephele::detail {

/// Entries (of splats in bricks) that are sorted at a time, on average.
inline constexpr double kEntriesOfBatch = double(1 << 20);

/// A dot at rest, or a part of the way of one that is smeared, in a brick that it touches.
struct Splat {
  Vec3f q;        ///< Index space, from the brick's first voxel; of a smeared dot, where the part begins.
  float density;  ///< Of each of its points.
  std::uint32_t dot;
  std::uint32_t number;  ///< In the order in which splats are added.
};

/// Voxels beyond the 8 nearest that a dot reaches on each side.
inline int reachOf(float radiusVoxels) {
  return radiusVoxels > 1 ? int(std::ceil(radiusVoxels)) - 1 : 0;
}

/// The bricks that a splat touches, both included.
struct BrickSpan {
  Vec3i first, last;

  template <class Body>
  void forEach(const Body& body) const {
    if (first == last) return body(first);
    for (int z = first.z; z <= last.z; ++z)
      for (int y = first.y; y <= last.y; ++y)
        for (int x = first.x; x <= last.x; ++x) body(Vec3i{x, y, z});
  }
};

/// Without a call of std::floor, which needs instructions that not every machine has.
template <class Real>
Vec3i floorOf(const Vec3<Real>& q) {
  const auto along = [](Real x) {
    const int whole = int(x);
    return whole - int(x < Real(whole));
  };
  return {along(q.x), along(q.y), along(q.z)};
}

inline BrickSpan bricksOf(const Vec3d& q, int reach) {
  const Vec3i low = floorOf(q), r{reach, reach, reach};
  return {brickOf(low - r), brickOf(low + r + Vec3i{1, 1, 1})};
}

}  // namespace nephele::detail

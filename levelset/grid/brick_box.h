#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "nephele/modeling/base/math.h"

namespace nephele {

/// Samples that a brick has of its own along each axis, and in all.
inline constexpr int kBrickSide = 8;
inline constexpr int kBrickSamples = kBrickSide * kBrickSide * kBrickSide;

/// A box of bricks, numbered as in the table of a grid: x fastest, then y, then z.
struct BrickBox {
  Vec3i first{}, count{};

  std::size_t size() const { return std::size_t(count.x) * std::size_t(count.y) * std::size_t(count.z); }
  bool covers(const Vec3i& brick) const {
    const Vec3i b = brick - first;
    return b.x >= 0 && b.y >= 0 && b.z >= 0 && b.x < count.x && b.y < count.y && b.z < count.z;
  }
  /// Of a brick that it covers.
  std::size_t numberOf(const Vec3i& brick) const {
    const Vec3i b = brick - first;
    return (std::size_t(b.z) * std::size_t(count.y) + std::size_t(b.y)) * std::size_t(count.x) +
           std::size_t(b.x);
  }
  /// The brick of a number less than size().
  Vec3i at(std::size_t number) const {
    const auto nx = std::size_t(count.x), ny = std::size_t(count.y);
    return first + Vec3i{int(number % nx), int(number / nx % ny), int(number / nx / ny)};
  }
};

/// Floored division of a voxel coordinate by the side of a brick, and what is left (0 to 7).
constexpr int brickOf(int voxel) {
  return voxel >> 3;
}
constexpr int insideBrick(int voxel) {
  return voxel & 7;
}
constexpr Vec3i brickOf(const Vec3i& voxel) {
  return {brickOf(voxel.x), brickOf(voxel.y), brickOf(voxel.z)};
}
constexpr Vec3i insideBrick(const Vec3i& voxel) {
  return {insideBrick(voxel.x), insideBrick(voxel.y), insideBrick(voxel.z)};
}

/// The order of the numbers of a box: z, then y, then x.
inline bool comesBefore(const Vec3i& a, const Vec3i& b) {
  return a.z != b.z ? a.z < b.z : a.y != b.y ? a.y < b.y : a.x < b.x;
}

}  // namespace nephele

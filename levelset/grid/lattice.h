#pragma once

#include <cmath>

#include "nephele/levelset/grid/brick_grid.h"

namespace nephele {

/// Where the voxels of a grid stand: voxel (i, j, k) at indexToWorld(i, j, k). May be turned or stretched.
struct Lattice {
  Affine indexToWorld;
  Affine worldToIndex;
  /// Edge of a voxel, world units.
  float voxelSize = 1.0f;
};

inline Lattice latticeOf(const BrickGrid& grid) {
  return {grid.indexToWorld, grid.worldToIndex, grid.voxelSize};
}

/// The lattice with voxels `factor` times as wide, > 0; voxel (0, 0, 0) stays.
inline Lattice coarser(const Lattice& lattice, float factor) {
  Affine indexToWorld = lattice.indexToWorld;
  for (float& m : indexToWorld.linear.m) m *= factor;
  return {indexToWorld, inverse(indexToWorld), std::cbrt(std::abs(determinant(indexToWorld.linear)))};
}

/// The brick of the lattice that `point` (world) lies in; far away where the point is not finite.
inline Vec3i brickAt(const Lattice& lattice, const Vec3f& point) {
  constexpr float kFar = 1e9f;
  const Vec3f q = lattice.worldToIndex(point);
  const auto along = [](float x) { return brickOf(x > -kFar && x < kFar ? int(std::floor(x)) : int(kFar)); };
  return {along(q.x), along(q.y), along(q.z)};
}

/// The order of a grid's table: z, then y, then x.
inline bool comesBefore(const Vec3i& a, const Vec3i& b) {
  return a.z != b.z ? a.z < b.z : a.y != b.y ? a.y < b.y : a.x < b.x;
}

}  // namespace nephele

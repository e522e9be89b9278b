#pragma once

#include <cmath>

#include "nephele/levelset/grid/brick_box.h"
#include "nephele/modeling/base/math.h"

namespace nephele {

/// Where the voxels of a grid stand: voxel (i, j, k) at indexToWorld(i, j, k). May be turned or stretched.
struct Lattice {
  Affine indexToWorld;
  Affine worldToIndex;
  /// Edge of a voxel, world units (cube root of the volume for maps that are not uniform).
  float voxelSize = 1.0f;

  /// Voxel (i, j, k) at (i, j, k) * voxelSize.
  static Lattice uniform(float voxelSize) {
    return {{Mat3f::scaling(voxelSize), {}}, {Mat3f::scaling(1.0f / voxelSize), {}}, voxelSize};
  }
  /// @throws Error if the map is singular.
  static Lattice of(const Affine& indexToWorld) {
    return {indexToWorld, inverse(indexToWorld), std::cbrt(std::abs(determinant(indexToWorld.linear)))};
  }
};

/// The brick around index coordinates; far away where they are not finite.
inline Vec3i brickAround(const Vec3f& q) {
  constexpr float kFar = 1e9f;
  const auto along = [](float x) { return brickOf(x > -kFar && x < kFar ? int(std::floor(x)) : int(kFar)); };
  return {along(q.x), along(q.y), along(q.z)};
}

/// The brick of the lattice that `point` (world) lies in; far away where the point is not finite.
inline Vec3i brickAt(const Lattice& lattice, const Vec3f& point) {
  return brickAround(lattice.worldToIndex(point));
}

/// The lattice with voxels `factor` times as wide, > 0; voxel (0, 0, 0) stays.
inline Lattice coarser(const Lattice& lattice, float factor) {
  Affine indexToWorld = lattice.indexToWorld;
  for (float& m : indexToWorld.linear.m) m *= factor;
  return Lattice::of(indexToWorld);
}

}  // namespace nephele

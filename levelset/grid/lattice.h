#pragma once

#include <cmath>

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

/// The lattice with voxels `factor` times as wide, > 0; voxel (0, 0, 0) stays.
inline Lattice coarser(const Lattice& lattice, float factor) {
  Affine indexToWorld = lattice.indexToWorld;
  for (float& m : indexToWorld.linear.m) m *= factor;
  return Lattice::of(indexToWorld);
}

}  // namespace nephele

#pragma once

#include <algorithm>
#include <vector>

#include "nephele/modeling/base/math.h"

namespace nephele::detail {

/// Cells that light is scattered in.
struct ScatteringLattice {
  Vec3i size;
  /// Voxels along a cell.
  int factor;
  /// Mean density of every cell, and what is left of the sun's beam where its density is, over 4 pi.
  std::vector<float> density, beam;

  ScatteringLattice(const Vec3i& n, int voxels)
      : size(n),
        factor(voxels),
        density(std::size_t(n.x) * std::size_t(n.y) * std::size_t(n.z)),
        beam(density.size()) {}
  std::size_t index(int x, int y, int z) const {
    return (std::size_t(z) * std::size_t(size.y) + std::size_t(y)) * std::size_t(size.x) + std::size_t(x);
  }
  /// Cells along the longest side.
  int longest() const { return std::max({size.x, size.y, size.z}); }
  /// From sums of density, and of density times beam, to means.
  void finish(float samplesPerCell);
};

/// Cells twice as wide.
ScatteringLattice halved(const ScatteringLattice& fine);

/// Values of `coarse` on the lattice that it is `halved` of, interpolated linearly.
std::vector<float> refined(const std::vector<float>& values, const ScatteringLattice& coarse,
                           const ScatteringLattice& fine);

/// Mean density that light meets where there is any.
float typicalDensity(const ScatteringLattice& lattice);

}  // namespace nephele::detail

#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "nephele/modeling/base/math.h"

namespace nephele::detail {

/// Cells that light is scattered in.
struct ScatteringLattice {
  /// Rows along x and y are whole vectors of this many cells.
  static constexpr int kRow = 8;

  Vec3i size;
  /// Voxels along a cell.
  int factor;
  /// Mean density of every cell, and the first source of light where its density is, see ScatteredLight.
  std::vector<float> density, beam;

  ScatteringLattice(const Vec3i& n, int voxels)
      : size{rounded(n.x), rounded(n.y), n.z},
        factor(voxels),
        density(std::size_t(size.x) * std::size_t(size.y) * std::size_t(size.z)),
        beam(density.size()) {}
  static constexpr int rounded(int n) { return (n + kRow - 1) / kRow * kRow; }
  std::size_t index(int x, int y, int z) const {
    return (std::size_t(z) * std::size_t(size.y) + std::size_t(y)) * std::size_t(size.x) + std::size_t(x);
  }
  /// Cells along the longest side.
  int longest() const { return std::max({size.x, size.y, size.z}); }
};

/// Cells twice as wide.
ScatteringLattice halved(const ScatteringLattice& fine);

/// Values of `coarse` on the lattice that it is `halved` of, interpolated linearly.
void refine(const float* values, const ScatteringLattice& coarse, const ScatteringLattice& fine, float* out);

/// Mean density that light meets where there is any.
float typicalDensity(const ScatteringLattice& lattice);

/// 1 for the cells at most `reach` cells from one that holds density along every axis, else 0.
std::vector<std::uint8_t> surroundings(const ScatteringLattice& lattice, int reach);

}  // namespace nephele::detail

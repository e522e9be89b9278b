#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "nephele/modeling/base/math.h"
#include "nephele/render/light/detail/cell_rows.h"

namespace nephele::detail {

/// Cells that light is scattered in.
struct ScatteringLattice {
  /// Along x and y whole vectors of CellRows.
  Vec3i size;
  /// Edge of a cell, in voxels.
  float voxels;
  /// Mean density of every cell, and the first source of light where its density is, see ScatteredLight.
  std::vector<float> density, beam;
  /// Where the centre of mass of its density is, from its middle, in cells.
  std::vector<Vec3f> centre;

  ScatteringLattice(const Vec3i& n, float edge)
      : size{rounded(n.x), rounded(n.y), n.z},
        voxels(edge),
        density(std::size_t(size.x) * std::size_t(size.y) * std::size_t(size.z)),
        beam(density.size()),
        centre(density.size()) {}
  static constexpr int rounded(int n) {
    return (n + CellRows::kVector - 1) / CellRows::kVector * CellRows::kVector;
  }
  std::size_t index(int x, int y, int z) const {
    return (std::size_t(z) * std::size_t(size.y) + std::size_t(y)) * std::size_t(size.x) + std::size_t(x);
  }
  /// Cells along the longest side.
  int longest() const { return std::max({size.x, size.y, size.z}); }
};

/// Cells twice as wide.
ScatteringLattice halved(const ScatteringLattice& fine);

/// Values of the cells of `coarse` for those of the lattice that it is `halved` of, interpolated linearly;
/// cells that are not kept count as 0. See CellRows::momentsAt.
/// Added to `out` if `adds`.
void refine(const float* values, const CellRows& coarse, const CellRows& fine, std::size_t moments,
            float* out, bool adds = false);

/// Mean density that light meets where there is any.
float typicalDensity(const ScatteringLattice& lattice);

/// 1 for the cells at most `reach` cells from one that holds density along every axis, else 0.
std::vector<std::uint8_t> surroundings(const ScatteringLattice& lattice, int reach);

}  // namespace nephele::detail

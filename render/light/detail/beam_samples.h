#pragma once

#include <algorithm>

#include "nephele/render/light/detail/scattering_lattice.h"
#include "nephele/render/light/scattered_light.h"
#include "nephele/render/volume/render_volume.h"

namespace nephele::detail {

/// Where the finest lattice of a volume lies: a brick of nothing around it.
struct LatticePlacement {
  Vec3i firstBrick, bricks;
  /// Cells along a brick, 1 to 8.
  int cellsPerBrick = 1;

  /// `longestSide`: about so many cells along the longest side, within a third of it where bricks allow.
  LatticePlacement(const RenderVolume& volume, int longestSide);
  float voxelsPerCell() const { return float(BrickGrid::kBrick) / float(cellsPerBrick); }
  ScatteringLattice lattice() const;
  /// Cells along the longest side, and all of them.
  int longest() const { return std::max({bricks.x, bricks.y, bricks.z}) * cellsPerBrick; }
  double cells() const;
  /// At most so many of them are kept by CellRows for what is within reach of density.
  double cellsNear(const RenderVolume& volume, int reach) const;
};

/// Sets the lattice's densities: means of what the march reads between the voxels.
void sampleDensity(const RenderVolume& volume, const LatticePlacement& place, ScatteringLattice& lattice);

/// Sets the beam: irradiance over 4 pi where the density is, and what is left of it behind `extinction`; or
/// what glows, per density.
void sampleBeam(const RenderVolume& volume, const LatticePlacement& place, const ScatteredSource& source,
                float extinction, ScatteringLattice& lattice);

}  // namespace nephele::detail

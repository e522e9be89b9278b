#pragma once

#include <algorithm>

#include "nephele/render/light/detail/scattering_lattice.h"
#include "nephele/render/light/scattered_light.h"
#include "nephele/render/volume/render_volume.h"

namespace nephele::detail {

/// Where the finest lattice of a volume lies: a brick of nothing around it.
struct LatticePlacement {
  Vec3i firstBrick, bricks;
  /// Cells along a brick, 1 to 8, while they are sampled; then so many times two and two become one.
  int cellsPerBrick = 1, halvings = 0;

  /// `longestSide`: about so many cells along the longest side, within a third of it where bricks allow.
  LatticePlacement(const RenderVolume& volume, int longestSide);
  float voxelsPerSampledCell() const { return float(BrickGrid::kBrick) / float(cellsPerBrick); }
  float voxelsPerCell() const { return voxelsPerSampledCell() * float(1 << halvings); }
  ScatteringLattice lattice() const;
  /// All that are sampled.
  double sampledCells() const;
  /// At most so many of these would be kept by CellRows for what is within reach of density.
  double sampledCellsNear(const RenderVolume& volume, int reach) const;
};

/// Behind so much nothing is left of a beam.
inline constexpr float kDarkDepth = 12;

/// Sets the lattice's densities: means of what the march reads between the voxels, of which those above
/// `most` count as that.
void sampleDensity(const RenderVolume& volume, const LatticePlacement& place, float most,
                   ScatteringLattice& lattice);

/// Sets the beam: irradiance over 4 pi where the density is, and what is left of it behind `extinction`; or
/// what glows, per density of the lattice. Densities above `most` count as that, but for what glows.
void sampleBeam(const RenderVolume& volume, const LatticePlacement& place, const ScatteredSource& source,
                float extinction, float most, ScatteringLattice& lattice);

}  // namespace nephele::detail

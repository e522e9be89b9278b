#pragma once

#include "nephele/render/light/detail/scattering_lattice.h"
#include "nephele/render/light/scattered_light.h"
#include "nephele/render/volume/render_volume.h"

namespace nephele::detail {

/// Where the finest lattice of a volume lies: a brick of nothing around it.
struct LatticePlacement {
  Vec3i firstBrick, bricks;
  /// Voxels along a cell: a power of 2, at most a brick.
  int factor = 1;

  LatticePlacement(const RenderVolume& volume, int longestSide);
  ScatteringLattice lattice() const;
};

/// Whether no sample lies before the first node of its brick, so that coded bricks do as well.
bool readsOwnNodes(const LatticePlacement& place);

/// Sets the lattice's densities: means of what the march reads between the voxels.
void sampleDensity(const RenderVolume& volume, const LatticePlacement& place, ScatteringLattice& lattice);

/// Sets the beam: irradiance over 4 pi where the density is, and what is left of it behind `extinction`; or
/// what glows, per density.
void sampleBeam(const RenderVolume& volume, const LatticePlacement& place, const ScatteredSource& source,
                float extinction, ScatteringLattice& lattice);

}  // namespace nephele::detail

#pragma once

#include <optional>
#include <span>

#include "nephele/levelset/cut/detail/solids/carve.h"
#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/modeling/base/progress.h"
#include "nephele/modeling/shape/knives.h"

namespace nephele::detail {

/// A knife of which the values at the samples of a lattice count.
struct LatticeKnife {
  Knife knife;
  /// Where a point is on the blade; if not given, its place on the axis plane that the blade looks at most.
  std::optional<PlaneFrame> frame{};
};

/// Parts the inside of a level set (> 0) by knives on its own lattice: every cell is six tetrahedra, in which
/// the level set and the knives are linear, but that vertices of a knife with nothing else near lie on the
/// knife itself. With a kerf, what is between the two sides of a knife belongs to
/// nobody.
///
/// Every part is a closed manifold, whatever the samples: all decisions are exact (`TetrahedronFacets`).
/// Samples of 0 count as outside, and for a knife as its negative side; so do values below 1/4096 of a voxel.
/// Where a surface is simple about such a sample it passes right through it; elsewhere it keeps that distance
/// from it, so that no two points on an edge are one. Parents of outer triangles are 0. The
/// same result at any number of threads. Cost: cells that the surface or a knife inside of it meets, and
/// bricks for the rest.
/// @throws Error if a sample near the surface is NaN, there are too many knives or triangles; Cancelled.
Carved carveLattice(const BrickGrid& level, std::span<const LatticeKnife> knives, float kerf,
                    const Progress& progress);

}  // namespace nephele::detail

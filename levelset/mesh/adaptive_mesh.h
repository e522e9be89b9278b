#pragma once

#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/modeling/base/mesh.h"

namespace nephele {

/// The surface that `marchingCubes` finds, by OpenVDB's dual mesher: quads and triangles, fewer and larger
/// where the surface is flat.
///
/// The inside is where values exceed `isovalue`. `adaptivity` goes from 0 (one vertex per cell) to 1.
/// Oriented outward. With adaptivity > 0, and on surfaces that the grid does not resolve, edges with more
/// than two faces are possible.
/// @throws Error if adaptivity is outside [0, 1], isovalue or a value is not finite.
Mesh adaptiveMesh(const BrickGrid& grid, double isovalue, double adaptivity);

}  // namespace nephele

#pragma once

#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/mesh.h"

namespace nephele {

/// The surface that `marchingCubes` finds, by OpenVDB's dual mesher: quads and triangles, fewer and larger
/// where the surface is flat.
///
/// `isovalue` has the sign of the library: for a level set it is the distance in world units by which the
/// surface moves inwards, so that `marchingCubes(*toBricks(grid), v)` and `adaptiveMesh(grid, v, a)` show one
/// surface; for other grids it is the value that the inside exceeds. `adaptivity` goes from 0 (one vertex per
/// cell) to 1. Oriented outward. With adaptivity > 0, and on surfaces that the grid does not resolve, edges
/// with more than two faces are possible.
/// @throws Error if adaptivity is outside [0, 1], isovalue is not finite or the grid does not hold floats.
Mesh adaptiveMesh(const VdbGrid& grid, double isovalue, double adaptivity);

}  // namespace nephele

#pragma once

#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/modeling/base/mesh.h"
#include "nephele/modeling/base/progress.h"

namespace nephele {

/// Triangles of the surface where `level` is 0, with each cell of the lattice cut into six tetrahedra and
/// linear values in these: what `cutIntoMeshes` of a level set calls the whole. Some three times as many
/// triangles as `marchingCubes`, and a surface that needs no tables.
///
/// A closed manifold facing outwards, whatever the samples; samples of 0, or below 1/4096 of a voxel,
/// count as outside. Vertices lie on edges of tetrahedra and keep away from the ends; but where the surface
/// is simple about a sample of 0, it passes through it. The same mesh at any number of threads.
/// @throws Error if the background is inside, a sample near the surface is NaN, or there are too many
/// triangles; Cancelled.
Mesh marchingTetrahedra(const BrickGrid& level, const Progress& progress = silent());

}  // namespace nephele

#pragma once

#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/modeling/base/mesh.h"
#include "nephele/modeling/base/progress.h"

namespace nephele {

/// Triangles of the surface where `grid` equals `isovalue`, oriented outward from higher to lower values
/// (from the inside of a shape, positive, to its outside): counter-clockwise seen from outside.
///
/// The result is a closed manifold that does not intersect itself, whatever the samples: every edge has two
/// triangles, every vertex one fan, also on noise. Where the inside reaches the end of the table, the
/// background outside closes it within one voxel; if the background itself is inside, the mesh bounds the
/// cavities and its volume is negative.
///
/// Vertices are shared. They lie on grid edges at the zero of the linear interpolation, but at least 1/4096
/// voxel from the ends of the edge, so that no two coincide and no triangle has zero area. (Cells whose
/// ambiguous faces are decided in different ways can need one vertex inside: none on smooth shapes, one
/// vertex in 70 on white noise.) Samples equal to the isovalue count as outside. A face of a
/// cell with two inside corners diagonal to each other joins them if the saddle of the bilinear interpolant
/// on the face is inside; both cells of a face decide alike.
///
/// Positions are computed in double precision, by indexToWorld. Cost and memory grow with the bricks that the
/// surface crosses; all cores; the same mesh at any thread count.
/// @throws Error if isovalue is not finite, samples near the surface are NaN, or the surface has more
/// than 1.4 billion triangles; Cancelled.
Mesh marchingCubes(const BrickGrid& grid, float isovalue = 0.0f, const Progress& progress = silent());

}  // namespace nephele

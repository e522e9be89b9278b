#pragma once

#include <cstdint>
#include <optional>

#include "nephele/modeling/base/mesh.h"
#include "nephele/modeling/base/progress.h"

namespace nephele {

struct DecimationOptions {
  /// Triangles to go down to, >= 1.
  std::optional<std::size_t> faces{};
  /// How far apart the old and the new surface may be, world units, > 0.
  std::optional<double> maxError{};
};

struct DecimatedMesh {
  Mesh mesh;
  /// The largest distance found between the surfaces, world units.
  double error = 0;
};

/// The mesh with fewer triangles: edges are collapsed, one end into the other, those first that move the
/// surface least, until there are `faces` triangles or the next collapse would move it by more than
/// `maxError`; at least one of the two must be given.
///
/// Closed manifolds stay closed manifolds of the same components and handles, and keep facing outward; no
/// triangle turns over. Vertices are some of the mesh's, bit for bit. So are attributes: those of vertices
/// follow them; edges across which corner attributes (`uv`) or groups differ are seams, as are borders. Seams
/// are only collapsed along themselves, their ends and crossings stay, and no triangle turns over in `uv`. So
/// there may be more triangles in the end than were asked for.
///
/// Distances are measured from all old vertices to the new surface, and from points on the new surface,
/// closer than old vertices are, to the old one. On surfaces that are rough from triangle to triangle they
/// may be up to a third more in between, of which `maxError` has an allowance for most.
/// Equal positions are merged, faces that repeat a corner left out. A mesh that has no more than
/// `faces` triangles is returned as it is if there is no `maxError`. The same result at any number of
/// threads. Cost: some 50 microseconds per triangle that goes.
/// @throws Error if neither option is given or one is out of its range, there are no faces, positions are not
/// finite, or the mesh is no manifold; Cancelled.
/// Source: Garland and Heckbert, Surface simplification using quadric error metrics, 1997 (which of a
/// vertex's edges); Klein et al., Mesh reduction with error control, 1996 (the order and the bound).
DecimatedMesh decimate(const Mesh& mesh, const DecimationOptions& options,
                       const Progress& progress = silent());

}  // namespace nephele

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "nephele/modeling/base/mesh.h"

// Pieces of the mesh repair that need no exact arithmetic. Not for other folders.
namespace nephele::detail {

/// Faces that hang together across edges.
struct MeshParts {
  std::size_t count = 0;
  std::vector<std::uint32_t> partOf;  ///< Per face.
  /// Faces to turn so that neighbours agree within each part; the side of the part's first face wins.
  std::vector<bool> turned;
  /// Parts that have no two sides, as a Moebius strip.
  std::size_t oneSided = 0;
};

/// The parts of a mesh whose equal positions are merged, joined across the edges with exactly two faces.
MeshParts findParts(const Mesh& mesh);

/// The parts of a closed mesh, joined across all edges. Nothing is turned: closed means that neighbours
/// agree.
MeshParts findClosedParts(const Mesh& mesh);

/// `mesh` with equal positions merged and unused ones left out. Vertex attributes of the first of equal
/// positions.
Mesh withMergedPositions(const Mesh& mesh);

/// The faces for which `kept` holds, those in `turned` reversed; attributes and groups follow. `turned` may
/// be empty.
Mesh selectFaces(const Mesh& mesh, const std::vector<bool>& kept, const std::vector<bool>& turned);

/// `triangles` without faces that repeat a corner.
Mesh withoutDegenerates(const Mesh& triangles);

/// `mesh` with every set of coincident faces reduced. Where the mesh is closed, faces that run opposite
/// ways cancel, so that walls inside a solid go and the mesh stays closed. Elsewhere one of the set stays if
/// its neighbours need it, that is, if most of its edges have an odd number of other faces.
Mesh withoutDuplicates(const Mesh& mesh);

/// Boundary vertices closer than `tolerance` to each other merged into the first of them.
Mesh withNearBoundaryMerged(const Mesh& triangles, double tolerance);

/// Which parts of a closed mesh to turn so that it bounds a solid: outermost parts outward, and cavities,
/// which are inward parts inside others, kept. A part inside another is turned with it.
std::vector<bool> partsToTurn(const Mesh& triangles, const MeshParts& parts);

}  // namespace nephele::detail

#pragma once

// Quadrics do not include the vectors that they need.
// clang-format off
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/Geometry/QuadricT.hh>
// clang-format on

#include "nephele/modeling/base/mesh.h"
#include "nephele/modeling/base/progress.h"

// OpenMesh as the half-edge structure of mesh processing. Not for other folders.
namespace nephele::detail {

struct HalfEdgeTraits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
  VertexAttributes(OpenMesh::Attributes::Status);
  EdgeAttributes(OpenMesh::Attributes::Status);
  FaceAttributes(OpenMesh::Attributes::Status);
  HalfedgeAttributes(OpenMesh::Attributes::PrevHalfedge);
};
using HalfEdgeMesh = OpenMesh::TriMesh_ArrayKernelT<HalfEdgeTraits>;

inline OpenMesh::Vec3d toPoint(const Vec3d& p) {
  return {p.x, p.y, p.z};
}
inline Vec3d toVec3d(const OpenMesh::Vec3d& p) {
  return {p[0], p[1], p[2]};
}

/// The triangles of `mesh` with corners at the first of equal positions; triangles that repeat a corner are
/// left out. Positions stay as they are, so that some are not used.
/// @throws Cancelled
Mesh weldedTriangles(const Mesh& mesh, const Progress& progress);

struct HalfEdgeOptions {
  /// Subtracted from the positions.
  Vec3d origin{};
  /// What asks; messages begin with it.
  const char* what = "";
};

/// The same vertices and faces in the same order.
/// @throws Error if the triangles are none that a half-edge structure can hold: an edge with more than two
/// faces, or two that run the same way, or a vertex with several fans; Cancelled.
HalfEdgeMesh halfEdgesOf(const Mesh& welded, const HalfEdgeOptions& options, const Progress& progress);

}  // namespace nephele::detail

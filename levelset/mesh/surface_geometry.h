#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "nephele/modeling/base/mesh.h"
#include "nephele/modeling/base/progress.h"

namespace nephele::detail {

/// The part of a triangle that is nearest to a point. Codes of nearest features are 8 * triangle + feature.
enum class Feature : std::int32_t { face, edgeAB, edgeBC, edgeCA, cornerA, cornerB, cornerC };

/// A triangle mesh whose nearest feature tells inside from outside.
///
/// The sign of (p - q) . N, q any point of the nearest feature and N its pseudo-normal, is that of the
/// distance: the face's normal, the sum of both at an edge, the angle-weighted sum at a corner (Baerentzen
/// and Aanaes, Signed distance computation using the angle weighted pseudonormal, 2005). Holds where sheets
/// of the mesh do not overlap.
struct SurfaceGeometry {
  const Mesh* mesh = nullptr;
  /// Outward pseudo-normals of each triangle's features, in the order of Feature; zero where degenerate.
  std::vector<std::array<Vec3f, 7>> normals;
  /// Every edge, bit-equal positions being one, has two faces of opposite direction. Without this no normals.
  bool manifold = false;
  /// Every edge has as many faces in one direction as in the other: the mesh bounds a solid.
  bool closed = false;

  std::size_t triangleCount() const { return mesh->faceCount(); }
  const Vec3d& corner(std::size_t triangle, int i) const {
    return mesh->positions[mesh->corners[3 * triangle + std::size_t(i)]];
  }
};

/// Linear in the size of the mesh, which must outlive the result and hold triangles only.
SurfaceGeometry surfaceGeometry(const Mesh& mesh);

}  // namespace nephele::detail

#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "nephele/levelset/mesh/nearest_on_mesh.h"

/// What attributes are carried from. Not part of the interface.
namespace nephele::detail {

/// Weights of the corners at the point of the triangle (a, b, c) that is nearest to `p`, wherever `p` is:
/// none negative, sum 1. Triangles without area count as their sides.
Vec3d nearestWeights(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c);

/// A triangle mesh with nearest points and smooth normals. It keeps its triangles, and is asked, relative to
/// the middle of its box, so that a shape far from the origin loses nothing.
class ReferenceSurface {
 public:
  /// Keeps no reference to `mesh`. @throws Error if it has no faces or positions that are not finite.
  explicit ReferenceSurface(const Mesh& mesh);

  struct Point {
    std::uint32_t triangle = 0;
    Vec3d weights{1, 0, 0};
    float distance = 0.0f;
  };
  /// The point nearest to `p`, which must be finite. The points within `radius` are tried first.
  Point nearest(const Vec3d& p, float radius = std::numeric_limits<float>::infinity()) const;

  const Vec3d& corner(std::size_t triangle, int i) const {
    return mesh_.positions[mesh_.corners[3 * triangle + std::size_t(i)]];
  }
  /// Relative to origin().
  Vec3d position(std::size_t triangle, const Vec3d& weights) const {
    return corner(triangle, 0) * weights.x + corner(triangle, 1) * weights.y +
           corner(triangle, 2) * weights.z;
  }
  /// Unit; angle-weighted at vertices, which equal positions share, and interpolated; that of the face where
  /// these cancel.
  Vec3d normal(const Point& at) const;

  /// The triangles, fans of the faces of the mesh, relative to origin().
  const Mesh& triangles() const { return mesh_; }
  const Vec3d& origin() const { return origin_; }
  const NearestOnMesh& tree() const { return *tree_; }

 private:
  Mesh mesh_;
  Vec3d origin_;
  std::vector<Vec3f> normals_;
  std::unique_ptr<NearestOnMesh> tree_;
};

}  // namespace nephele::detail

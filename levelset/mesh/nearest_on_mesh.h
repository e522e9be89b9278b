#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "nephele/modeling/base/mesh.h"
#include "nephele/modeling/base/progress.h"
#include "nephele/modeling/field/field.h"

namespace nephele {

/// Nearest points of a triangle mesh, exact up to float rounding relative to its size, by a bounding volume
/// hierarchy. Any soup of triangles fits. Safe to use from many threads.
class NearestOnMesh {
 public:
  /// Cost: n log n in the number of triangles; `progress` only cancels.
  /// @throws Error if the mesh has no faces or is not triangulated; Cancelled
  explicit NearestOnMesh(const Mesh& mesh, const Progress& progress = silent());
  ~NearestOnMesh();
  NearestOnMesh(const NearestOnMesh&) = delete;
  NearestOnMesh& operator=(const NearestOnMesh&) = delete;

  struct Hit {
    Vec3f point;
    float distance = 0.0f;
    std::uint32_t triangle = 0;
  };

  /// The nearest point within `radius` of `p`, or nothing. A tight radius makes the query much faster.
  std::optional<Hit> nearest(const Vec3f& p, float radius) const;

  /// The triangles within `radius` of `p`, in order; a few beyond may be among them. Nothing if there are
  /// more than `most`.
  std::optional<std::vector<std::uint32_t>> trianglesNear(const Vec3f& p, float radius,
                                                          std::size_t most) const;

  /// Box of the mesh.
  const Box& box() const { return box_; }

 private:
  struct Hierarchy;
  std::unique_ptr<Hierarchy> hierarchy_;
  Box box_;
};

/// The point of the mesh nearest to x: exact, without a grid. Where several are equally near, one of them.
/// NaN and infinite points give NaN. Cost: 0.5 to 2 microseconds per point.
/// @throws Error if the mesh has no faces or is not triangulated.
VectorField closestPoint(const Mesh& mesh);

}  // namespace nephele

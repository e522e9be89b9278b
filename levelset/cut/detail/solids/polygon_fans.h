#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "nephele/modeling/base/mesh.h"

namespace nephele::detail {

/// The polygons of a mesh that was made into triangles, so that those that are left whole can be put together
/// again.
class PolygonFans {
 public:
  /// For `triangulated(mesh)`.
  explicit PolygonFans(const Mesh& mesh);

  /// Whether there are polygons of more than three corners.
  bool any() const { return !fanOf_.empty(); }

  /// A face that is a whole triangle of the source, and which of its corners, as a corner of its mesh, is the
  /// first one there.
  struct Whole {
    std::uint32_t triangle = kNone, firstCorner = 0;
    static constexpr std::uint32_t kNone = ~0u;
  };

  /// Makes polygons of all faces of `mesh`, which are triangles, that make up one: where each of its
  /// triangles is there and they share their vertices. A polygon stands where the first of them stood;
  /// attributes and groups follow. `wholes`: by faces. Returns how many faces now stand before each, and in
  /// the end all.
  std::vector<std::uint32_t> join(Mesh& mesh, std::span<const Whole> wholes) const;

 private:
  /// By triangle: its polygon. By polygon, and at the end: its first triangle.
  std::vector<std::uint32_t> fanOf_, start_;
};

}  // namespace nephele::detail

// Cutting in builds without CGAL: refused in words.
#include "nephele/levelset/cut/detail/solids/cap_triangles.h"
#include "nephele/levelset/cut/detail/solids/surface_arrangement.h"
#include "nephele/modeling/base/error.h"

namespace nephele::detail {

std::optional<std::vector<std::array<std::uint32_t, 3>>> delaunayTriangles(
    std::span<const PlanePoint>, std::span<const std::array<std::uint32_t, 2>>) {
  throw Error("meshes cannot be cut: this nephele was built without CGAL");
}

Arrangement arrange(const Surfaces&, const Progress&) {
  throw Error("meshes cannot be cut: this nephele was built without CGAL");
}

}  // namespace nephele::detail

// Repair in builds without CGAL: what needs it is refused in words.
#include "nephele/levelset/mesh/detail/mesh_holes.h"
#include "nephele/levelset/mesh/detail/mesh_wrap.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/modeling/base/error.h"

namespace nephele {

namespace detail {

FilledMesh withHolesFilled(const Mesh&, const Progress&) {
  throw Error("the mesh is open, and its holes cannot be filled: this nephele was built without CGAL");
}

Mesh wrapped(const Mesh&, double, double, const Progress&) {
  throw Error("meshes cannot be wrapped: this nephele was built without CGAL");
}

}  // namespace detail

std::optional<std::size_t> countSelfIntersections(const Mesh&, double) {
  return std::nullopt;
}

}  // namespace nephele

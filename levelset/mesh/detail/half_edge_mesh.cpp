#include "nephele/levelset/mesh/detail/half_edge_mesh.h"

#include <fmt/format.h>

#include "nephele/levelset/mesh/detail/mesh_parts.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/modeling/base/error.h"

namespace nephele::detail {
namespace {

// Faces between two looks at whether all is cancelled: some ten milliseconds.
constexpr std::size_t kFacesUnheard = 1 << 16;

std::string plural(std::size_t count, const char* things) {
  return fmt::format("{} {}{}", count, things, count == 1 ? "" : "s");
}

// OpenMesh would leave such faces out, or never reach them again.
void requireManifold(const Mesh& mesh, const char* what, const Progress& progress) {
  const MeshDiagnosis is = diagnose(mesh, progress);
  std::string reasons;
  const auto add = [&](std::size_t count, const char* things, const char* which) {
    if (count > 0)
      reasons += fmt::format("{}{} {}", reasons.empty() ? "" : ", ", plural(count, things), which);
  };
  add(is.nonManifoldEdges, "edge", "with more than two faces");
  add(is.misorientedEdges, "edge", "between faces of opposite orientation");
  if (is.nonManifoldVertices > 0)
    reasons += fmt::format("{}{} {} where several fans of faces meet", reasons.empty() ? "" : ", ",
                           is.nonManifoldVertices, is.nonManifoldVertices == 1 ? "vertex" : "vertices");
  require(reasons.empty(),
          fmt::format("{}: the mesh is no manifold: {}; repair it first, a level set of it will do", what,
                      reasons));
}

}  // namespace

Mesh weldedTriangles(const Mesh& mesh, const Progress& progress) {
  progress.check();
  Mesh welded = triangulated(mesh);
  progress.check();
  const std::vector<std::uint32_t> first = firstEqualPosition(welded.positions);
  for (std::uint32_t& corner : welded.corners) corner = first[corner];
  progress.check();
  return withoutDegenerates(welded);
}

HalfEdgeMesh halfEdgesOf(const Mesh& welded, const HalfEdgeOptions& options, const Progress& progress) {
  requireManifold(welded, options.what, progress);
  HalfEdgeMesh result;
  result.reserve(welded.positions.size(), welded.corners.size() / 2, welded.faceCount());
  for (const Vec3d& p : welded.positions) result.add_vertex(toPoint(p - options.origin));
  progress.check();
  for (std::size_t f = 0; f < welded.faceCount(); ++f) {
    if (f % kFacesUnheard == 0) progress.check();
    const auto face = welded.face(f);
    const auto at = [&](std::size_t k) { return result.vertex_handle(face[k]); };
    require(result.add_face(at(0), at(1), at(2)).is_valid(),
            fmt::format("{}: face {} does not fit the faces beside it", options.what, f));
  }
  return result;
}

}  // namespace nephele::detail

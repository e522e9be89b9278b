// Loop subdivision on OpenMesh's edges.
//
// OpenMesh's own subdivider carries no attributes and knows no vertex with more than 49 neighbours, so its
// rules are here; the half-edges are OpenMesh's.
#include "nephele/levelset/mesh/subdivision.h"

#include <fmt/format.h>

#include <cmath>

#include "nephele/levelset/mesh/detail/half_edge_mesh.h"
#include "nephele/modeling/base/error.h"

namespace nephele {
namespace {

using detail::HalfEdgeMesh;
using Point = OpenMesh::Vec3d;

// The share of the neighbours in a vertex that has `count` of them.
double shareOfNeighbours(unsigned count) {
  const double t = 3 + 2 * std::cos(2 * M_PI / double(count));
  return (40 - t * t) / 64;
}

Point movedVertex(const HalfEdgeMesh& mesh, HalfEdgeMesh::VertexHandle v) {
  const Point& p = mesh.point(v);
  if (mesh.is_isolated(v)) return p;
  if (mesh.is_boundary(v)) {
    // The outgoing half-edge of a border vertex is on the border.
    const auto out = mesh.halfedge_handle(v);
    return p * 0.75 + (mesh.point(mesh.to_vertex_handle(out)) +
                       mesh.point(mesh.from_vertex_handle(mesh.prev_halfedge_handle(out)))) *
                          0.125;
  }
  Point sum(0, 0, 0);
  for (const auto w : mesh.vv_range(v)) sum += mesh.point(w);
  const unsigned count = mesh.valence(v);
  const double share = shareOfNeighbours(count);
  return p * (1 - share) + sum * (share / count);
}

Point edgePoint(const HalfEdgeMesh& mesh, HalfEdgeMesh::EdgeHandle e) {
  const auto h = mesh.halfedge_handle(e, 0), o = mesh.halfedge_handle(e, 1);
  const Point ends = mesh.point(mesh.to_vertex_handle(h)) + mesh.point(mesh.to_vertex_handle(o));
  if (mesh.is_boundary(e)) return ends * 0.5;
  const Point across = mesh.point(mesh.to_vertex_handle(mesh.next_halfedge_handle(h))) +
                       mesh.point(mesh.to_vertex_handle(mesh.next_halfedge_handle(o)));
  return ends * 0.375 + across * 0.125;
}

// Corners of the four triangles in one with the corners 0 1 2, between which edges have the points 3 (0 1),
// 4 (1 2) and 5 (2 0).
constexpr std::size_t kParts[4][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}};
constexpr std::size_t kEnds[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};

MeshAttribute ofCorners(const MeshAttribute& a, std::size_t faceCount) {
  MeshAttribute result{a.name, a.domain, a.width, {}};
  const auto width = std::size_t(a.width);
  result.values.reserve(4 * a.values.size());
  for (std::size_t f = 0; f < faceCount; ++f)
    for (const auto& part : kParts)
      for (const std::size_t corner : part)
        for (std::size_t k = 0; k < width; ++k) {
          const float x = a.values[(3 * f + kEnds[corner][0]) * width + k];
          const float y = a.values[(3 * f + kEnds[corner][1]) * width + k];
          result.values.push_back(kEnds[corner][0] == kEnds[corner][1] ? x : 0.5f * (x + y));
        }
  return result;
}

MeshAttribute ofVertices(const MeshAttribute& a, const HalfEdgeMesh& mesh) {
  MeshAttribute result = a;
  const auto width = std::size_t(a.width);
  for (const auto e : mesh.edges()) {
    const auto h = mesh.halfedge_handle(e, 0);
    const auto x = std::size_t(mesh.from_vertex_handle(h).idx()) * width;
    const auto y = std::size_t(mesh.to_vertex_handle(h).idx()) * width;
    for (std::size_t k = 0; k < width; ++k)
      result.values.push_back(0.5f * (a.values[x + k] + a.values[y + k]));
  }
  return result;
}

Mesh subdividedOnce(const Mesh& mesh, const Progress& progress) {
  const Vec3d origin = mesh.positions[mesh.corners[0]];
  const HalfEdgeMesh half = detail::halfEdgesOf(mesh, {origin, "subdivision"}, progress);
  progress.check();
  Mesh result;
  result.positions.reserve(half.n_vertices() + half.n_edges());
  for (const auto v : half.vertices())
    result.positions.push_back(detail::toVec3d(movedVertex(half, v)) + origin);
  for (const auto e : half.edges()) result.positions.push_back(detail::toVec3d(edgePoint(half, e)) + origin);
  progress.check();
  result.corners.reserve(4 * mesh.corners.size());
  result.faceStart.reserve(4 * mesh.faceCount() + 1);
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
    const auto face = mesh.face(f);
    std::uint32_t point[6] = {face[0], face[1], face[2]};
    for (const auto h : half.fh_range(half.face_handle(unsigned(f)))) {
      const auto from = std::uint32_t(half.from_vertex_handle(h).idx());
      const std::size_t k = from == face[0] ? 0 : from == face[1] ? 1 : 2;
      point[3 + k] = std::uint32_t(half.n_vertices() + std::size_t(half.edge_handle(h).idx()));
    }
    for (const auto& part : kParts)
      result.addFace(std::array<std::uint32_t, 3>{point[part[0]], point[part[1]], point[part[2]]});
  }
  for (const MeshAttribute& a : mesh.attributes) {
    progress.check();
    result.attributes.push_back(a.domain == MeshAttribute::Domain::corner ? ofCorners(a, mesh.faceCount())
                                                                          : ofVertices(a, half));
  }
  result.groups = mesh.groups;
  for (MeshGroup& group : result.groups) {
    group.firstFace *= 4;
    group.faceCount *= 4;
  }
  result.materialFiles = mesh.materialFiles;
  return result;
}

}  // namespace

double estimateSubdivisionBytes(const Mesh& mesh, int times) {
  // Measured: the half-edges of the last cage but one, and the result with its attributes.
  constexpr double kTriangle = 300;
  return kTriangle * (double(mesh.corners.size()) - 2 * double(mesh.faceCount())) * std::pow(4.0, times);
}

Mesh subdivided(const Mesh& mesh, int times, const Progress& progress) {
  require(times >= 0, fmt::format("subdivision: it can be done 0 times or more, got {}", times));
  requireValid(mesh);
  if (times == 0) return mesh;
  Mesh result = detail::weldedTriangles(mesh, progress);
  require(result.faceCount() > 0, "subdivision: the mesh has no faces");
  const double corners = double(result.corners.size()) * std::pow(4.0, times);
  require(corners < double(1u << 31),
          fmt::format("subdivision: {} triangles, {} times split in four, are too many", result.faceCount(),
                      times));
  progress.begin("subdivide");
  for (int i = 0; i < times; ++i) {
    progress.check();
    result = subdividedOnce(result, progress);
    progress.advance(std::pow(4.0, i + 1 - times));
  }
  return result;
}

}  // namespace nephele

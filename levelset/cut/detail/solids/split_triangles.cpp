#include "nephele/levelset/cut/detail/solids/split_triangles.h"

#include <CGAL/Exact_predicates_exact_constructions_kernel.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "nephele/levelset/cut/detail/solids/cap_triangles.h"
#include "nephele/levelset/cut/detail/solids/constrained_delaunay.h"

namespace nephele::detail {
namespace {

using ExactKernel = CGAL::Exact_predicates_exact_constructions_kernel;

std::optional<std::vector<TriangleIndices>> exactTriangles(const MeetingPoints& points,
                                                           const std::vector<std::uint32_t>& vertices,
                                                           const std::vector<PointPair>& edges,
                                                           FlatAxis axis) {
  // Sheared, so that the corners of a rectangle are not on one circle.
  const MeetingPoints::Rational along(5, 16), across(-1, 8);
  std::vector<ExactKernel::Point_2> flat;
  for (const std::uint32_t vertex : vertices) {
    const auto p = points.exactPosition(vertex);
    const auto &u = p[std::size_t(firstCoordinate(axis))], &v = p[std::size_t(secondCoordinate(axis))];
    flat.emplace_back(ExactKernel::FT(u + along * v), ExactKernel::FT(v + across * u));
  }
  return constrainedDelaunay<ExactKernel>(flat, edges);
}

}  // namespace

std::vector<TriangleIndices> splitTriangles(const MeetingPoints& points, FlatAxis axis, bool isFlipped,
                                            bool isExact, const std::vector<std::uint32_t>& outline,
                                            std::span<const PointPair> segments) {
  std::vector<std::uint32_t> vertices = outline;
  for (const PointPair& edge : segments) vertices.insert(vertices.end(), edge.begin(), edge.end());
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  const auto local = [&](std::uint32_t v) {
    return std::uint32_t(std::lower_bound(vertices.begin(), vertices.end(), v) - vertices.begin());
  };
  std::vector<PointPair> edges;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const std::uint32_t a = local(outline[i]), b = local(outline[(i + 1) % outline.size()]);
    edges.push_back(isFlipped ? PointPair{b, a} : PointPair{a, b});
  }
  for (const PointPair& edge : segments) {
    edges.push_back({local(edge[0]), local(edge[1])});
    edges.push_back({local(edge[1]), local(edge[0])});
  }
  const int u = firstCoordinate(axis), v = secondCoordinate(axis);
  std::optional<std::vector<TriangleIndices>> triangles;
  if (!isExact) {
    std::vector<PlanePoint> flat;
    for (const std::uint32_t vertex : vertices)
      flat.push_back({points.position(vertex)[u], points.position(vertex)[v]});
    triangles = delaunayTriangles(flat, edges);
  }
  if (!triangles) triangles = exactTriangles(points, vertices, edges, axis);
  if (!triangles) return trianglesWithoutArea(outline);
  for (TriangleIndices& corners : *triangles) {
    corners = {vertices[corners[0]], vertices[corners[1]], vertices[corners[2]]};
    if (isFlipped) std::swap(corners[1], corners[2]);
  }
  return std::move(*triangles);
}

std::vector<TriangleIndices> trianglesWithoutArea(const std::vector<std::uint32_t>& outline) {
  std::vector<TriangleIndices> triangles;
  std::vector<std::uint32_t> path;
  for (std::size_t i = 0; i <= outline.size(); ++i) {
    const std::uint32_t v = outline[i % outline.size()];
    const auto before = std::find(path.begin(), path.end(), v);
    if (before != path.end()) {
      for (auto k = before + 1; k + 1 < path.end(); ++k) triangles.push_back({v, *k, *(k + 1)});
      path.erase(before, path.end());
    }
    path.push_back(v);
  }
  return triangles;
}

}  // namespace nephele::detail

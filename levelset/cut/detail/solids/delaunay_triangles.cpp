// Triangles of flat regions: CGAL's constrained Delaunay triangulation with exact predicates. The region is
// found by a flood from outside that counts the directed edges it crosses.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include "nephele/levelset/cut/detail/solids/cap_triangles.h"
#include "nephele/levelset/cut/detail/solids/constrained_delaunay.h"

namespace nephele::detail {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

std::optional<std::vector<std::array<std::uint32_t, 3>>> delaunayTriangles(
    std::span<const PlanePoint> points, std::span<const std::array<std::uint32_t, 2>> edges) {
  std::vector<Kernel::Point_2> places;
  places.reserve(points.size());
  for (const PlanePoint& p : points) places.emplace_back(p[0], p[1]);
  return constrainedDelaunay<Kernel>(places, edges);
}

}  // namespace nephele::detail

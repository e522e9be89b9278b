// Alpha wrapping of a triangle soup.
//
// Portaneri, Rouxel-Labbe, Hemmer, Cohen-Steiner and Alliez, "Alpha Wrapping with an Offset" (ACM TOG 2022),
// as CGAL implements it: a Delaunay triangulation is carved from outside while empty balls of radius alpha
// pass, and refined against the offset surface. The result encloses the soup strictly, so thin sheets become
// shells of twice the offset and hollows behind small openings are filled. Here in its own file because it
// takes long to compile.
#include "nephele/levelset/mesh/detail/mesh_wrap.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/alpha_wrap_3.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "nephele/modeling/base/error.h"

namespace nephele::detail {
namespace {

/// Tells progress while the triangulation is carved, and ends it where it is cancelled.
struct WrapVisitor : CGAL::Alpha_wraps_3::internal::Wrapping_default_visitor {
  WrapVisitor(const Progress& told, double points) : progress(told), expected(points) {}

  template <class Wrapper, class Gate>
  void before_facet_treatment(const Wrapper&, const Gate&) {
    if (++facets % 256 == 0) progress.check();
  }
  template <class Wrapper, class Point>
  void before_Steiner_point_insertion(const Wrapper&, const Point&) {
    if (++inserted % 256 == 0) progress.advance(std::min(0.99, double(inserted) / expected));
  }

  const Progress& progress;
  double expected;
  std::size_t facets = 0, inserted = 0;
};

}  // namespace

Mesh wrapped(const Mesh& triangles, double alpha, double offset, const Progress& progress) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Point = Kernel::Point_3;
  // Coordinates that differ by far less than anything that is wrapped make tetrahedra so flat that the
  // centres of their spheres are beyond a double, at which exact arithmetic ends the process.
  const double quantum = std::ldexp(1.0, std::ilogb(offset) - 30);
  const auto rounded = [=](double x) { return std::nearbyint(x / quantum) * quantum; };
  std::vector<Point> points;
  for (const Vec3d& p : triangles.positions) points.emplace_back(rounded(p.x), rounded(p.y), rounded(p.z));
  std::vector<std::array<std::size_t, 3>> faces;
  for (std::size_t f = 0; f < triangles.faceCount(); ++f) {
    const auto face = triangles.face(f);
    // The wrap's own test for triangles without area prints; leave them out first.
    if (!CGAL::collinear(points[face[0]], points[face[1]], points[face[2]]))
      faces.push_back({face[0], face[1], face[2]});
  }
  require(!faces.empty(), "mesh repair: every triangle is degenerate, there is nothing to wrap");

  // Measured on closed surfaces, which have one side; sheets have two.
  constexpr double kPointsPerSquare = 1;
  WrapVisitor visitor(progress, kPointsPerSquare * surfaceArea(triangles) / (alpha * alpha) + 1);
  CGAL::Surface_mesh<Point> wrap;
  try {
    CGAL::alpha_wrap_3(points, faces, alpha, offset, wrap, CGAL::parameters::default_values(),
                       CGAL::parameters::visitor(std::ref(visitor)));
  } catch (const Cancelled&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception&) {
    throw Error(
        "mesh repair: the mesh could not be wrapped: its triangles are too fine for their coordinates");
  }
  Mesh result;
  for (const auto vertex : wrap.vertices()) {
    const Point& p = wrap.point(vertex);
    result.positions.emplace_back(p.x(), p.y(), p.z());
  }
  for (const auto face : wrap.faces()) {
    std::vector<std::uint32_t> corners;
    for (const auto vertex : wrap.vertices_around_face(wrap.halfedge(face)))
      corners.push_back(static_cast<std::uint32_t>(vertex.idx()));
    result.addFace(corners);
  }
  return result;
}

}  // namespace nephele::detail

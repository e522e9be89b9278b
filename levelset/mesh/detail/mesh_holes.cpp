// Closing an open triangle soup.
//
// CGAL's polygon soup functions give neighbouring faces one orientation and split vertices at edges and
// points that no manifold can hold; borders that lie on each other are stitched again. Each remaining
// boundary loop is then triangulated so that the sum of area and bending is least (Liepa, "Filling Holes in
// Meshes", 2003), with a search restricted to the loop's Delaunay triangulation and, where that has no
// answer, over all triangulations. Loops too long for the second search are first tried as flat ones, and may
// stay open.
#include "nephele/levelset/mesh/detail/mesh_holes.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/border.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/stitch_borders.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/Surface_mesh.h>

#include <array>
#include <functional>
#include <iterator>
#include <vector>

namespace nephele::detail {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Surface = CGAL::Surface_mesh<Point>;

// The unrestricted search takes cubic time.
constexpr std::size_t kLongestSearchedLoop = 400;

std::vector<Surface::Halfedge_index> boundaryLoop(const Surface& surface, Surface::Halfedge_index start) {
  std::vector<Surface::Halfedge_index> loop;
  for (const auto h : CGAL::halfedges_around_face(start, surface)) loop.push_back(h);
  return loop;
}

/// Ends a search that is cancelled.
struct HoleVisitor : pmp::Hole_filling::Default_visitor {
  explicit HoleVisitor(const Progress& told) : progress(told) {}

  void quadratic_step() const { progress.check(); }
  void cubic_step() const { progress.check(); }

  const Progress& progress;
};

bool fill(Surface& surface, Surface::Halfedge_index border, std::size_t length, const Progress& progress) {
  HoleVisitor visitor(progress);
  const bool isLong = length > kLongestSearchedLoop;
  for (const bool delaunay : {true, false}) {
    if (!delaunay && isLong) return false;
    std::vector<Surface::Face_index> patch;
    pmp::triangulate_hole(surface, border, std::back_inserter(patch),
                          CGAL::parameters::use_delaunay_triangulation(delaunay)
                              .use_2d_constrained_delaunay_triangulation(isLong)
                              .do_not_use_cubic_algorithm(isLong)
                              .visitor(std::ref(visitor)));
    if (!patch.empty()) return true;
  }
  return false;
}

}  // namespace

FilledMesh withHolesFilled(const Mesh& triangles, const Progress& progress) {
  std::vector<Point> points;
  for (const Vec3d& p : triangles.positions) points.emplace_back(p.x, p.y, p.z);
  std::vector<std::array<std::size_t, 3>> faces;
  for (std::size_t f = 0; f < triangles.faceCount(); ++f) {
    const auto face = triangles.face(f);
    faces.push_back({face[0], face[1], face[2]});
  }
  pmp::orient_polygon_soup(points, faces);
  Surface surface;
  pmp::polygon_soup_to_polygon_mesh(points, faces, surface);
  pmp::stitch_borders(surface);

  FilledMesh result;
  result.firstNewFace = surface.number_of_faces();
  std::vector<Surface::Halfedge_index> loops;
  pmp::extract_boundary_cycles(surface, std::back_inserter(loops));
  std::vector<Surface::Face_index> openFaces;
  for (const auto border : loops) {
    const std::size_t length = boundaryLoop(surface, border).size();
    progress.check();
    if (fill(surface, border, length, progress)) {
      ++result.holes;
      result.edges += length;
    } else {
      openFaces.push_back(surface.face(surface.opposite(border)));
    }
  }

  // Stitching removes vertices, so indices have gaps.
  std::vector<std::uint32_t> vertexNumber(surface.number_of_vertices() +
                                          surface.number_of_removed_vertices());
  for (const auto vertex : surface.vertices()) {
    vertexNumber[vertex.idx()] = static_cast<std::uint32_t>(result.mesh.positions.size());
    const Point& p = surface.point(vertex);
    result.mesh.positions.emplace_back(p.x(), p.y(), p.z());
  }
  for (const auto face : surface.faces()) {
    std::vector<std::uint32_t> corners;
    for (const auto vertex : surface.vertices_around_face(surface.halfedge(face)))
      corners.push_back(vertexNumber[vertex.idx()]);
    result.mesh.addFace(corners);
  }
  for (const auto face : openFaces) result.openFaces.push_back(static_cast<std::uint32_t>(face.idx()));
  return result;
}

}  // namespace nephele::detail

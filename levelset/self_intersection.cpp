// Self-intersections of a triangle soup.
//
// Candidate pairs come from CGAL's box intersection (sweep and segment trees); each is decided with exact
// predicates, after what the two triangles share. No common vertex: any common point counts. One: the edge
// opposite to it in one triangle must not meet the other. Two: the triangles must not fold onto each other in
// one plane. Three: they coincide. Triangles without area are left out: they lie in their neighbours' edges.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangle_3.h>
#include <CGAL/box_intersection_d.h>
#include <CGAL/intersections.h>

#include <algorithm>
#include <array>

#include "levelset/mesh_parts.h"
#include "levelset/mesh_repair.h"

namespace nephele {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Triangle = Kernel::Triangle_3;
using Segment = Kernel::Segment_3;
using FaceBox = CGAL::Box_intersection_d::Box_with_info_d<double, 3, std::uint32_t>;

class Pairs {
 public:
  explicit Pairs(const Mesh& mesh) : mesh_(mesh) {
    points_.reserve(mesh.positions.size());
    for (const Vec3d& p : mesh.positions) points_.emplace_back(p.x, p.y, p.z);
  }

  std::vector<FaceBox> boxes() const {
    std::vector<FaceBox> boxes;
    for (std::uint32_t f = 0; f < mesh_.faceCount(); ++f) {
      const auto face = mesh_.face(f);
      const Triangle t = triangle(f);
      if (face[0] != face[1] && face[1] != face[2] && face[2] != face[0] && !t.is_degenerate())
        boxes.emplace_back(t.bbox(), f);
    }
    return boxes;
  }

  bool intersect(std::uint32_t f, std::uint32_t g) const {
    std::array<std::uint32_t, 3> a, b;
    std::copy_n(mesh_.face(f).begin(), 3, a.begin());
    std::copy_n(mesh_.face(g).begin(), 3, b.begin());
    // Common vertices first, in the same order.
    std::size_t common = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto found = std::find(b.begin(), b.end(), a[i]);
      if (found == b.end()) continue;
      std::swap(*found, b[common]);
      std::swap(a[i], a[common]);
      ++common;
    }
    switch (common) {
      case 0:
        return CGAL::do_intersect(triangle(f), triangle(g));
      case 1:
        return CGAL::do_intersect(triangle(f), Segment(points_[b[1]], points_[b[2]])) ||
               CGAL::do_intersect(triangle(g), Segment(points_[a[1]], points_[a[2]]));
      case 2: {
        const Point &p = points_[a[0]], &q = points_[a[1]], &r = points_[a[2]], &s = points_[b[2]];
        return CGAL::orientation(p, q, r, s) == CGAL::COPLANAR &&
               CGAL::coplanar_orientation(p, q, r, s) == CGAL::POSITIVE;
      }
      default:
        return false;
    }
  }

 private:
  Triangle triangle(std::uint32_t f) const {
    const auto face = mesh_.face(f);
    return {points_[face[0]], points_[face[1]], points_[face[2]]};
  }

  const Mesh& mesh_;
  std::vector<Point> points_;
};

}  // namespace

std::size_t countSelfIntersections(const Mesh& mesh) {
  const Mesh triangles = triangulated(detail::withMergedPositions(mesh));
  const Pairs pairs(triangles);
  std::vector<FaceBox> boxes = pairs.boxes();
  std::size_t count = 0;
  CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), [&](const FaceBox& a, const FaceBox& b) {
    count += pairs.intersect(a.info(), b.info());
  });
  return count;
}

}  // namespace nephele

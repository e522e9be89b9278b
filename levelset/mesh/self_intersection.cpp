// Self-intersections of a triangle soup.
//
// Candidate pairs come from a tree of boxes that meets itself; all threads. Each is decided with exact
// predicates, after what the two triangles share. No common vertex: any common point counts. One: the edge
// opposite to it in one triangle must not meet the other. Two: the triangles must not fold onto each other in
// one plane. Three: they coincide. Triangles without area are left out: they lie in their neighbours' edges.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangle_3.h>
#include <CGAL/intersections.h>

#include <algorithm>
#include <array>
#include <atomic>

#include "nephele/levelset/mesh/box_tree.h"
#include "nephele/levelset/mesh/detail/mesh_parts.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {
namespace {

using detail::BoxTree;
using detail::PreciseBox;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Triangle = Kernel::Triangle_3;
using Segment = Kernel::Segment_3;

/// Faces that have area, and the tree of their boxes.
struct FaceTree {
  static constexpr std::uint32_t kMostInLeaf = 6;

  std::vector<std::uint32_t> faces, leaves;
  BoxTree<PreciseBox> tree;

  /// `boxes` are those of `ofFaces`.
  FaceTree(std::vector<std::uint32_t> ofFaces, const std::vector<PreciseBox>& boxes)
      : faces(std::move(ofFaces)), tree(boxes, kMostInLeaf) {
    for (std::uint32_t n = 0; n < tree.nodeCount(); ++n)
      if (tree.isLeaf(n)) leaves.push_back(n);
  }

  /// Calls f(a, b) for the faces of boxes that meet, the first of a leaf and the second after it.
  template <class F>
  void forPairs(std::size_t leaf, const F& f) const {
    const auto& own = tree.node(leaves[leaf]);
    const auto callIfMeeting = [&](std::uint32_t i, std::uint32_t j) {
      if (tree.box(i).meets(tree.box(j))) f(faces[tree.item(i)], faces[tree.item(j)]);
    };
    for (std::uint32_t i = own.begin; i < own.end; ++i)
      for (std::uint32_t j = i + 1; j < own.end; ++j) callIfMeeting(i, j);
    tree.walk([&](std::uint32_t n) { return tree.node(n).end > own.end && tree.node(n).box.meets(own.box); },
              [&](std::uint32_t j) {
                for (std::uint32_t i = own.begin; i < own.end; ++i) callIfMeeting(i, j);
              });
  }
};

class Pairs {
 public:
  explicit Pairs(const Mesh& mesh) : mesh_(mesh) {
    points_.reserve(mesh.positions.size());
    for (const Vec3d& p : mesh.positions) points_.emplace_back(p.x, p.y, p.z);
  }

  FaceTree tree() const {
    std::vector<std::uint32_t> faces;
    std::vector<PreciseBox> boxes;
    for (std::uint32_t f = 0; f < mesh_.faceCount(); ++f) {
      const auto face = mesh_.face(f);
      if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0] || triangle(f).is_degenerate())
        continue;
      faces.push_back(f);
      boxes.push_back({min(min(corner(f, 0), corner(f, 1)), corner(f, 2)),
                       max(max(corner(f, 0), corner(f, 1)), corner(f, 2))});
    }
    return {std::move(faces), boxes};
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
  const Vec3d& corner(std::uint32_t f, std::size_t k) const { return mesh_.positions[mesh_.face(f)[k]]; }

  Triangle triangle(std::uint32_t f) const {
    const auto face = mesh_.face(f);
    return {points_[face[0]], points_[face[1]], points_[face[2]]};
  }

  const Mesh& mesh_;
  std::vector<Point> points_;
};

}  // namespace

std::optional<std::size_t> countSelfIntersections(const Mesh& mesh, double mostPairsPerTriangle) {
  const Mesh triangles = triangulated(detail::withMergedPositions(requireValid(mesh)));
  const Pairs pairs(triangles);
  const FaceTree tree = pairs.tree();
  std::atomic<std::size_t> count{0};
  constexpr double kAnyMesh = 1e6;
  const double mostPairs = kAnyMesh + mostPairsPerTriangle * double(triangles.faceCount());
  std::atomic<std::size_t> pairsMet{0};
  constexpr std::size_t kLeavesPerTask = 64;
  parallelFor(tree.leaves.size(), kLeavesPerTask, [&](std::size_t begin, std::size_t end) {
    std::size_t found = 0;
    for (std::size_t leaf = begin; leaf < end && double(pairsMet) <= mostPairs; ++leaf) {
      std::size_t met = 0;
      tree.forPairs(leaf, [&](std::uint32_t f, std::uint32_t g) {
        ++met;
        found += pairs.intersect(f, g);
      });
      pairsMet += met;
    }
    count += found;
  });
  if (double(pairsMet) > mostPairs) return std::nullopt;
  return count.load();
}

}  // namespace nephele

// Self-intersections of a triangle soup.
//
// Candidate pairs come from a tree of boxes, halved at the median of their middles along the longest side,
// that meets itself; all threads. Each is decided with exact predicates, after what the two triangles share.
// No common vertex: any common point counts. One: the edge opposite to it in one triangle must not meet the
// other. Two: the triangles must not fold onto each other in one plane. Three: they coincide. Triangles
// without area are left out: they lie in their neighbours' edges.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangle_3.h>
#include <CGAL/intersections.h>

#include <algorithm>
#include <array>
#include <atomic>

#include "nephele/levelset/mesh/detail/mesh_parts.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Triangle = Kernel::Triangle_3;
using Segment = Kernel::Segment_3;

struct FaceBox {
  Vec3d low, high;
  std::uint32_t face = 0;

  bool meets(const FaceBox& other) const {
    return low.x <= other.high.x && other.low.x <= high.x && low.y <= other.high.y && other.low.y <= high.y &&
           low.z <= other.high.z && other.low.z <= high.z;
  }
};

/// Boxes in an order in which neighbours are near each other, and the boxes around halves of halves of them.
class BoxTree {
 public:
  explicit BoxTree(std::vector<FaceBox> boxes) : boxes_(std::move(boxes)) {
    if (!boxes_.empty()) build(0, std::uint32_t(boxes_.size()));
  }

  std::size_t leafCount() const { return leaves_.size(); }

  /// Calls f(a, b) for the faces of boxes that meet, the first of a leaf and the second after it.
  template <class F>
  void forPairs(std::size_t leaf, const F& f) const {
    const Node& own = nodes_[leaves_[leaf]];
    for (std::uint32_t i = own.begin; i < own.end; ++i)
      for (std::uint32_t j = i + 1; j < own.end; ++j) callIfMeeting(i, j, f);
    // Nodes stand before all of their parts: `next` is the first one that is no part.
    for (std::uint32_t n = 0; n < nodes_.size();) {
      const Node& node = nodes_[n];
      if (node.end <= own.end || !node.around.meets(own.around)) {
        n = node.next;
        continue;
      }
      ++n;
      if (n != node.next) continue;
      for (std::uint32_t i = own.begin; i < own.end; ++i)
        for (std::uint32_t j = node.begin; j < node.end; ++j) callIfMeeting(i, j, f);
    }
  }

 private:
  struct Node {
    FaceBox around;
    std::uint32_t begin, end, next;
  };
  static constexpr std::uint32_t kMostInLeaf = 6;

  template <class F>
  void callIfMeeting(std::uint32_t i, std::uint32_t j, const F& f) const {
    if (boxes_[i].meets(boxes_[j])) f(boxes_[i].face, boxes_[j].face);
  }

  void build(std::uint32_t begin, std::uint32_t end) {
    const auto number = std::uint32_t(nodes_.size());
    FaceBox around = boxes_[begin];
    for (std::uint32_t i = begin + 1; i < end; ++i) {
      around.low = min(around.low, boxes_[i].low);
      around.high = max(around.high, boxes_[i].high);
    }
    nodes_.push_back({around, begin, end, 0});
    if (end - begin <= kMostInLeaf) {
      leaves_.push_back(number);
    } else {
      const Vec3d size = around.high - around.low;
      const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
      const std::uint32_t middle = begin + (end - begin) / 2;
      std::nth_element(boxes_.begin() + begin, boxes_.begin() + middle, boxes_.begin() + end,
                       [axis](const FaceBox& a, const FaceBox& b) {
                         return a.low[axis] + a.high[axis] < b.low[axis] + b.high[axis];
                       });
      build(begin, middle);
      build(middle, end);
    }
    nodes_[number].next = std::uint32_t(nodes_.size());
  }

  std::vector<FaceBox> boxes_;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> leaves_;
};

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
        boxes.push_back({min(min(corner(f, 0), corner(f, 1)), corner(f, 2)),
                         max(max(corner(f, 0), corner(f, 1)), corner(f, 2)), f});
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
  const Vec3d& corner(std::uint32_t f, std::size_t k) const { return mesh_.positions[mesh_.face(f)[k]]; }

  Triangle triangle(std::uint32_t f) const {
    const auto face = mesh_.face(f);
    return {points_[face[0]], points_[face[1]], points_[face[2]]};
  }

  const Mesh& mesh_;
  std::vector<Point> points_;
};

}  // namespace

std::optional<std::size_t> countSelfIntersections(const Mesh& mesh) {
  const Mesh triangles = triangulated(detail::withMergedPositions(requireValid(mesh)));
  const Pairs pairs(triangles);
  const BoxTree tree(pairs.boxes());
  std::atomic<std::size_t> count{0};
  constexpr std::size_t kLeavesPerTask = 64;
  parallelFor(tree.leafCount(), kLeavesPerTask, [&](std::size_t begin, std::size_t end) {
    std::size_t found = 0;
    for (std::size_t leaf = begin; leaf < end; ++leaf)
      tree.forPairs(leaf, [&](std::uint32_t f, std::uint32_t g) { found += pairs.intersect(f, g); });
    count += found;
  });
  return count.load();
}

}  // namespace nephele

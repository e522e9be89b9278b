#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "nephele/modeling/base/math.h"

namespace nephele::detail {

using TriangleIndices = std::array<std::uint32_t, 3>;

/// Boxes around triangles, in a binary tree. Holds only boxes and numbers; boxes that touch count as meeting.
class TriangleTree {
 public:
  /// Of triangles[first .. last - 1], numbered as in `triangles`. Cost: n log n.
  TriangleTree(std::span<const Vec3d> positions, std::span<const TriangleIndices> triangles,
               std::uint32_t first, std::uint32_t last);

  bool isEmpty() const { return nodes_.empty(); }
  /// Appends every pair of a triangle here and one of `other` whose boxes meet; always in the same order.
  void findPairs(const TriangleTree& other,
                 std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs) const;
  /// Whether the box of any triangle meets this one.
  bool meetsBox(const Vec3d& low, const Vec3d& high) const;
  /// Calls `visit` with every triangle whose box is within `reach` of `p`, and with `reach`, which it may
  /// lessen.
  void visitNear(const Vec3d& p, double reach,
                 const std::function<void(std::uint32_t triangle, double& reach)>& visit) const;

 private:
  struct BoundingBox {
    Vec3d low, high;
    bool meets(const BoundingBox& other) const;
    double squaredDistanceTo(const Vec3d& p) const;
  };
  struct Node {
    BoundingBox box;
    /// A leaf has items [first, last); any other node the children `first` and `last`.
    std::uint32_t first = 0, last = 0;
    bool isLeaf = true;
  };

  std::uint32_t build(std::uint32_t first, std::uint32_t last);

  std::vector<Node> nodes_;
  std::vector<std::uint32_t> triangles_;
  std::vector<BoundingBox> boxes_;
};

}  // namespace nephele::detail

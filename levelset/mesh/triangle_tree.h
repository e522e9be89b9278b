#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "nephele/levelset/mesh/box_tree.h"
#include "nephele/modeling/base/math.h"

namespace nephele::detail {

using TriangleIndices = std::array<std::uint32_t, 3>;

/// The boxes of triangles. Holds only boxes and numbers; boxes that touch count as meeting.
class TriangleTree {
 public:
  /// Of triangles[first .. last - 1], numbered as in `triangles`. Cost: n log n.
  TriangleTree(std::span<const Vec3d> positions, std::span<const TriangleIndices> triangles,
               std::uint32_t first, std::uint32_t last);

  bool isEmpty() const { return tree_.isEmpty(); }
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
  BoxTree<PreciseBox> tree_;
  std::uint32_t first_;
};

}  // namespace nephele::detail

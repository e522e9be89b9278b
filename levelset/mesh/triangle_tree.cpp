// Two trees are walked at once, so that the cost follows the places where both surfaces are near, not their
// sizes.
#include "nephele/levelset/mesh/triangle_tree.h"

#include <algorithm>

namespace nephele::detail {
namespace {

constexpr std::uint32_t kMostInLeaf = 4;

std::vector<PreciseBox> boxesOf(std::span<const Vec3d> positions,
                                std::span<const TriangleIndices> triangles) {
  std::vector<PreciseBox> boxes;
  boxes.reserve(triangles.size());
  for (const TriangleIndices& t : triangles) {
    const Vec3d &a = positions[t[0]], &b = positions[t[1]], &c = positions[t[2]];
    boxes.push_back({min(a, min(b, c)), max(a, max(b, c))});
  }
  return boxes;
}

}  // namespace

TriangleTree::TriangleTree(std::span<const Vec3d> positions, std::span<const TriangleIndices> triangles,
                           std::uint32_t first, std::uint32_t last)
    : tree_(boxesOf(positions, triangles.subspan(first, last - first)), kMostInLeaf), first_(first) {}

void TriangleTree::findPairs(const TriangleTree& other,
                             std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs) const {
  if (isEmpty() || other.isEmpty()) return;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> open{{0, 0}};
  while (!open.empty()) {
    const auto [i, j] = open.back();
    open.pop_back();
    const auto &a = tree_.node(i), &b = other.tree_.node(j);
    if (!a.box.meets(b.box)) continue;
    const bool isLeafA = tree_.isLeaf(i), isLeafB = other.tree_.isLeaf(j);
    if (isLeafA && isLeafB) {
      for (std::uint32_t s = a.begin; s < a.end; ++s)
        for (std::uint32_t t = b.begin; t < b.end; ++t)
          if (tree_.box(s).meets(other.tree_.box(t)))
            pairs.emplace_back(first_ + tree_.item(s), other.first_ + other.tree_.item(t));
      continue;
    }
    const Vec3d sizeA = a.box.max - a.box.min, sizeB = b.box.max - b.box.min;
    if (isLeafB || (!isLeafA && dot(sizeA, sizeA) >= dot(sizeB, sizeB))) {
      open.emplace_back(tree_.left(i), j);
      open.emplace_back(tree_.right(i), j);
    } else {
      open.emplace_back(i, other.tree_.left(j));
      open.emplace_back(i, other.tree_.right(j));
    }
  }
}

bool TriangleTree::meetsBox(const Vec3d& low, const Vec3d& high) const {
  const PreciseBox box{low, high};
  bool found = false;
  tree_.walk([&](std::uint32_t n) { return !found && tree_.node(n).box.meets(box); },
             [&](std::uint32_t place) { found = found || tree_.box(place).meets(box); });
  return found;
}

void TriangleTree::visitNear(const Vec3d& p, double reach,
                             const std::function<void(std::uint32_t, double&)>& visit) const {
  if (isEmpty()) return;
  const auto isNear = [&](double squared) { return reach >= 0 && squared <= reach * reach; };
  // With their squared distances, so that those beyond what has been found since are left out.
  using Open = std::pair<std::uint32_t, double>;
  const auto withDistance = [&](std::uint32_t n) { return Open{n, tree_.node(n).box.squaredDistanceTo(p)}; };
  std::vector<Open> open{withDistance(0)};
  while (!open.empty()) {
    const auto [index, squared] = open.back();
    open.pop_back();
    if (!isNear(squared)) continue;
    const auto& node = tree_.node(index);
    if (tree_.isLeaf(index)) {
      for (std::uint32_t i = node.begin; i < node.end; ++i)
        if (isNear(tree_.box(i).squaredDistanceTo(p))) visit(first_ + tree_.item(i), reach);
      continue;
    }
    // The nearer child on top: what it holds may rule out the other.
    Open near = withDistance(tree_.left(index)), far = withDistance(tree_.right(index));
    if (far.second < near.second) std::swap(near, far);
    open.push_back(far);
    open.push_back(near);
  }
}

}  // namespace nephele::detail

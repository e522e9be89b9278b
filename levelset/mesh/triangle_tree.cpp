// A tree of boxes, split at the median along the longest side. Two trees are walked at once, so that the cost
// follows the places where both surfaces are near, not their sizes.
#include "nephele/levelset/mesh/triangle_tree.h"

#include <algorithm>

namespace nephele::detail {
namespace {

constexpr std::uint32_t kLeaf = 4;

}  // namespace

bool TriangleTree::BoundingBox::meets(const BoundingBox& other) const {
  return low.x <= other.high.x && other.low.x <= high.x && low.y <= other.high.y && other.low.y <= high.y &&
         low.z <= other.high.z && other.low.z <= high.z;
}

double TriangleTree::BoundingBox::squaredDistanceTo(const Vec3d& p) const {
  const Vec3d away = p - max(low, min(p, high));
  return dot(away, away);
}

TriangleTree::TriangleTree(std::span<const Vec3d> positions, std::span<const TriangleIndices> triangles,
                           std::uint32_t first, std::uint32_t last) {
  std::vector<BoundingBox> boxes;
  boxes.reserve(last - first);
  triangles_.reserve(last - first);
  for (std::uint32_t t = first; t < last; ++t) {
    const Vec3d &a = positions[triangles[t][0]], &b = positions[triangles[t][1]],
                &c = positions[triangles[t][2]];
    boxes.push_back({min(a, min(b, c)), max(a, max(b, c))});
    triangles_.push_back(t - first);
  }
  if (boxes.empty()) return;
  boxes_ = std::move(boxes);
  nodes_.reserve(boxes_.size());
  build(0, last - first);
  // Items in the order of the leaves, so that a walk reads along.
  std::vector<BoundingBox> sorted;
  sorted.reserve(boxes_.size());
  for (std::uint32_t& t : triangles_) {
    sorted.push_back(boxes_[t]);
    t += first;
  }
  boxes_ = std::move(sorted);
}

std::uint32_t TriangleTree::build(std::uint32_t first, std::uint32_t last) {
  const auto index = std::uint32_t(nodes_.size());
  BoundingBox box = boxes_[triangles_[first]];
  for (std::uint32_t i = first + 1; i < last; ++i) {
    box.low = min(box.low, boxes_[triangles_[i]].low);
    box.high = max(box.high, boxes_[triangles_[i]].high);
  }
  nodes_.push_back({box, first, last, true});
  if (last - first <= kLeaf) return index;
  const Vec3d size = box.high - box.low;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const std::uint32_t middle = first + (last - first) / 2;
  const auto begin = triangles_.begin();
  std::nth_element(begin + first, begin + middle, begin + last, [&](std::uint32_t a, std::uint32_t b) {
    const double ca = boxes_[a].low[axis] + boxes_[a].high[axis],
                 cb = boxes_[b].low[axis] + boxes_[b].high[axis];
    return ca != cb ? ca < cb : a < b;
  });
  const std::uint32_t left = build(first, middle);
  const std::uint32_t right = build(middle, last);
  nodes_[index].first = left;
  nodes_[index].last = right;
  nodes_[index].isLeaf = false;
  return index;
}

void TriangleTree::findPairs(const TriangleTree& other,
                             std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs) const {
  if (isEmpty() || other.isEmpty()) return;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> open{{0, 0}};
  while (!open.empty()) {
    const auto [i, j] = open.back();
    open.pop_back();
    const Node &a = nodes_[i], &b = other.nodes_[j];
    if (!a.box.meets(b.box)) continue;
    if (a.isLeaf && b.isLeaf) {
      for (std::uint32_t s = a.first; s < a.last; ++s)
        for (std::uint32_t t = b.first; t < b.last; ++t)
          if (boxes_[s].meets(other.boxes_[t])) pairs.emplace_back(triangles_[s], other.triangles_[t]);
      continue;
    }
    const Vec3d sizeA = a.box.high - a.box.low, sizeB = b.box.high - b.box.low;
    if (b.isLeaf || (!a.isLeaf && dot(sizeA, sizeA) >= dot(sizeB, sizeB))) {
      open.emplace_back(a.first, j);
      open.emplace_back(a.last, j);
    } else {
      open.emplace_back(i, b.first);
      open.emplace_back(i, b.last);
    }
  }
}

bool TriangleTree::meetsBox(const Vec3d& low, const Vec3d& high) const {
  if (isEmpty()) return false;
  const BoundingBox box{low, high};
  std::vector<std::uint32_t> open{0};
  while (!open.empty()) {
    const Node& node = nodes_[open.back()];
    open.pop_back();
    if (!node.box.meets(box)) continue;
    if (!node.isLeaf) {
      open.push_back(node.first);
      open.push_back(node.last);
      continue;
    }
    for (std::uint32_t i = node.first; i < node.last; ++i)
      if (boxes_[i].meets(box)) return true;
  }
  return false;
}

void TriangleTree::visitNear(const Vec3d& p, double reach,
                             const std::function<void(std::uint32_t, double&)>& visit) const {
  if (isEmpty()) return;
  const auto isNear = [&](double squared) { return reach >= 0 && squared <= reach * reach; };
  // With their squared distances, so that those beyond what has been found since are left out.
  std::vector<std::pair<std::uint32_t, double>> open{{0, nodes_[0].box.squaredDistanceTo(p)}};
  while (!open.empty()) {
    const auto [index, squared] = open.back();
    open.pop_back();
    if (!isNear(squared)) continue;
    const Node& node = nodes_[index];
    if (node.isLeaf) {
      for (std::uint32_t i = node.first; i < node.last; ++i)
        if (isNear(boxes_[i].squaredDistanceTo(p))) visit(triangles_[i], reach);
      continue;
    }
    // The nearer child on top: what it holds may rule out the other.
    std::pair<std::uint32_t, double> near{node.first, nodes_[node.first].box.squaredDistanceTo(p)},
        far{node.last, nodes_[node.last].box.squaredDistanceTo(p)};
    if (far.second < near.second) std::swap(near, far);
    open.push_back(far);
    open.push_back(near);
  }
}

}  // namespace nephele::detail

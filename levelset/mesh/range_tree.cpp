// Boxes split at the median of their longest side, down to a few items. A query adds the range of a node only
// while it can still widen the result, so that large boxes over values that vary little stay cheap.
#include "nephele/levelset/mesh/range_tree.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace nephele::detail {

namespace {

constexpr std::size_t kLeaf = 8;
/// Enough for halving 2^64 items.
constexpr std::size_t kDepth = 72;

bool isLeaf(std::size_t first, std::size_t last) {
  return last - first <= kLeaf;
}

}  // namespace

float distance(const Box& a, const Box& b) {
  Vec3f gap;
  for (int axis = 0; axis < 3; ++axis)
    gap[axis] = std::max({0.0f, a.min[axis] - b.max[axis], b.min[axis] - a.max[axis]});
  return length(gap);
}

RangeTree::RangeTree(std::vector<Item> items) : items_(std::move(items)) {
  if (!items_.empty()) build(0, 0, items_.size());
}

void RangeTree::build(std::size_t node, std::size_t first, std::size_t last) {
  if (nodes_.size() <= node) nodes_.resize(node + 1);
  Box box = items_[first].box;
  Interval range = items_[first].range;
  for (std::size_t i = first + 1; i < last; ++i) {
    box = box.including(items_[i].box);
    range = range.hull(items_[i].range);
  }
  nodes_[node] = {box, range, first, last};
  if (isLeaf(first, last)) return;
  const Vec3f size = box.size();
  const int axis = size.x >= size.y ? (size.x >= size.z ? 0 : 2) : (size.y >= size.z ? 1 : 2);
  const std::size_t middle = first + (last - first) / 2;
  const auto at = [&](std::size_t i) { return items_.begin() + std::ptrdiff_t(i); };
  std::nth_element(at(first), at(middle), at(last), [axis](const Item& a, const Item& b) {
    return a.box.min[axis] + a.box.max[axis] < b.box.min[axis] + b.box.max[axis];
  });
  build(2 * node + 1, first, middle);
  build(2 * node + 2, middle, last);
}

std::optional<Interval> RangeTree::near(const Box& box, float reach) const {
  std::optional<Interval> result;
  if (nodes_.empty()) return result;
  const auto isNear = [&](const Box& other) { return !(distance(box, other) > reach); };
  std::array<std::size_t, kDepth> stack;
  std::size_t height = 0;
  stack[height++] = 0;
  while (height > 0) {
    const std::size_t index = stack[--height];
    const Node& node = nodes_[index];
    if ((result && result->contains(node.range)) || !isNear(node.box)) continue;
    if (!isLeaf(node.first, node.last)) {
      stack[height++] = 2 * index + 1;
      stack[height++] = 2 * index + 2;
      continue;
    }
    for (std::size_t i = node.first; i < node.last; ++i)
      if (isNear(items_[i].box)) result = result ? result->hull(items_[i].range) : items_[i].range;
  }
  return result;
}

std::optional<Interval> RangeTree::all() const {
  if (nodes_.empty()) return std::nullopt;
  return nodes_[0].range;
}

}  // namespace nephele::detail

// A query adds the range of a node only while it can still widen the result, so that large boxes over values
// that vary little stay cheap.
#include "nephele/levelset/mesh/range_tree.h"

#include <algorithm>
#include <cmath>

namespace nephele::detail {

namespace {

constexpr std::uint32_t kMostInLeaf = 8;

/// 0 where they touch.
float distance(const Box& a, const Box& b) {
  Vec3f gap;
  for (int axis = 0; axis < 3; ++axis)
    gap[axis] = std::max({0.0f, a.min[axis] - b.max[axis], b.min[axis] - a.max[axis]});
  return length(gap);
}

std::vector<Box> boxesOf(const std::vector<RangeTree::Item>& items) {
  std::vector<Box> boxes;
  boxes.reserve(items.size());
  for (const RangeTree::Item& item : items) boxes.push_back(item.box);
  return boxes;
}

}  // namespace

RangeTree::RangeTree(const std::vector<Item>& items) : tree_(boxesOf(items), kMostInLeaf) {
  ranges_.reserve(items.size());
  for (std::uint32_t place = 0; place < items.size(); ++place)
    ranges_.push_back(items[tree_.item(place)].range);
  nodeRanges_.resize(tree_.nodeCount());
  for (auto n = std::uint32_t(tree_.nodeCount()); n-- > 0;) {
    if (!tree_.isLeaf(n)) {
      nodeRanges_[n] = nodeRanges_[tree_.left(n)].hull(nodeRanges_[tree_.right(n)]);
      continue;
    }
    const auto& leaf = tree_.node(n);
    nodeRanges_[n] = ranges_[leaf.begin];
    for (std::uint32_t place = leaf.begin + 1; place < leaf.end; ++place)
      nodeRanges_[n] = nodeRanges_[n].hull(ranges_[place]);
  }
}

std::optional<Interval> RangeTree::near(const Box& box, float reach) const {
  std::optional<Interval> result;
  const auto isNear = [&](const Box& other) { return !(distance(box, other) > reach); };
  tree_.walk(
      [&](std::uint32_t n) {
        return !(result && result->contains(nodeRanges_[n])) && isNear(tree_.node(n).box);
      },
      [&](std::uint32_t place) {
        if (isNear(tree_.box(place))) result = result ? result->hull(ranges_[place]) : ranges_[place];
      });
  return result;
}

std::optional<Interval> RangeTree::all() const {
  if (tree_.isEmpty()) return std::nullopt;
  return nodeRanges_[0];
}

}  // namespace nephele::detail

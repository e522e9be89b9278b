#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

#include "nephele/modeling/base/box.h"
#include "nephele/modeling/base/math.h"

namespace nephele::detail {

/// A box in double precision, both corners included; boxes that touch meet.
struct PreciseBox {
  Vec3d min, max;

  PreciseBox including(const PreciseBox& b) const {
    return {nephele::min(min, b.min), nephele::max(max, b.max)};
  }
  bool meets(const PreciseBox& b) const {
    return min.x <= b.max.x && b.min.x <= max.x && min.y <= b.max.y && b.min.y <= max.y && min.z <= b.max.z &&
           b.min.z <= max.z;
  }
  double squaredDistanceTo(const Vec3d& p) const {
    const Vec3d away = p - nephele::max(min, nephele::min(p, max));
    return dot(away, away);
  }
};

/// Items in space, found by their boxes: a binary tree, halved at the median of the middles along the longest
/// side, down to a few items. `AnyBox` is Box or PreciseBox. The tree depends on nothing but the boxes.
template <class AnyBox>
class BoxTree {
 public:
  struct Node {
    AnyBox box;
    /// Places of its items.
    std::uint32_t begin, end;
    /// The first node that is no part of it. Nodes stand before their parts.
    std::uint32_t next;
  };

  BoxTree() = default;
  /// Of items that are numbered as their boxes. Cost: n log n.
  BoxTree(const std::vector<AnyBox>& boxes, std::uint32_t mostInLeaf) : items_(boxes.size()) {
    std::iota(items_.begin(), items_.end(), 0u);
    if (boxes.empty()) return;
    nodes_.reserve(boxes.size());
    build(boxes, mostInLeaf, 0, std::uint32_t(boxes.size()));
    boxes_.reserve(boxes.size());
    for (const std::uint32_t item : items_) boxes_.push_back(boxes[item]);
  }

  bool isEmpty() const { return nodes_.empty(); }
  std::size_t nodeCount() const { return nodes_.size(); }
  const Node& node(std::uint32_t n) const { return nodes_[n]; }
  bool isLeaf(std::uint32_t n) const { return nodes_[n].next == n + 1; }
  /// The children of a node that is no leaf.
  std::uint32_t left(std::uint32_t n) const { return n + 1; }
  std::uint32_t right(std::uint32_t n) const { return nodes_[n + 1].next; }
  /// At a place: the number of the item that stands there, and its box.
  std::uint32_t item(std::uint32_t place) const { return items_[place]; }
  const AnyBox& box(std::uint32_t place) const { return boxes_[place]; }

  /// Calls visit(place) for all items of the leaves to which enters(node number) leads.
  template <class Enters, class Visit>
  void walk(const Enters& enters, const Visit& visit) const {
    for (std::uint32_t n = 0; n < nodes_.size();) {
      const Node& at = nodes_[n];
      if (!enters(n)) {
        n = at.next;
      } else if (++n == at.next) {
        for (std::uint32_t place = at.begin; place < at.end; ++place) visit(place);
      }
    }
  }

 private:
  void build(const std::vector<AnyBox>& boxes, std::uint32_t mostInLeaf, std::uint32_t begin,
             std::uint32_t end) {
    const auto number = nodes_.size();
    AnyBox around = boxes[items_[begin]];
    for (std::uint32_t i = begin + 1; i < end; ++i) around = around.including(boxes[items_[i]]);
    nodes_.push_back({around, begin, end, 0});
    if (end - begin > mostInLeaf) {
      const auto size = around.max - around.min;
      const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
      const std::uint32_t middle = begin + (end - begin) / 2;
      const auto first = items_.begin();
      std::nth_element(first + begin, first + middle, first + end, [&](std::uint32_t a, std::uint32_t b) {
        const auto ca = boxes[a].min[axis] + boxes[a].max[axis], cb = boxes[b].min[axis] + boxes[b].max[axis];
        return ca != cb ? ca < cb : a < b;
      });
      build(boxes, mostInLeaf, begin, middle);
      build(boxes, mostInLeaf, middle, end);
    }
    nodes_[number].next = std::uint32_t(nodes_.size());
  }

  std::vector<Node> nodes_;
  /// In the order of the leaves, so that a walk reads along.
  std::vector<std::uint32_t> items_;
  std::vector<AnyBox> boxes_;
};

}  // namespace nephele::detail

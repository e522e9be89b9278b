#pragma once

#include <optional>
#include <vector>

#include "nephele/modeling/base/box.h"
#include "nephele/modeling/base/interval.h"

namespace nephele::detail {

/// Value ranges of things in space, found by where the things are: a hierarchy of boxes.
class RangeTree {
 public:
  struct Item {
    Box box;
    Interval range;
  };

  /// n log n in the number of items.
  explicit RangeTree(std::vector<Item> items);

  /// Hull of the ranges of all items whose box is within `reach` of `box`; nothing if there are none.
  std::optional<Interval> near(const Box& box, float reach) const;
  /// Hull of all ranges; nothing if there are no items.
  std::optional<Interval> all() const;

 private:
  /// Items [first, last), and of those the two halves in the nodes 2 i + 1 and 2 i + 2 unless it is a leaf.
  struct Node {
    Box box;
    Interval range;
    std::size_t first = 0, last = 0;
  };

  void build(std::size_t node, std::size_t first, std::size_t last);

  std::vector<Item> items_;
  std::vector<Node> nodes_;
};

/// Distance between two boxes; 0 where they touch.
float distance(const Box& a, const Box& b);

}  // namespace nephele::detail

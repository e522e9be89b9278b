#pragma once

#include <optional>
#include <vector>

#include "nephele/levelset/mesh/box_tree.h"
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
  explicit RangeTree(const std::vector<Item>& items);

  /// Hull of the ranges of all items whose box is within `reach` of `box`; nothing if there are none.
  std::optional<Interval> near(const Box& box, float reach) const;
  /// Hull of all ranges; nothing if there are no items.
  std::optional<Interval> all() const;

 private:
  BoxTree<Box> tree_;
  /// Of the places and of the nodes of the tree.
  std::vector<Interval> ranges_, nodeRanges_;
};

}  // namespace nephele::detail

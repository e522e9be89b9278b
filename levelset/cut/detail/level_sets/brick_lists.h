#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {

/// Runs of items, one for each brick.
template <class T>
struct BrickLists {
  std::vector<T> items;
  /// Where each run begins, and where the last one ends.
  std::vector<std::size_t> first;

  std::span<const T> of(std::size_t i) const { return {items.data() + first[i], first[i + 1] - first[i]}; }
};

/// Lists made in parallel: make(i, list) appends those of brick i to a list that may hold others.
/// @throws Cancelled.
template <class T, class Make>
BrickLists<T> makeLists(std::size_t count, const Make& make, const Progress& progress) {
  constexpr std::size_t kBricksPerTask = 32;
  struct Block {
    std::vector<T> items;
    std::vector<std::size_t> ends;
  };
  std::vector<Block> blocks((count + kBricksPerTask - 1) / kBricksPerTask);
  parallelFor(
      count, kBricksPerTask,
      [&](std::size_t begin, std::size_t end) {
        Block& block = blocks[begin / kBricksPerTask];
        for (std::size_t i = begin; i < end; ++i) {
          make(i, block.items);
          block.ends.push_back(block.items.size());
        }
      },
      progress);
  BrickLists<T> lists;
  lists.first.reserve(count + 1);
  lists.first.push_back(0);
  std::size_t total = 0;
  for (const Block& block : blocks) total += block.items.size();
  lists.items.reserve(total);
  for (const Block& block : blocks) {
    for (const std::size_t end : block.ends) lists.first.push_back(lists.items.size() + end);
    lists.items.insert(lists.items.end(), block.items.begin(), block.items.end());
  }
  return lists;
}

}  // namespace nephele::detail

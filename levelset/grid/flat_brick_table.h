#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "nephele/levelset/grid/brick_box.h"

namespace nephele {

/// A number for every brick of a box, found in one step: what is sampled, and so read more often than it
/// changes. BrickTable is for bricks wherever they lie. Number 0 is the background, and stands beyond the
/// box.
struct FlatBrickTable {
  BrickBox box;
  /// Of each brick, in the order of the box: x fastest, then y, then z.
  std::vector<std::int32_t> entries;

  FlatBrickTable() = default;
  /// The background everywhere.
  explicit FlatBrickTable(const BrickBox& bricks) : box(bricks), entries(bricks.size(), 0) {}

  std::int32_t at(const Vec3i& brick) const { return box.covers(brick) ? entries[box.numberOf(brick)] : 0; }
  /// Of a brick of the box, to be set.
  std::int32_t& operator[](const Vec3i& brick) { return entries[box.numberOf(brick)]; }
  /// Lets `number` stand for the bricks [first, end) of the box.
  void fill(const Vec3i& first, const Vec3i& end, std::int32_t number) {
    for (int z = first.z; z < end.z; ++z)
      for (int y = first.y; y < end.y; ++y)
        std::fill_n(entries.begin() + std::ptrdiff_t(box.numberOf({first.x, y, z})), end.x - first.x, number);
  }
  std::size_t memoryBytes() const { return entries.capacity() * sizeof(std::int32_t); }
};

}  // namespace nephele

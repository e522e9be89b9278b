#pragma once

#include <vector>

#include "nephele/levelset/grid/brick_grid.h"

namespace nephele {

/// Ranges of stored samples over regions of a grid: a pyramid of block ranges, so that any region costs at
/// most 64 look-ups. The grid must outlive it and keep its samples.
class BrickRanges {
 public:
  explicit BrickRanges(const BrickLayout& grid);

  /// Contains every sample stored by the bricks [first, last], both included: exact up to 4 bricks per axis,
  /// wider for larger regions. Includes the background where the region leaves the table.
  Interval over(const Vec3i& first, const Vec3i& last) const;

 private:
  struct Level {
    Vec3i count;
    std::vector<Interval> ranges;
  };

  Interval at(std::size_t level, const Vec3i& cell) const;

  const BrickLayout& grid_;
  std::vector<Level> levels_;
};

}  // namespace nephele

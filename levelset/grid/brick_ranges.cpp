#include "nephele/levelset/grid/brick_ranges.h"

#include <algorithm>

namespace nephele {

BrickRanges::BrickRanges(const BrickLayout& grid) : grid_(grid) {
  Vec3i count = grid.brickCount();
  while (std::max({count.x, count.y, count.z}) > 4) {
    const Vec3i finer = count;
    count = {(finer.x + 1) / 2, (finer.y + 1) / 2, (finer.z + 1) / 2};
    Level level{count, {}};
    level.ranges.reserve(std::size_t(count.x) * count.y * count.z);
    for (int z = 0; z < count.z; ++z)
      for (int y = 0; y < count.y; ++y)
        for (int x = 0; x < count.x; ++x) {
          Interval range = at(levels_.size(), {2 * x, 2 * y, 2 * z});
          for (int child = 1; child < 8; ++child) {
            const Vec3i c{2 * x + (child & 1), 2 * y + (child >> 1 & 1), 2 * z + (child >> 2)};
            if (c.x < finer.x && c.y < finer.y && c.z < finer.z) range = range.hull(at(levels_.size(), c));
          }
          level.ranges.push_back(range);
        }
    levels_.push_back(std::move(level));
  }
}

Interval BrickRanges::at(std::size_t level, const Vec3i& cell) const {
  const Vec3i& count = level == 0 ? grid_.brickCount() : levels_[level - 1].count;
  const std::size_t i = (std::size_t(cell.z) * count.y + std::size_t(cell.y)) * count.x + std::size_t(cell.x);
  return level == 0 ? grid_.ranges()[std::size_t(grid_.table()[i])] : levels_[level - 1].ranges[i];
}

Interval BrickRanges::over(const Vec3i& first, const Vec3i& last) const {
  const Interval background = Interval::of(grid_.background());
  const Vec3i low = max(first, grid_.firstBrick()),
              high = min(last, grid_.firstBrick() + grid_.brickCount() - Vec3i{1, 1, 1});
  if (low.x > high.x || low.y > high.y || low.z > high.z) return background;
  Vec3i a = low - grid_.firstBrick(), b = high - grid_.firstBrick();
  std::size_t level = 0;
  for (; std::max({b.x - a.x, b.y - a.y, b.z - a.z}) >= 4; ++level) {
    a = {a.x / 2, a.y / 2, a.z / 2};
    b = {b.x / 2, b.y / 2, b.z / 2};
  }
  Interval range = low == first && high == last ? at(level, a) : background;
  for (int z = a.z; z <= b.z; ++z)
    for (int y = a.y; y <= b.y; ++y)
      for (int x = a.x; x <= b.x; ++x) range = range.hull(at(level, {x, y, z}));
  return range;
}

}  // namespace nephele

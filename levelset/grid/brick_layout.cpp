#include "nephele/levelset/grid/brick_layout.h"

#include <cmath>

#include "nephele/levelset/grid/brick_table.h"
#include "nephele/modeling/base/assertion.h"
#include "nephele/modeling/base/error.h"

namespace nephele {

BrickLayout::BrickLayout(const Lattice& lattice, const BrickBox& places, float background)
    : background_(background) {
  setLattice(lattice);
  require(places.count.x >= 0 && places.count.y >= 0 && places.count.z >= 0,
          "grid: the table must have one entry per brick position");
  requireHoldable("grid", places);
  table_ = FlatBrickTable(places);
  ranges_.assign(1, Interval::of(background));
}

Box BrickLayout::worldBox() const {
  Box box;
  if (table().empty()) return box;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3i b{firstBrick().x + (corner & 1 ? brickCount().x : 0),
                  firstBrick().y + (corner & 2 ? brickCount().y : 0),
                  firstBrick().z + (corner & 4 ? brickCount().z : 0)};
    box = box.including(indexToWorld()(Vec3f(b * kBrick)));
  }
  return box;
}

void BrickLayout::setLattice(const Lattice& lattice) {
  require(lattice.voxelSize > 0 && std::isfinite(lattice.voxelSize), "grid: the voxel size must be > 0");
  lattice_ = lattice;
}

void BrickLayout::place(const Vec3i& brick, std::int32_t pool) {
  NEPHELE_ASSERT(covers(brick));
  NEPHELE_ASSERT(pool >= 0 && std::size_t(pool) < poolSize());
  table_[brick] = pool;
}

void BrickLayout::setTable(std::vector<std::int32_t> table) {
  require(table.size() == places().size(), "grid: the table must have one entry per brick position");
  for (const std::int32_t pool : table)
    require(pool >= 0 && std::size_t(pool) < poolSize(), "grid: the table names a brick that is not there");
  table_.entries = std::move(table);
}

void BrickLayout::setRange(std::int32_t pool, const Interval& range) {
  NEPHELE_ASSERT(pool >= 0 && std::size_t(pool) < poolSize());
  ranges_[std::size_t(pool)] = range;
}

void BrickLayout::requirePool(std::size_t size) const {
  require(double(size) <= kMostBricks, "grid: there are more bricks than can be numbered; use larger voxels");
}

std::int32_t BrickLayout::appendRanges(std::size_t bricks) {
  const std::size_t first = poolSize();
  requirePool(first + bricks);
  ranges_.resize(first + bricks, Interval::of(0.0f));
  return std::int32_t(first);
}

std::size_t BrickLayout::layoutBytes() const {
  return table_.memoryBytes() + ranges_.capacity() * sizeof(Interval);
}

std::vector<PlacedBrick> placedBricks(const BrickLayout& grid) {
  constexpr std::int64_t kNone = -1, kSeveral = -2;
  std::vector<std::int64_t> position(grid.poolSize(), kNone);
  for (std::size_t i = 0; i < grid.table().size(); ++i) {
    std::int64_t& p = position[std::size_t(grid.table()[i])];
    p = p == kNone ? std::int64_t(i) : kSeveral;
  }
  std::vector<PlacedBrick> placed;
  for (std::size_t pool = 1; pool < position.size(); ++pool) {
    if (position[pool] < 0) continue;
    placed.push_back({std::int32_t(pool), grid.places().at(std::size_t(position[pool]))});
  }
  return placed;
}

}  // namespace nephele

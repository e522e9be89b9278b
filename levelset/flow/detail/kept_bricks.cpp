#include "nephele/levelset/flow/detail/kept_bricks.h"

#include <algorithm>
#include <cmath>

namespace nephele::detail {
namespace {

float largest(const Vec3f& v) {
  return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

}  // namespace

KeptBricks::KeptBricks(const FlowMap& map) : lattice_(map.lattice) {
  for (std::size_t i = 0; i < map.bricks.size(); ++i) table_.set(map.bricks[i], std::int32_t(i));
}

float KeptBricks::roundingAt(const Vec3f& q) const {
  return 1e-3f + 1e-6f * (largest(q) + largest(lattice_.worldToIndex.translation));
}

bool KeptBricks::hold(const Vec3f& world) const {
  const Vec3f q = lattice_.worldToIndex(world);
  const float rounding = roundingAt(q);
  const Vec3i brick = brickAround(q);
  if (table_.at(brick) < 0) return false;
  const Vec3f within = q - Vec3f(brick * BrickGrid::kBrick);
  const auto isAmid = [&](float x) { return x > rounding && x < BrickGrid::kBrick - rounding; };
  if (isAmid(within.x) && isAmid(within.y) && isAmid(within.z)) return true;
  const Vec3f around{rounding, rounding, rounding};
  const Vec3i low = brickAround(q - around), high = brickAround(q + around);
  for (int z = low.z; z <= high.z; ++z)
    for (int y = low.y; y <= high.y; ++y)
      for (int x = low.x; x <= high.x; ++x)
        if (table_.at({x, y, z}) < 0) return false;
  return true;
}

bool KeptBricks::moveInside(Vec3f& world) const {
  constexpr int kSearch = 2;
  const Vec3f q = lattice_.worldToIndex(world);
  const Vec3i brick = brickAround(q);
  const float margin = 2 * roundingAt(q), last = BrickGrid::kBrick - margin;
  float best = INFINITY;
  Vec3f found;
  for (int z = -kSearch; z <= kSearch; ++z)
    for (int y = -kSearch; y <= kSearch; ++y)
      for (int x = -kSearch; x <= kSearch; ++x) {
        const Vec3i other = brick + Vec3i{x, y, z};
        if (table_.at(other) < 0) continue;
        const Vec3f low(other * BrickGrid::kBrick);
        const Vec3f clamped = min(max(q, low + Vec3f{margin, margin, margin}), low + Vec3f{last, last, last});
        const Vec3f away = q - clamped;
        if (const float distance = dot(away, away); distance < best) {
          best = distance;
          found = clamped;
        }
      }
  if (best == INFINITY) return false;
  world = lattice_.indexToWorld(found);
  return true;
}

}  // namespace nephele::detail

#pragma once

#include <algorithm>
#include <cmath>

#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/modeling/base/math.h"
#include "nephele/render/volume/detail/index_map.h"
#include "nephele/render/volume/trilinear.h"

namespace nephele::detail {

/// A source grid as the target's voxels see it.
class SourceGrid {
 public:
  SourceGrid(const BrickGrid& target, const BrickGrid& grid)
      : grid_(grid), toSource_(target, grid), toTarget_(grid, target) {}

  float at(const Vec3i& voxel) const {
    if (toSource_.isShift) return sample(voxel + toSource_.shift);
    return at(Vec3d(Vec3f(voxel)));
  }

  /// As `at`, for samples that are interpolated again. Where voxels do not divide each other, lines between
  /// samples lie above what bends up, as edges do at their foot, which puts a veil before them; a sixth of
  /// the second difference takes off what that is on average. Never beyond the values around, so that nothing
  /// rings.
  float fitted(const Vec3i& voxel) const {
    const float middle = at(voxel);
    if (toSource_.isDivision) return middle;
    float sum = 0, least = middle, most = middle;
    for (int axis = 0; axis != 3; ++axis)
      for (const int side : {-1, 1}) {
        Vec3i beside = voxel;
        beside[axis] += side;
        const float value = at(beside);
        sum += value;
        least = std::min(least, value);
        most = std::max(most, value);
      }
    return std::clamp(middle - (sum - 6 * middle) * (1.0f / 6), least, most);
  }

  /// Between the target's voxels.
  float at(const Vec3d& place) const { return sampleGrid(grid_, toSource_(place)); }

  /// Whether any value above zero lies in the source's bricks around the voxels low .. high, or may come
  /// there by moving.
  bool reaches(const Vec3i& low, const Vec3i& high, const Vec3d& motion) const {
    Vec3d a, b;
    toSource_.mapped(Vec3d(Vec3f(low)) - motion, Vec3d(Vec3f(high)) + motion, a, b);
    Vec3i first, last;
    for (int axis = 0; axis != 3; ++axis) {
      const double lowest = grid_.firstBrick()[axis], highest = lowest + grid_.brickCount()[axis] - 1;
      first[axis] = int(std::clamp(std::floor((a[axis] - 0.001) / BrickGrid::kBrick), lowest, highest + 1));
      last[axis] = int(std::clamp(std::floor((b[axis] + 0.001) / BrickGrid::kBrick), lowest - 1, highest));
    }
    for (int z = first.z; z <= last.z; ++z)
      for (int y = first.y; y <= last.y; ++y)
        for (int x = first.x; x <= last.x; ++x)
          if (grid_.ranges()[std::size_t(grid_.poolIndex({x, y, z}))].max > 0) return true;
    return false;
  }

  /// Calls visit(first, last) with the target's bricks that values above zero may reach, source brick by
  /// source brick.
  template <class Visit>
  void visitBricks(const Vec3d& motion, Visit&& visit) const {
    std::size_t entry = 0;
    for (int z = 0; z != grid_.brickCount().z; ++z)
      for (int y = 0; y != grid_.brickCount().y; ++y)
        for (int x = 0; x != grid_.brickCount().x; ++x, ++entry) {
          if (!(grid_.ranges()[std::size_t(grid_.table()[entry])].max > 0)) continue;
          const Vec3f low((grid_.firstBrick() + Vec3i{x, y, z}) * BrickGrid::kBrick);
          Vec3d a, b;
          toTarget_.mapped(Vec3d(low),
                           Vec3d(low + Vec3f{BrickGrid::kBrick, BrickGrid::kBrick, BrickGrid::kBrick}), a, b);
          Vec3i first, last;
          for (int axis = 0; axis != 3; ++axis) {
            first[axis] =
                int(std::floor(std::clamp((a[axis] - motion[axis] - 1) / BrickGrid::kBrick, -1e8, 1e8)));
            last[axis] =
                int(std::floor(std::clamp((b[axis] + motion[axis] + 1) / BrickGrid::kBrick, -1e8, 1e8)));
          }
          visit(first, last);
        }
  }

 private:
  float sample(const Vec3i& voxel) const {
    return grid_.brick(grid_.poolIndex(
        brickOf(voxel)))[sampleOffset(insideBrick(voxel.x), insideBrick(voxel.y), insideBrick(voxel.z))];
  }

  const BrickGrid& grid_;
  IndexMap toSource_, toTarget_;
};

}  // namespace nephele::detail

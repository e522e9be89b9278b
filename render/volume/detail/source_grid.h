#pragma once

#include <algorithm>
#include <cmath>

#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/modeling/base/math.h"
#include "nephele/render/volume/trilinear.h"

namespace nephele::detail {

/// From the target's voxels to a source's, in double.
struct IndexMap {
  double m[3][3], t[3];

  IndexMap(const BrickGrid& target, const BrickGrid& source) {
    for (int row = 0; row != 3; ++row) {
      t[row] = double(source.worldToIndex().translation[row]);
      for (int k = 0; k != 3; ++k)
        t[row] += double(source.worldToIndex().linear(row, k)) * double(target.indexToWorld().translation[k]);
      for (int column = 0; column != 3; ++column) {
        m[row][column] = 0;
        for (int k = 0; k != 3; ++k)
          m[row][column] +=
              double(source.worldToIndex().linear(row, k)) * double(target.indexToWorld().linear(k, column));
      }
    }
    snap();
  }

  Vec3d operator()(const Vec3d& p) const {
    Vec3d r;
    for (int row = 0; row != 3; ++row) r[row] = m[row][0] * p.x + m[row][1] * p.y + m[row][2] * p.z + t[row];
    return r;
  }

  /// The box of a box.
  void mapped(const Vec3d& low, const Vec3d& high, Vec3d& outLow, Vec3d& outHigh) const {
    const Vec3d middle = (*this)((low + high) * 0.5), half = (high - low) * 0.5;
    for (int row = 0; row != 3; ++row) {
      const double reach =
          std::fabs(m[row][0]) * half.x + std::fabs(m[row][1]) * half.y + std::fabs(m[row][2]) * half.z;
      outLow[row] = middle[row] - reach;
      outHigh[row] = middle[row] + reach;
    }
  }

  /// Whether voxels coincide, and by how many they are shifted.
  bool isShift = false;
  Vec3i shift{};
  /// Whether the source's voxels are cut into whole ones of the target, so that no cell of the target has a
  /// kink of the source within.
  bool isDivision = false;

 private:
  // Takes the rounding of maps for what it is.
  void snap() {
    constexpr double tolerance = 1e-5;
    for (auto& row : m)
      for (double& value : row)
        if (std::fabs(value - std::round(value)) < tolerance) value = std::round(value);
    for (double& value : t)
      if (std::fabs(value - std::round(value)) < 1e-3) value = std::round(value);
    isShift = true;
    for (int row = 0; row != 3; ++row) {
      for (int column = 0; column != 3; ++column) isShift = isShift && m[row][column] == (row == column);
      isShift = isShift && t[row] == std::round(t[row]) && std::fabs(t[row]) < 1e8;
      if (isShift) shift[row] = int(t[row]);
    }
    const double parts = std::round(1 / std::hypot(m[0][0], m[1][0], m[2][0]));
    const auto isWhole = [&](double value) {
      return std::fabs(value * parts - std::round(value * parts)) < 1e-3;
    };
    isDivision = parts >= 1 && parts < 1e3;
    for (int row = 0; row != 3; ++row) {
      isDivision = isDivision && isWhole(t[row]);
      for (const double value : m[row])
        isDivision = isDivision && (value == 0 || std::fabs(std::fabs(value * parts) - 1) < 1e-5);
    }
  }
};

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

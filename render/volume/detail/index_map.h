#pragma once

#include <cmath>

#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/modeling/base/math.h"

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

}  // namespace nephele::detail

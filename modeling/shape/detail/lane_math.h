#pragma once

#include <hwy/base.h>

#include <cmath>

#include "nephele/modeling/base/math.h"

/// What shapes are computed from: selection instead of branches, and nothing fused.
namespace nephele::detail {

HWY_INLINE float larger(float a, float b) {
  return a > b ? a : b;
}
HWY_INLINE float smaller(float a, float b) {
  return a < b ? a : b;
}
HWY_INLINE float magnitude(float a) {
  return a < 0 ? -a : a;
}
HWY_INLINE float root(float x, float y, float z) {
  return std::sqrt(x * x + y * y + z * z);
}
/// 1 / v, or 0 for 0.
HWY_INLINE float inverseOrZero(float v) {
  return v > 0 ? 1 / v : 0.0f;
}

/// `radius` less the length of (x, y, z), the way from what is rounded to the point.
template <bool kGrad>
HWY_INLINE float rounded(float radius, float x, float y, float z, float& gx, float& gy, float& gz) {
  const float d = root(x, y, z);
  if constexpr (kGrad) {
    const float s = -inverseOrZero(d);
    gx = s * x, gy = s * y, gz = s * z;
  }
  return radius - d;
}

/// (x, y, z) along an axis and away from it.
struct AxisWay {
  float h, rx, ry, rz, r;

  HWY_INLINE AxisWay(const Vec3f& axis, float x, float y, float z)
      : h(x * axis.x + y * axis.y + z * axis.z),
        rx(x - h * axis.x),
        ry(y - h * axis.y),
        rz(z - h * axis.z),
        r(root(rx, ry, rz)) {}
};

}  // namespace nephele::detail

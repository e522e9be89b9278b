#pragma once

#include <cmath>
#include <variant>

#include "nephele/modeling/base/math.h"
#include "nephele/modeling/shape/detail/lane_math.h"

/// The shapes of shapes.h at one point: plain code that is the truth, and that compilers turn into lane code.
///
/// at<true> also writes the gradient. Everything is selection instead of branches, so that loops over points
/// become vector code; nothing is fused, so that all instruction sets give the same bits.
namespace nephele::detail {

struct SphereShape {
  Vec3f center;
  float radius;

  template <bool kGrad>
  HWY_INLINE float at(float px, float py, float pz, float& gx, float& gy, float& gz) const {
    return rounded<kGrad>(radius, px - center.x, py - center.y, pz - center.z, gx, gy, gz);
  }
};

struct BoxShape {
  Vec3f center, half;

  template <bool kGrad>
  HWY_INLINE float at(float px, float py, float pz, float& gx, float& gy, float& gz) const {
    const float x = px - center.x, y = py - center.y, z = pz - center.z;
    const float qx = magnitude(x) - half.x, qy = magnitude(y) - half.y, qz = magnitude(z) - half.z;
    const float ox = larger(qx, 0), oy = larger(qy, 0), oz = larger(qz, 0);
    const float outside = root(ox, oy, oz);
    const float nearest = larger(larger(qx, qy), qz);
    const float inside = smaller(nearest, 0);
    if constexpr (kGrad) {
      // Outside along the way to the nearest point; inside along the axis of the nearest face.
      const float s = inverseOrZero(outside);
      const bool isX = qx == nearest, isY = !isX && qy == nearest, isZ = !isX && !isY;
      const bool out = outside > 0;
      const float mx = out ? s * ox : (isX ? 1.0f : 0.0f);
      const float my = out ? s * oy : (isY ? 1.0f : 0.0f);
      const float mz = out ? s * oz : (isZ ? 1.0f : 0.0f);
      gx = x < 0 ? mx : -mx, gy = y < 0 ? my : -my, gz = z < 0 ? mz : -mz;
    }
    return -(outside + inside);
  }
};

struct PlaneShape {
  Vec3f normal;
  float offset;

  template <bool kGrad>
  HWY_INLINE float at(float px, float py, float pz, float& gx, float& gy, float& gz) const {
    if constexpr (kGrad) gx = normal.x, gy = normal.y, gz = normal.z;
    return normal.x * px + normal.y * py + normal.z * pz - offset;
  }
};

struct TorusShape {
  Vec3f center, axis;
  float major, minor;

  template <bool kGrad>
  HWY_INLINE float at(float px, float py, float pz, float& gx, float& gy, float& gz) const {
    const auto [h, rx, ry, rz, r] = AxisWay(axis, px - center.x, py - center.y, pz - center.z);
    const float e = r - major;
    const float d = std::sqrt(e * e + h * h);
    if constexpr (kGrad) {
      const float s = -inverseOrZero(d);
      const float radial = s * e * inverseOrZero(r), along = s * h;
      gx = radial * rx + along * axis.x, gy = radial * ry + along * axis.y, gz = radial * rz + along * axis.z;
    }
    return minor - d;
  }
};

struct CapsuleShape {
  Vec3f a, way;
  /// 1 / |way|^2, or 0.
  float inverseSquare;
  float radius;

  template <bool kGrad>
  HWY_INLINE float at(float px, float py, float pz, float& gx, float& gy, float& gz) const {
    const float x = px - a.x, y = py - a.y, z = pz - a.z;
    const float t = smaller(larger((x * way.x + y * way.y + z * way.z) * inverseSquare, 0), 1);
    return rounded<kGrad>(radius, x - t * way.x, y - t * way.y, z - t * way.z, gx, gy, gz);
  }
};

struct ConeShape {
  Vec3f base, axis;
  float radius, height;
  /// 1 / (radius^2 + height^2), and the slant's inward normal in (distance from the axis, height).
  float inverseSquare, normalR, normalH;

  template <bool kGrad>
  HWY_INLINE float at(float px, float py, float pz, float& gx, float& gy, float& gz) const {
    const auto [h, rx, ry, rz, r] = AxisWay(axis, px - base.x, py - base.y, pz - base.z);
    // Nearest points of the base and of the slant, as the way from there to (r, h).
    const float br = larger(r - radius, 0), bh = h;
    const float t = smaller(larger((h * height - (r - radius) * radius) * inverseSquare, 0), 1);
    const float sr = r - radius + t * radius, sh = h - t * height;
    const float bb = br * br + bh * bh, ss = sr * sr + sh * sh;
    const bool onBase = bb < ss;
    const float d = std::sqrt(onBase ? bb : ss);
    const bool inside = h > 0 && (r - radius) * normalR + h * normalH > 0;
    if constexpr (kGrad) {
      const float s = inside ? inverseOrZero(d) : -inverseOrZero(d);
      const float gr = d > 0 ? s * (onBase ? br : sr) : (onBase ? 0.0f : normalR);
      const float gh = d > 0 ? s * (onBase ? bh : sh) : (onBase ? 1.0f : normalH);
      const float radial = gr * inverseOrZero(r);
      gx = radial * rx + gh * axis.x, gy = radial * ry + gh * axis.y, gz = radial * rz + gh * axis.z;
    }
    return inside ? d : -d;
  }
};

struct EllipsoidShape {
  Vec3f center, inverseRadii;
  float smallest, largest;

  template <bool kGrad>
  HWY_INLINE float at(float px, float py, float pz, float& gx, float& gy, float& gz) const {
    const float ux = (px - center.x) * inverseRadii.x, uy = (py - center.y) * inverseRadii.y,
                uz = (pz - center.z) * inverseRadii.z;
    const float vx = ux * inverseRadii.x, vy = uy * inverseRadii.y, vz = uz * inverseRadii.z;
    const float k = root(ux, uy, uz), m = root(vx, vy, vz);
    // k / m lies between the radii; rounding and the centre, where it has no limit, must not leave them.
    const float ratio = smaller(larger(k * inverseOrZero(m), smallest), largest);
    if constexpr (kGrad) {
      const float ik = inverseOrZero(k), im = inverseOrZero(m);
      const float a = (1 - 2 * k) * im * ik, b = (1 - k) * ratio * im * im;
      gx = a * vx - b * vx * inverseRadii.x * inverseRadii.x;
      gy = a * vy - b * vy * inverseRadii.y * inverseRadii.y;
      gz = a * vz - b * vz * inverseRadii.z * inverseRadii.z;
    }
    return (1 - k) * ratio;
  }
};

using ShapeKind =
    std::variant<SphereShape, BoxShape, PlaneShape, TorusShape, CapsuleShape, ConeShape, EllipsoidShape>;

}  // namespace nephele::detail

#pragma once

#include <cmath>

#include "nephele/modeling/base/box.h"

namespace nephele {

/// Coordinates in which what is in a box lies about the origin and is one to two units long: products of
/// lengths of tiny or vast things have no place in single precision. The unit is a power of two, so that
/// nothing is rounded that would not be without.
struct BoxUnits {
  Vec3d centre{};
  double unit = 1, perUnit = 1;

  BoxUnits() = default;
  /// Of a box that is finite; one that is a single point keeps its unit.
  explicit BoxUnits(const Box& box) : centre((Vec3d(box.min) + Vec3d(box.max)) * 0.5) {
    if (const double side = box.longestSide(); side > 0) {
      unit = std::ldexp(1.0, std::ilogb(side));
      perUnit = 1 / unit;
    }
  }

  Vec3d own(const Vec3d& p) const { return (p - centre) * perUnit; }
  Vec3d world(const Vec3d& p) const { return p * unit + centre; }
  double own(double distance) const { return distance * perUnit; }
  double world(double distance) const { return distance * unit; }
};

}  // namespace nephele

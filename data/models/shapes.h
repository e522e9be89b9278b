#pragma once

#include "nephele/modeling/base/math.h"

namespace nephele {

/// An orthonormal frame at a place: forward, up and side of a part of a body.
struct Frame {
  Vec3d origin;
  Vec3d x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
  Vec3d operator()(const Vec3d& p) const {
    const Vec3d d = p - origin;
    return {dot(d, x), dot(d, y), dot(d, z)};
  }
};

/// `y` along `up`, `x` as near to `forward` as that leaves it.
Frame frameAt(const Vec3d& origin, const Vec3d& up, const Vec3d& forward);

/// Nearly the distance to an ellipsoid about the origin, positive inside.
double ellipsoid(const Vec3d& p, const Vec3d& radii);

double ball(const Vec3d& p, const Vec3d& center, double radius);

/// From a ball to another, with the cone between them.
double limb(const Vec3d& p, const Vec3d& a, double radiusA, const Vec3d& b, double radiusB);

}  // namespace nephele

#pragma once

#include <array>
#include <string>

#include "nephele/modeling/base/math.h"

namespace nephele {

/// Which of three angles about x, y and z turns first, second and third, about axes that stay where they are:
/// "ZXY" turns about z, then x, then y, so that its matrix is Ry Rx Rz.
class RotationOrder {
 public:
  /// ZXY, the order of Nuke's cameras: roll, then tilt, then pan.
  RotationOrder() = default;
  /// The order called `name`: XYZ, XZY, YXZ, YZX, ZXY or ZYX, in either case. @throws Error for others.
  static RotationOrder parse(const std::string& name);

  std::string name() const;
  /// Axis 0, 1 or 2 of the first, second and third turn.
  const std::array<int, 3>& axes() const { return axes_; }

 private:
  std::array<int, 3> axes_{2, 0, 1};
};

/// A rotation of space as a unit quaternion, w + (x, y, z).
class Rotation {
 public:
  /// None.
  Rotation() = default;
  /// Right-handed turn by `radians` about `axis`, which need not have length 1; none about a zero axis.
  static Rotation about(const Vec3d& axis, double radians);
  /// Turns by `degrees.x` about x, `degrees.y` about y and `degrees.z` about z, one after another.
  static Rotation euler(const Vec3d& degrees, const RotationOrder& order);
  /// The one that takes x, y and z to `x`, `y` and cross(x, y): perpendicular unit vectors.
  static Rotation ofAxes(const Vec3d& x, const Vec3d& y);

  /// `v`, turned.
  Vec3d operator()(const Vec3d& v) const;
  Rotation inverse() const { return Rotation(w_, -v_); }
  /// Angles that `euler` makes this rotation of; the last one is 0 where the first and last are not apart.
  Vec3d eulerDegrees(const RotationOrder& order) const;

  /// First `b`, then `a`.
  friend Rotation operator*(const Rotation& a, const Rotation& b) {
    return Rotation(a.w_ * b.w_ - dot(a.v_, b.v_), b.v_ * a.w_ + a.v_ * b.w_ + cross(a.v_, b.v_));
  }
  /// From `a` at s = 0 to `b` at s = 1, turning evenly about one axis the shorter way; goes on beyond them.
  friend Rotation slerp(const Rotation& a, const Rotation& b, double s);

 private:
  Rotation(double w, const Vec3d& v) : w_(w), v_(v) {}

  double w_ = 1;
  Vec3d v_{};
};

Rotation slerp(const Rotation& a, const Rotation& b, double s);

}  // namespace nephele

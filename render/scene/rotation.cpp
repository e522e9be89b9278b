// Rotations: quaternions, and the three angles of animation files.
//
// Angles of a matrix R = Rc Rb Ra (a turns first), s = 1 if (a, b, c) is a cyclic order of (x, y, z), else
// -1: sin b = -s R[c][a], tan a = s R[c][b] / R[c][c], tan c = s R[b][a] / R[a][a].
#include "nephele/render/scene/rotation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"

namespace nephele {

namespace {
constexpr double kDegree = 3.14159265358979323846 / 180.0;
}

RotationOrder RotationOrder::parse(const std::string& name) {
  RotationOrder order;
  int seen = 0;
  for (std::size_t i = 0; i != name.size() && i != 3; ++i) {
    order.axes_[i] = std::tolower(static_cast<unsigned char>(name[i])) - 'x';
    if (order.axes_[i] >= 0 && order.axes_[i] < 3) seen |= 1 << order.axes_[i];
  }
  require(
      name.size() == 3 && seen == 7,
      fmt::format("rotation order: expected XYZ, XZY, YXZ, YZX, ZXY or ZYX, got '{}'", printable(name, 60)));
  return order;
}

std::string RotationOrder::name() const {
  std::string result;
  for (const int axis : axes_) result += char('X' + axis);
  return result;
}

Rotation Rotation::about(const Vec3d& axis, double radians) {
  return Rotation(std::cos(0.5 * radians), normalize(axis) * std::sin(0.5 * radians));
}

Rotation Rotation::euler(const Vec3d& degrees, const RotationOrder& order) {
  Rotation result;
  for (const int axis : order.axes()) {
    Vec3d unit;
    unit[axis] = 1;
    result = about(unit, degrees[axis] * kDegree) * result;
  }
  return result;
}

Rotation Rotation::ofAxes(const Vec3d& x, const Vec3d& y) {
  const Vec3d z = cross(x, y);
  // The largest of the four components first, so that no root is taken of a small difference.
  const double squares[] = {1 + x.x + y.y + z.z, 1 + x.x - y.y - z.z, 1 - x.x + y.y - z.z,
                            1 - x.x - y.y + z.z};
  const auto largest = std::max_element(std::begin(squares), std::end(squares)) - std::begin(squares);
  const double root = std::sqrt(squares[largest]), f = 0.5 / root;
  if (largest == 0) return Rotation(0.5 * root, Vec3d{y.z - z.y, z.x - x.z, x.y - y.x} * f);
  if (largest == 1) return Rotation((y.z - z.y) * f, {0.5 * root, (x.y + y.x) * f, (x.z + z.x) * f});
  if (largest == 2) return Rotation((z.x - x.z) * f, {(x.y + y.x) * f, 0.5 * root, (y.z + z.y) * f});
  return Rotation((x.y - y.x) * f, {(x.z + z.x) * f, (y.z + z.y) * f, 0.5 * root});
}

Vec3d Rotation::operator()(const Vec3d& v) const {
  const Vec3d t = cross(v_, v) * 2.0;
  return v + t * w_ + cross(v_, t);
}

Vec3d Rotation::eulerDegrees(const RotationOrder& order) const {
  const auto [a, b, c] = order.axes();
  const double s = (a + 1) % 3 == b ? 1 : -1;
  Vec3d column[3];
  for (int axis = 0; axis != 3; ++axis) {
    Vec3d unit;
    unit[axis] = 1;
    column[axis] = (*this)(unit);
  }
  const auto r = [&](int row, int col) { return column[col][row]; };
  const double sine = std::clamp(-s * r(c, a), -1.0, 1.0);
  Vec3d angles;
  angles[b] = std::asin(sine);
  if (std::fabs(sine) < 1 - 1e-12) {
    angles[a] = std::atan2(s * r(c, b), r(c, c));
    angles[c] = std::atan2(s * r(b, a), r(a, a));
  } else {
    angles[a] = std::atan2(-s * r(b, c), r(b, b));
  }
  return angles / kDegree;
}

Rotation slerp(const Rotation& a, const Rotation& b, double s) {
  const Rotation turn = b * a.inverse();
  const double w = turn.w_ < 0 ? -turn.w_ : turn.w_;
  const Vec3d v = turn.w_ < 0 ? -turn.v_ : turn.v_;
  const double sine = length(v);
  if (sine < 1e-12) return a;
  const Rotation part = Rotation::about(v, 2 * s * std::atan2(sine, w));
  const Rotation result = part * a;
  const double size = std::sqrt(result.w_ * result.w_ + dot(result.v_, result.v_));
  return Rotation(result.w_ / size, result.v_ / size);
}

}  // namespace nephele

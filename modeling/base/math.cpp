#include "nephele/modeling/base/math.h"

#include "nephele/modeling/base/error.h"

namespace nephele {

Mat3f Mat3f::rotation(const Vec3f& axis, float radians) {
  require(length(axis) > 0, "rotation: the axis must not be zero");
  const Vec3f a = normalize(axis);
  const float c = std::cos(radians), s = std::sin(radians), t = 1 - c;
  return {{t * a.x * a.x + c, t * a.x * a.y - s * a.z, t * a.x * a.z + s * a.y,  //
           t * a.x * a.y + s * a.z, t * a.y * a.y + c, t * a.y * a.z - s * a.x,  //
           t * a.x * a.z - s * a.y, t * a.y * a.z + s * a.x, t * a.z * a.z + c}};
}

Mat3f operator*(const Mat3f& a, const Mat3f& b) {
  Mat3f result;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) result(r, c) = a(r, 0) * b(0, c) + a(r, 1) * b(1, c) + a(r, 2) * b(2, c);
  return result;
}

Vec3f operator*(const Mat3f& a, const Vec3f& v) {
  return {a(0, 0) * v.x + a(0, 1) * v.y + a(0, 2) * v.z, a(1, 0) * v.x + a(1, 1) * v.y + a(1, 2) * v.z,
          a(2, 0) * v.x + a(2, 1) * v.y + a(2, 2) * v.z};
}

Mat3f transpose(const Mat3f& a) {
  return {{a(0, 0), a(1, 0), a(2, 0), a(0, 1), a(1, 1), a(2, 1), a(0, 2), a(1, 2), a(2, 2)}};
}

float determinant(const Mat3f& a) {
  return a(0, 0) * (a(1, 1) * a(2, 2) - a(1, 2) * a(2, 1)) -
         a(0, 1) * (a(1, 0) * a(2, 2) - a(1, 2) * a(2, 0)) +
         a(0, 2) * (a(1, 0) * a(2, 1) - a(1, 1) * a(2, 0));
}

Mat3f inverse(const Mat3f& a) {
  const float d = determinant(a);
  require(d != 0 && std::isfinite(d), "inverse: the matrix is singular");
  const float s = 1 / d;
  return {{(a(1, 1) * a(2, 2) - a(1, 2) * a(2, 1)) * s, (a(0, 2) * a(2, 1) - a(0, 1) * a(2, 2)) * s,
           (a(0, 1) * a(1, 2) - a(0, 2) * a(1, 1)) * s, (a(1, 2) * a(2, 0) - a(1, 0) * a(2, 2)) * s,
           (a(0, 0) * a(2, 2) - a(0, 2) * a(2, 0)) * s, (a(0, 2) * a(1, 0) - a(0, 0) * a(1, 2)) * s,
           (a(1, 0) * a(2, 1) - a(1, 1) * a(2, 0)) * s, (a(0, 1) * a(2, 0) - a(0, 0) * a(2, 1)) * s,
           (a(0, 0) * a(1, 1) - a(0, 1) * a(1, 0)) * s}};
}

Affine inverse(const Affine& a) {
  const Mat3f linear = inverse(a.linear);
  return {linear, -(linear * a.translation)};
}

}  // namespace nephele

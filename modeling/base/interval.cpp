// Interval arithmetic for ranges of fields.
//
// Floats round to nearest, and rounding is monotone: an end point computed with the same operation as the
// values already bounds them. Results that are not exact are still moved one float outward, so that a range
// also holds what another evaluation order or a fused operation gives. Exact results stay: products with 0
// are exactly 0, which lets restriction fold them.
//
// An interval other than everything() promises that there is no NaN. An end at infinity counts as a value
// that may occur, so that 0 * inf and inf - inf give everything().
#include "nephele/modeling/base/interval.h"

#include <bit>
#include <cmath>
#include <cstdint>

namespace nephele {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

float nextUp(float v) {
  if (!(v < kInfinity)) return v;
  if (v == 0) return std::numeric_limits<float>::denorm_min();
  const auto bits = std::bit_cast<std::uint32_t>(v);
  return std::bit_cast<float>(v > 0 ? bits + 1 : bits - 1);
}

float nextDown(float v) {
  return -nextUp(-v);
}

/// `exact` rounded to the float at or below (above) it, one float further if it is no float.
float lower(double exact) {
  const float f = float(exact);
  return double(f) == exact ? f : nextDown(f);
}
float upper(double exact) {
  const float f = float(exact);
  return double(f) == exact ? f : nextUp(f);
}

Interval enclosing(double lo, double hi) {
  if (!(lo <= hi)) return Interval::everything();
  return {lower(lo), upper(hi)};
}

}  // namespace

Interval operator+(const Interval& a, const Interval& b) {
  if ((a.max == kInfinity && b.min == -kInfinity) || (a.min == -kInfinity && b.max == kInfinity))
    return Interval::everything();
  return enclosing(double(a.min) + double(b.min), double(a.max) + double(b.max));
}

Interval operator-(const Interval& a, const Interval& b) {
  return a + (-b);
}

Interval operator-(const Interval& a) {
  return {-a.max, -a.min};
}

Interval operator*(const Interval& a, const Interval& b) {
  const double p[4] = {double(a.min) * b.min, double(a.min) * b.max, double(a.max) * b.min,
                       double(a.max) * b.max};
  const bool aInfinite = a.min == -kInfinity || a.max == kInfinity;
  const bool bInfinite = b.min == -kInfinity || b.max == kInfinity;
  if ((aInfinite && b.contains(0.0f)) || (bInfinite && a.contains(0.0f))) return Interval::everything();
  return enclosing(std::fmin(std::fmin(p[0], p[1]), std::fmin(p[2], p[3])),
                   std::fmax(std::fmax(p[0], p[1]), std::fmax(p[2], p[3])));
}

Interval operator/(const Interval& a, const Interval& b) {
  if (b.contains(0.0f)) return Interval::everything();
  const bool aInfinite = a.min == -kInfinity || a.max == kInfinity;
  const bool bInfinite = b.min == -kInfinity || b.max == kInfinity;
  if (aInfinite && bInfinite) return Interval::everything();
  const double q[4] = {double(a.min) / b.min, double(a.min) / b.max, double(a.max) / b.min,
                       double(a.max) / b.max};
  return enclosing(std::fmin(std::fmin(q[0], q[1]), std::fmin(q[2], q[3])),
                   std::fmax(std::fmax(q[0], q[1]), std::fmax(q[2], q[3])));
}

Interval abs(const Interval& a) {
  if (a == Interval::everything()) return a;
  if (a.min >= 0) return a;
  if (a.max <= 0) return -a;
  return {0.0f, a.magnitude()};
}

Interval min(const Interval& a, const Interval& b) {
  return {a.min < b.min ? a.min : b.min, a.max < b.max ? a.max : b.max};
}

Interval max(const Interval& a, const Interval& b) {
  return {a.min > b.min ? a.min : b.min, a.max > b.max ? a.max : b.max};
}

Interval square(const Interval& a) {
  if (a == Interval::everything()) return a;
  const Interval m = abs(a);
  return enclosing(double(m.min) * m.min, double(m.max) * m.max);
}

Interval sqrt(const Interval& a) {
  if (!(a.min >= 0)) return Interval::everything();
  return enclosing(std::sqrt(double(a.min)), std::sqrt(double(a.max)));
}

}  // namespace nephele

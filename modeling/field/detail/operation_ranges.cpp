// Ranges of scalar operations: monotone pieces by their ends, in double and widened by the rounding of the
// lane kernels; everything where an argument may leave the operation's domain.
#include "nephele/modeling/field/detail/operation_ranges.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace nephele::detail {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// From f(lo) to f(hi) of a rising function that is known to a relative 1e-6.
template <class F>
Interval rising(const F& f, const Interval& a) {
  const double lo = f(double(a.min)), hi = f(double(a.max));
  if (!(lo <= hi)) return Interval::everything();
  const auto slack = [](double x) { return std::isfinite(x) ? std::abs(x) * 1e-6 + 1e-44 : 0; };
  return {float(lo - slack(lo)), float(hi + slack(hi))};
}

Interval sineRange(const Interval& a, double shift) {
  constexpr double kTurn = 6.283185307179586;
  constexpr double kSlack = 1e-6;
  if (!(std::isfinite(a.min) && std::isfinite(a.max))) return Interval::everything();
  const double lo = double(a.min) + shift, hi = double(a.max) + shift;
  // A crest (trough) lies inside if a whole number lies between the ends counted in turns from it.
  const auto hasPeak = [&](double at) {
    return std::floor((hi - at) / kTurn) >= std::ceil((lo - at) / kTurn);
  };
  const double s0 = std::sin(lo), s1 = std::sin(hi);
  const double min = hasPeak(-kTurn / 4) ? -1.0 : std::min(s0, s1);
  const double max = hasPeak(kTurn / 4) ? 1.0 : std::max(s0, s1);
  return {float(min - kSlack), float(max + kSlack)};
}

Interval tangentRange(const Interval& a) {
  constexpr double kHalfTurn = 3.141592653589793;
  const double branch = std::floor(double(a.min) / kHalfTurn + 0.5);
  if (!std::isfinite(a.min) || !std::isfinite(a.max) || branch != std::floor(double(a.max) / kHalfTurn + 0.5))
    return Interval::everything();
  return rising([](double x) { return std::tan(x); }, a);
}

Interval powerRange(const Interval& a, const Interval& b) {
  const auto bound = [](const Interval& x, const Interval& y) {
    Interval r{kInfinity, -kInfinity};
    for (const float u : {x.min, x.max})
      for (const float v : {y.min, y.max}) {
        const double z = std::pow(double(u), double(v));
        if (z != z) return Interval::everything();
        r = {std::min(r.min, float(z * (1 - 1e-6) - 1e-44)), std::max(r.max, float(z * (1 + 1e-6) + 1e-44))};
      }
    return Interval{std::max(r.min, 0.0f), r.max};
  };
  // Rising or falling in each argument alone, so that the corners bound it.
  if (a.min >= 0) return b == Interval::everything() ? b : bound(a, b);
  const bool whole = b.isPoint() && std::floor(b.min) == b.min && std::abs(b.min) < 1e6f;
  if (!whole || (b.min < 0 && a.max >= 0) || a == Interval::everything()) return Interval::everything();
  if (std::fmod(b.min, 2.0f) == 0) return bound(nephele::abs(a), b);
  const Interval below = -bound({a.max < 0 ? -a.max : 0.0f, -a.min}, b);
  return a.max < 0 ? below : below.hull(bound({0.0f, a.max}, b));
}

}  // namespace

Interval rangeOf(Unary op, const Parameters& p, const Interval& a) {
  const auto value = [&](float x) { return scalarValue(op, p, x); };
  switch (op) {
    case Unary::negate:
      return -a;
    case Unary::mask:
    case Unary::clamp:
      return {value(a.min), value(a.max)};
    case Unary::smoothstep: {
      if (a == Interval::everything()) return {0.0f, 1.0f};
      // Between its flat ends the polynomial rounds, so that it is rising only up to a few floats.
      const float lo = value(a.min), hi = value(a.max);
      return {lo > 0 && lo < 1 ? std::max(0.0f, lo - 1e-6f) : lo,
              hi > 0 && hi < 1 ? std::min(1.0f, hi + 1e-6f) : hi};
    }
    default:
      break;
  }
  if (a == Interval::everything()) return a;
  switch (op) {
    case Unary::absolute:
      return nephele::abs(a);
    case Unary::square:
      return nephele::square(a);
    case Unary::squareRoot:
      return nephele::sqrt(a);
    case Unary::exponential:
      return nephele::max(rising([](double x) { return std::exp(x); }, a), Interval::of(0.0f));
    case Unary::logarithm:
      return a.min >= 0 ? rising([](double x) { return std::log(x); }, a) : Interval::everything();
    case Unary::sine:
      return sineRange(a, 0);
    case Unary::cosine:
      return sineRange(a, 1.5707963267948966);
    case Unary::tangent:
      return tangentRange(a);
    case Unary::arcSine:
      return a.min >= -1 && a.max <= 1 ? rising([](double x) { return std::asin(x); }, a)
                                       : Interval::everything();
    case Unary::arcCosine:
      return a.min >= -1 && a.max <= 1 ? -rising([](double x) { return -std::acos(x); }, a)
                                       : Interval::everything();
    case Unary::arcTangent:
      return rising([](double x) { return std::atan(x); }, a);
    case Unary::floor:
      return {std::floor(a.min), std::floor(a.max)};
    default:
      return Interval::everything();
  }
}

Interval rangeOf(Binary op, const Parameters& p, const Interval& a, const Interval& b) {
  switch (op) {
    case Binary::minimum:
      return nephele::min(a, b);
    case Binary::maximum:
      return nephele::max(a, b);
    case Binary::power:
      return powerRange(a, b);
    case Binary::arcTangent2: {
      constexpr float kAbovePi = 3.1415930f;
      return a == Interval::everything() || b == a ? Interval::everything() : Interval{-kAbovePi, kAbovePi};
    }
    case Binary::blend: {
      // Rises in both arguments, up to the rounding of the fillet.
      Interval r = nephele::max(a, b);
      const float slack = 1e-6f * (p.p + (std::isfinite(r.magnitude()) ? r.magnitude() : 0.0f));
      if (std::isfinite(r.min) && std::isfinite(a.min) && std::isfinite(b.min))
        r.min = scalarValue(op, p, a.min, b.min) - slack;
      if (std::isfinite(r.max)) r.max = scalarValue(op, p, a.max, b.max) + 1e-6f * std::abs(r.max) + slack;
      return r;
    }
    default:
      return arithmetic(op, a, b);
  }
}

}  // namespace nephele::detail

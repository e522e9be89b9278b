// The truth of scalar operations: one value at a time, in plain code that lane kernels are tested against.
#include <cmath>

#include "nephele/modeling/field/detail/field_kernels.h"

namespace nephele::detail {

float scalarValue(Unary op, Parameters parameters, float a) {
  const auto [p, q] = parameters;
  switch (op) {
    case Unary::negate:
      return -a;
    case Unary::absolute:
      return std::fabs(a);
    case Unary::square:
      return a * a;
    case Unary::squareRoot:
      return std::sqrt(a);
    case Unary::exponential:
      return std::exp(a);
    case Unary::logarithm:
      return std::log(a);
    case Unary::sine:
      return std::sin(a);
    case Unary::cosine:
      return std::cos(a);
    case Unary::tangent:
      return std::tan(a);
    case Unary::arcSine:
      return std::asin(a);
    case Unary::arcCosine:
      return std::acos(a);
    case Unary::arcTangent:
      return std::atan(a);
    case Unary::floor:
      return std::floor(a);
    case Unary::mask:
      return a > 0 ? 1.0f : 0.0f;
    case Unary::clamp: {
      const float m = a > p ? a : p;
      return m < q ? m : q;
    }
    case Unary::smoothstep: {
      float t = (a - p) * (1 / (q - p));
      t = t > 0 ? t : 0;
      t = t < 1 ? t : 1;
      return t * t * (3 - (t + t));
    }
  }
  return std::nanf("");
}

float scalarValue(Binary op, Parameters parameters, float a, float b) {
  switch (op) {
    case Binary::minimum:
      return a < b || b != b ? a : b;
    case Binary::maximum:
      return a > b || b != b ? a : b;
    case Binary::power:
      return std::pow(a, b);
    case Binary::arcTangent2:
      return std::atan2(a, b);
    case Binary::blend: {
      const float overlap = parameters.p - std::fabs(a - b);
      const float inside = overlap > 0 ? overlap : 0;
      return scalarValue(Binary::maximum, {}, a, b) + inside * inside * (0.25f / parameters.p);
    }
    default:
      return arithmetic(op, a, b);
  }
}

}  // namespace nephele::detail

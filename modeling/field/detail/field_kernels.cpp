// Lane kernels of scalar operations, for every instruction set that the machine may have, chosen when the
// program runs (Highway).
//
// An operation is a struct: `value`, and for the gradient `chain`, which applies the chain rule to one axis.
// Sums and products are never fused, so exactly rounded operations give the same bits on every machine and
// equal the scalar truth. exp, log, sin and cos are polynomials of Highway's math library with the ends of
// their domains mended here; arguments of sin and cos above 39000 go to the C library. Functions that are
// rarely hot (tan, asin, acos, atan, atan2, pow) are plain loops over the C library.
#include "nephele/modeling/field/detail/field_kernels.h"

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "nephele/modeling/base/assertion.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nephele/modeling/field/detail/field_kernels.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as it decides what they define.
#include <hwy/contrib/math/math-inl.h>
#include <hwy/highway.h>

#include "nephele/modeling/base/float_lanes.h"

HWY_BEFORE_NAMESPACE();
namespace nephele::detail::HWY_NAMESPACE {
// Not Ne(a, a), which is false for NaN on some instruction sets.
HWY_INLINE auto isNaN(V a) {
  return hn::Not(hn::Eq(a, a));
}

struct AddOp {
  HWY_INLINE V value(V a, V b) const { return hn::Add(a, b); }
  HWY_INLINE V chain(V, V, V, V ga, V gb) const { return hn::Add(ga, gb); }
};
struct SubtractOp {
  HWY_INLINE V value(V a, V b) const { return hn::Sub(a, b); }
  HWY_INLINE V chain(V, V, V, V ga, V gb) const { return hn::Sub(ga, gb); }
};
struct MultiplyOp {
  HWY_INLINE V value(V a, V b) const { return hn::Mul(a, b); }
  HWY_INLINE V chain(V a, V b, V, V ga, V gb) const { return hn::Add(hn::Mul(b, ga), hn::Mul(a, gb)); }
};
struct DivideOp {
  HWY_INLINE V value(V a, V b) const { return hn::Div(a, b); }
  HWY_INLINE V chain(V, V b, V v, V ga, V gb) const { return hn::Div(hn::Sub(ga, hn::Mul(v, gb)), b); }
};
struct MinimumOp {
  // True where the result is a: a is smaller, or b is NaN.
  static HWY_INLINE auto first(V a, V b) { return hn::Or(hn::Lt(a, b), isNaN(b)); }
  HWY_INLINE V value(V a, V b) const { return hn::IfThenElse(first(a, b), a, b); }
  HWY_INLINE V chain(V a, V b, V, V ga, V gb) const { return hn::IfThenElse(first(a, b), ga, gb); }
};
struct MaximumOp {
  static HWY_INLINE auto first(V a, V b) { return hn::Or(hn::Gt(a, b), isNaN(b)); }
  HWY_INLINE V value(V a, V b) const { return hn::IfThenElse(first(a, b), a, b); }
  HWY_INLINE V chain(V a, V b, V, V ga, V gb) const { return hn::IfThenElse(first(a, b), ga, gb); }
};
struct BlendOp {
  V radius, quarter, half;
  explicit HWY_INLINE BlendOp(Parameters p)
      : radius(constant(p.p)), quarter(constant(0.25f / p.p)), half(constant(0.5f / p.p)) {}
  HWY_INLINE V value(V a, V b) const {
    const V overlap = hn::Sub(radius, hn::Abs(hn::Sub(a, b)));
    const V inside = hn::IfThenElseZero(hn::Gt(overlap, hn::Zero(D())), overlap);
    return hn::Add(MaximumOp().value(a, b), hn::Mul(hn::Mul(inside, inside), quarter));
  }
  HWY_INLINE V chain(V a, V b, V, V ga, V gb) const {
    const V t = hn::Add(constant(0.5f), hn::Mul(hn::Sub(a, b), half));
    const V above = hn::IfThenElseZero(hn::Gt(t, hn::Zero(D())), t);
    const V wa = hn::IfThenElse(hn::Lt(above, constant(1)), above, constant(1));
    return hn::Add(hn::Mul(wa, ga), hn::Mul(hn::Sub(constant(1), wa), gb));
  }
};

struct NegateOp {
  HWY_INLINE V value(V a) const { return hn::Neg(a); }
  HWY_INLINE V chain(V, V, V g) const { return hn::Neg(g); }
};
struct AbsoluteOp {
  HWY_INLINE V value(V a) const { return hn::Abs(a); }
  HWY_INLINE V chain(V a, V, V g) const { return hn::IfThenElse(hn::Lt(a, hn::Zero(D())), hn::Neg(g), g); }
};
struct SquareOp {
  HWY_INLINE V value(V a) const { return hn::Mul(a, a); }
  HWY_INLINE V chain(V a, V, V g) const { return hn::Mul(hn::Add(a, a), g); }
};
struct SquareRootOp {
  HWY_INLINE V value(V a) const { return hn::Sqrt(a); }
  // Infinitely steep at 0, which is nothing to an argument that stays there.
  HWY_INLINE V chain(V, V v, V g) const {
    return hn::IfThenZeroElse(hn::Eq(g, hn::Zero(D())), hn::Mul(hn::Div(constant(0.5f), v), g));
  }
};
struct ExponentialOp {
  HWY_INLINE V value(V a) const {
    // What the polynomial is not made for is replaced first: converting it to integers is undefined.
    const V usual = hn::IfThenElseZero(hn::Lt(hn::Abs(a), constant(110)), a);
    V e = hn::IfThenElse(hn::Gt(a, constant(88.7228317f)), constant(HUGE_VALF), hn::Exp(D(), usual));
    e = hn::IfThenZeroElse(hn::Lt(a, constant(-104)), e);
    return hn::IfThenElse(isNaN(a), a, e);
  }
  HWY_INLINE V chain(V, V v, V g) const { return hn::Mul(v, g); }
};
struct LogarithmOp {
  HWY_INLINE V value(V a) const {
    const V inf = constant(HUGE_VALF), zero = hn::Zero(D());
    const auto usual = hn::And(hn::Gt(a, zero), hn::Lt(a, inf));
    V l = hn::IfThenElse(usual, hn::Log(D(), hn::IfThenElse(usual, a, constant(1))), a);  // +inf and NaN stay
    l = hn::IfThenElse(hn::Eq(a, zero), hn::Neg(inf), l);
    return hn::IfThenElse(hn::Lt(a, zero), constant(std::nanf("")), l);
  }
  HWY_INLINE V chain(V a, V, V g) const { return hn::Div(g, a); }
};

constexpr float kLargestReducible = 39000.0f;

/// `v`, with the lanes whose argument is too large for the polynomial replaced.
template <class F>
HWY_INLINE V mendLarge(V a, V v, F scalar) {
  const V limit = constant(kLargestReducible);
  if (HWY_LIKELY(hn::AllTrue(D(), hn::Le(hn::Abs(a), limit)))) return v;
  HWY_ALIGN float arguments[16];
  HWY_ALIGN float results[16];
  hn::Store(a, D(), arguments);
  hn::Store(v, D(), results);
  for (std::size_t i = 0; i < hn::Lanes(D()); ++i)
    if (!(std::fabs(arguments[i]) <= kLargestReducible)) results[i] = scalar(arguments[i]);
  return hn::Load(D(), results);
}

HWY_INLINE V sine(V a) {
  const V limit = constant(kLargestReducible);
  const V reducible = hn::IfThenElseZero(hn::Le(hn::Abs(a), limit), a);
  return mendLarge(a, hn::Sin(D(), reducible), [](float x) { return std::sin(x); });
}
HWY_INLINE V cosine(V a) {
  const V limit = constant(kLargestReducible);
  const V reducible = hn::IfThenElseZero(hn::Le(hn::Abs(a), limit), a);
  return mendLarge(a, hn::Cos(D(), reducible), [](float x) { return std::cos(x); });
}

struct SineOp {
  HWY_INLINE V value(V a) const { return sine(a); }
  HWY_INLINE V chain(V a, V, V g) const { return hn::Mul(cosine(a), g); }
};
struct CosineOp {
  HWY_INLINE V value(V a) const { return cosine(a); }
  HWY_INLINE V chain(V a, V, V g) const { return hn::Neg(hn::Mul(sine(a), g)); }
};
struct FloorOp {
  HWY_INLINE V value(V a) const { return hn::Floor(a); }
  HWY_INLINE V chain(V, V, V) const { return hn::Zero(D()); }
};
struct MaskOp {
  HWY_INLINE V value(V a) const { return hn::IfThenElseZero(hn::Gt(a, hn::Zero(D())), constant(1)); }
  HWY_INLINE V chain(V, V, V) const { return hn::Zero(D()); }
};
struct ClampOp {
  V low, high;
  explicit HWY_INLINE ClampOp(Parameters p) : low(constant(p.p)), high(constant(p.q)) {}
  HWY_INLINE V value(V a) const {
    const V m = hn::IfThenElse(hn::Gt(a, low), a, low);
    return hn::IfThenElse(hn::Lt(m, high), m, high);
  }
  HWY_INLINE V chain(V a, V, V g) const {
    return hn::IfThenElseZero(hn::And(hn::Gt(a, low), hn::Lt(a, high)), g);
  }
};
struct SmoothstepOp {
  V low, scale;
  explicit HWY_INLINE SmoothstepOp(Parameters p) : low(constant(p.p)), scale(constant(1 / (p.q - p.p))) {}
  HWY_INLINE V parameter(V a) const {
    const V t = hn::Mul(hn::Sub(a, low), scale);
    const V m = hn::IfThenElseZero(hn::Gt(t, hn::Zero(D())), t);
    return hn::IfThenElse(hn::Lt(m, constant(1)), m, constant(1));
  }
  HWY_INLINE V value(V a) const {
    const V t = parameter(a);
    return hn::Mul(hn::Mul(t, t), hn::Sub(constant(3), hn::Add(t, t)));
  }
  HWY_INLINE V chain(V a, V, V g) const {
    const V t = parameter(a);
    const V slope = hn::Mul(hn::Mul(hn::Mul(constant(6), t), hn::Sub(constant(1), t)), scale);
    // Where it is flat, so for an `a` that is no number, a derivative that is none either counts nothing.
    return hn::IfThenElseZero(hn::Ne(slope, hn::Zero(D())), hn::Mul(slope, g));
  }
};

template <class Op>
void unaryLoop(const Op op, const float* a, float* out, int count) {
  const D d;
  for (int i = 0; i < count; i += int(hn::Lanes(d))) hn::Store(op.value(hn::Load(d, a + i)), d, out + i);
}

template <class Op>
void unaryGradLoop(const Op op, const float* a, float* out, float* const g[3], int count) {
  const D d;
  for (int i = 0; i < count; i += int(hn::Lanes(d))) {
    const V x = hn::Load(d, a + i);
    const V v = op.value(x);
    for (int k = 0; k < 3; ++k) hn::Store(op.chain(x, v, hn::Load(d, g[k] + i)), d, g[k] + i);
    hn::Store(v, d, out + i);
  }
}

template <class Op>
void binaryLoop(const Op op, const float* a, const float* b, float* out, int count) {
  const D d;
  for (int i = 0; i < count; i += int(hn::Lanes(d)))
    hn::Store(op.value(hn::Load(d, a + i), hn::Load(d, b + i)), d, out + i);
}

template <class Op>
void binaryGradLoop(const Op op, const float* a, const float* b, float* out, float* const ga[3],
                    const float* const gb[3], int count) {
  const D d;
  for (int i = 0; i < count; i += int(hn::Lanes(d))) {
    const V x = hn::Load(d, a + i), y = hn::Load(d, b + i);
    const V v = op.value(x, y);
    for (int k = 0; k < 3; ++k)
      hn::Store(op.chain(x, y, v, hn::Load(d, ga[k] + i), hn::Load(d, gb[k] + i)), d, ga[k] + i);
    hn::Store(v, d, out + i);
  }
}

/// Calls body(operation) for the operations that have lane kernels.
template <class Body>
void withUnary(Unary op, Parameters p, const Body& body) {
  switch (op) {
    case Unary::negate:
      return body(NegateOp());
    case Unary::absolute:
      return body(AbsoluteOp());
    case Unary::square:
      return body(SquareOp());
    case Unary::squareRoot:
      return body(SquareRootOp());
    case Unary::exponential:
      return body(ExponentialOp());
    case Unary::logarithm:
      return body(LogarithmOp());
    case Unary::sine:
      return body(SineOp());
    case Unary::cosine:
      return body(CosineOp());
    case Unary::floor:
      return body(FloorOp());
    case Unary::mask:
      return body(MaskOp());
    case Unary::clamp:
      return body(ClampOp(p));
    case Unary::smoothstep:
      return body(SmoothstepOp(p));
    case Unary::tangent:
    case Unary::arcSine:
    case Unary::arcCosine:
    case Unary::arcTangent:
      return;
  }
}

template <class Body>
void withBinary(Binary op, Parameters p, const Body& body) {
  switch (op) {
    case Binary::add:
      return body(AddOp());
    case Binary::subtract:
      return body(SubtractOp());
    case Binary::multiply:
      return body(MultiplyOp());
    case Binary::divide:
      return body(DivideOp());
    case Binary::minimum:
      return body(MinimumOp());
    case Binary::maximum:
      return body(MaximumOp());
    case Binary::blend:
      return body(BlendOp(p));
    case Binary::power:
    case Binary::arcTangent2:
      return;
  }
}

void unaryLanes(Unary op, Parameters p, const float* a, float* out, int count) {
  withUnary(op, p, [=](const auto& o) HWY_ATTR { unaryLoop(o, a, out, count); });
}
void unaryGradLanes(Unary op, Parameters p, const float* a, float* out, float* const g[3], int count) {
  withUnary(op, p, [=](const auto& o) HWY_ATTR { unaryGradLoop(o, a, out, g, count); });
}
void binaryLanes(Binary op, Parameters p, const float* a, const float* b, float* out, int count) {
  withBinary(op, p, [=](const auto& o) HWY_ATTR { binaryLoop(o, a, b, out, count); });
}
void binaryGradLanes(Binary op, Parameters p, const float* a, const float* b, float* out, float* const ga[3],
                     const float* const gb[3], int count) {
  withBinary(op, p, [=](const auto& o) HWY_ATTR { binaryGradLoop(o, a, b, out, ga, gb, count); });
}

}  // namespace nephele::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace nephele::detail {

HWY_EXPORT(unaryLanes);
HWY_EXPORT(unaryGradLanes);
HWY_EXPORT(binaryLanes);
HWY_EXPORT(binaryGradLanes);

namespace {

bool isPlainLoop(Unary op) {
  return op >= Unary::tangent && op <= Unary::arcTangent;
}
bool isPlainLoop(Binary op) {
  return op == Binary::power || op == Binary::arcTangent2;
}

/// What lane kernels rely on.
[[maybe_unused]] bool isWholeLanes(const float* lanes, int count) {
  return count >= 0 && count % 16 == 0 && reinterpret_cast<std::uintptr_t>(lanes) % 64 == 0;
}

/// Derivative of the operations that are plain loops; `v` is their value.
float derivative(Unary op, float a, float v) {
  switch (op) {
    case Unary::tangent:
      return 1 + v * v;
    case Unary::arcSine:
      return 1 / std::sqrt(1 - a * a);
    case Unary::arcCosine:
      return -1 / std::sqrt(1 - a * a);
    default:
      return 1 / (1 + a * a);
  }
}

}  // namespace

void apply(Unary op, Parameters parameters, const float* a, float* out, int count) {
  NEPHELE_ASSERT(isWholeLanes(out, count));
  if (!isPlainLoop(op)) {
    HWY_DYNAMIC_DISPATCH(unaryLanes)(op, parameters, a, out, count);
    return;
  }
  for (int i = 0; i < count; ++i) out[i] = scalarValue(op, parameters, a[i]);
}

void applyGrad(Unary op, Parameters parameters, const float* a, float* out, float* const g[3], int count) {
  NEPHELE_ASSERT(isWholeLanes(out, count));
  if (!isPlainLoop(op)) {
    HWY_DYNAMIC_DISPATCH(unaryGradLanes)(op, parameters, a, out, g, count);
    return;
  }
  for (int i = 0; i < count; ++i) {
    const float v = scalarValue(op, parameters, a[i]);
    const float slope = derivative(op, a[i], v);
    for (int k = 0; k < 3; ++k) g[k][i] *= slope;
    out[i] = v;
  }
}

void apply(Binary op, Parameters parameters, const float* a, const float* b, float* out, int count) {
  NEPHELE_ASSERT(isWholeLanes(out, count));
  if (!isPlainLoop(op)) {
    HWY_DYNAMIC_DISPATCH(binaryLanes)(op, parameters, a, b, out, count);
    return;
  }
  for (int i = 0; i < count; ++i) out[i] = scalarValue(op, parameters, a[i], b[i]);
}

void applyGrad(Binary op, Parameters parameters, const float* a, const float* b, float* out,
               float* const ga[3], const float* const gb[3], int count) {
  NEPHELE_ASSERT(isWholeLanes(out, count));
  if (!isPlainLoop(op)) {
    HWY_DYNAMIC_DISPATCH(binaryGradLanes)(op, parameters, a, b, out, ga, gb, count);
    return;
  }
  for (int i = 0; i < count; ++i) {
    const float x = a[i], y = b[i];
    float da, db;
    if (op == Binary::power) {
      da = y == 0 ? 0 : y * std::pow(x, y - 1);
      // Where x <= 0 only whole constant exponents make sense, and those do not vary.
      db = x > 0 ? std::pow(x, y) * std::log(x) : 0;
    } else {
      const float s = x * x + y * y;
      da = y / s;
      db = -x / s;
    }
    const auto part = [](float slope, float g) { return g == 0 ? 0 : slope * g; };
    for (int k = 0; k < 3; ++k) ga[k][i] = part(da, ga[k][i]) + part(db, gb[k][i]);
    out[i] = scalarValue(op, parameters, x, y);
  }
}

}  // namespace nephele::detail
#endif  // HWY_ONCE

// Arithmetic and functions of fields as nodes.
//
// A scalar operation is known in two places: its values and derivatives in field_kernels.cpp, its range here.
// Vector operations are built from those: component by component, from a table of products (dot, cross,
// matrix products), or by choosing lanes. Parts write straight into the lanes of the result wherever that
// saves a copy.
//
// Restriction first restricts the parts, then looks at their ranges: an operation that is settled by them
// becomes a constant or one of its parts. Ranges of exact operations are as tight as interval arithmetic
// allows; shared parts are treated as if they varied independently.
#include "nephele/modeling/field/operations.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/constant_node.h"
#include "nephele/modeling/field/detail/field_kernels.h"
#include "nephele/modeling/shape/combinations.h"

namespace nephele {
namespace {

using detail::Binary;
using detail::component;
using detail::constantFrom;
using detail::ConstantNode;
using detail::constantOf;
using detail::Parameters;
using detail::rangeComponent;
using detail::Unary;
using Frame = Scratch::Frame;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

template <class T>
NodePtr<T> constantNode(const T& value) {
  return std::make_shared<ConstantNode<T>>(value);
}

// ---- Ranges of scalar operations

/// From f(lo) to f(hi) of a rising function that is known to a relative 1e-6.
template <class F>
Interval rising(const F& f, const Interval& a) {
  const double lo = f(double(a.min)), hi = f(double(a.max));
  if (!(lo <= hi)) return Interval::everything();
  return {float(lo - std::abs(lo) * 1e-6 - 1e-44), float(hi + std::abs(hi) * 1e-6 + 1e-44)};
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

Interval rangeOf(Unary op, const Parameters& p, const Interval& a) {
  const auto value = [&](float x) { return detail::scalarValue(op, p, x); };
  switch (op) {
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
    case Unary::negate:
      return -a;
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

Interval rangeOf(Binary op, const Parameters& p, const Interval& a, const Interval& b) {
  switch (op) {
    case Binary::add:
      return a + b;
    case Binary::subtract:
      return a - b;
    case Binary::multiply:
      return a * b;
    case Binary::divide:
      return a / b;
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
        r.min = detail::scalarValue(op, p, a.min, b.min) - slack;
      if (std::isfinite(r.max))
        r.max = detail::scalarValue(op, p, a.max, b.max) + 1e-6f * std::abs(r.max) + slack;
      return r;
    }
  }
  return Interval::everything();
}

// ---- Scalar operations

NodePtr<float> unary(Unary op, const Parameters& p, NodePtr<float> a);
NodePtr<float> binary(Binary op, const Parameters& p, NodePtr<float> a, NodePtr<float> b);

class UnaryNode final : public FieldNode<float> {
 public:
  UnaryNode(Unary op, const Parameters& p, NodePtr<float> a) : op_(op), p_(p), a_(std::move(a)) {}

  void eval(const PointBlock& points, const BlockLanes<1>& values, Scratch& scratch) const override {
    a_->eval(points, values, scratch);
    detail::apply(op_, p_, values[0], values[0], points.paddedCount());
  }
  void evalGrad(const PointBlock& points, const BlockLanes<1>& values, const BlockLanes<3>& grads,
                Scratch& scratch) const override {
    a_->evalGrad(points, values, grads, scratch);
    detail::applyGrad(op_, p_, values[0], values[0], grads.data(), points.paddedCount());
  }
  Interval range(const Box& box) const override { return rangeOf(op_, p_, a_->range(box)); }
  NodePtr<float> restricted(Restriction& restriction) const override {
    const NodePtr<float> a = restrictNode(a_, restriction);
    const Interval r = a->range(restriction.box);
    if (auto constant = constantFrom<float>(rangeOf(op_, p_, r))) return constant;
    if (op_ == Unary::absolute && r.min >= 0) return a;
    if (op_ == Unary::absolute && r.max <= 0) return unary(Unary::negate, {}, a);
    if (op_ == Unary::clamp && r.min >= p_.p && r.max <= p_.q) return a;
    return a == a_ ? nullptr : unary(op_, p_, a);
  }
  float differenceStep() const override { return a_->differenceStep(); }

 private:
  Unary op_;
  Parameters p_;
  NodePtr<float> a_;
};

class BinaryNode final : public FieldNode<float> {
 public:
  BinaryNode(Binary op, const Parameters& p, NodePtr<float> a, NodePtr<float> b)
      : op_(op), p_(p), a_(std::move(a)), b_(std::move(b)) {}

  void eval(const PointBlock& points, const BlockLanes<1>& values, Scratch& scratch) const override {
    Frame frame(scratch);
    float* const b = frame.lane();
    a_->eval(points, values, scratch);
    b_->eval(points, {b}, scratch);
    detail::apply(op_, p_, values[0], b, values[0], points.paddedCount());
  }
  void evalGrad(const PointBlock& points, const BlockLanes<1>& values, const BlockLanes<3>& grads,
                Scratch& scratch) const override {
    Frame frame(scratch);
    float* const b = frame.lane();
    const BlockLanes<3> gb = frame.lanes<3>();
    a_->evalGrad(points, values, grads, scratch);
    b_->evalGrad(points, {b}, gb, scratch);
    detail::applyGrad(op_, p_, values[0], b, values[0], grads.data(), gb.data(), points.paddedCount());
  }
  Interval range(const Box& box) const override { return rangeOf(op_, p_, a_->range(box), b_->range(box)); }
  NodePtr<float> restricted(Restriction& restriction) const override {
    const NodePtr<float> a = restrictNode(a_, restriction), b = restrictNode(b_, restriction);
    const Interval ra = a->range(restriction.box), rb = b->range(restriction.box);
    if (auto constant = constantFrom<float>(rangeOf(op_, p_, ra, rb))) return constant;
    if (op_ == Binary::minimum || op_ == Binary::maximum || op_ == Binary::blend) {
      const bool larger = op_ != Binary::minimum;
      const float margin = op_ == Binary::blend ? p_.p : 0.0f;
      if (ra.min >= rb.max + margin) return larger ? a : b;
      if (rb.min >= ra.max + margin) return larger ? b : a;
    }
    return a == a_ && b == b_ ? nullptr : binary(op_, p_, a, b);
  }
  float differenceStep() const override { return std::min(a_->differenceStep(), b_->differenceStep()); }

 private:
  Binary op_;
  Parameters p_;
  NodePtr<float> a_, b_;
};

NodePtr<float> unary(Unary op, const Parameters& p, NodePtr<float> a) {
  if (const float* c = constantOf(a)) return constantNode(detail::scalarValue(op, p, *c));
  return std::make_shared<UnaryNode>(op, p, std::move(a));
}

NodePtr<float> binary(Binary op, const Parameters& p, NodePtr<float> a, NodePtr<float> b) {
  const float *ca = constantOf(a), *cb = constantOf(b);
  if (ca && cb) return constantNode(detail::scalarValue(op, p, *ca, *cb));
  if (cb && *cb == 0 && (op == Binary::add || op == Binary::subtract)) return a;
  if (cb && *cb == 1 && (op == Binary::multiply || op == Binary::divide || op == Binary::power)) return a;
  if (cb && *cb == -1 && op == Binary::multiply) return unary(Unary::negate, {}, std::move(a));
  if (ca && *ca == 0 && op == Binary::add) return b;
  if (ca && *ca == 1 && op == Binary::multiply) return b;
  if (ca && *ca == -1 && op == Binary::multiply) return unary(Unary::negate, {}, std::move(b));
  return std::make_shared<BinaryNode>(op, p, std::move(a), std::move(b));
}

ScalarField unaryField(Unary op, const ScalarField& a, const Parameters& p = {}) {
  return ScalarField(unary(op, p, a.node()));
}
ScalarField binaryField(Binary op, const ScalarField& a, const ScalarField& b, const Parameters& p = {}) {
  return ScalarField(binary(op, p, a.node(), b.node()));
}

// ---- Vectors and matrices, component by component

template <class T, class B>
NodePtr<T> componentwise(Binary op, NodePtr<T> a, NodePtr<B> b);

/// op(a_c, b_c) for each component c, or op(a_c, b) with a scalar b.
template <class T, class B>
class ComponentwiseNode final : public FieldNode<T> {
 public:
  static constexpr int kLanes = kComponents<T>;
  static constexpr int kOther = kComponents<B>;

  ComponentwiseNode(Binary op, NodePtr<T> a, NodePtr<B> b) : op_(op), a_(std::move(a)), b_(std::move(b)) {}

  void eval(const PointBlock& points, const BlockLanes<kLanes>& values, Scratch& scratch) const override {
    Frame frame(scratch);
    const auto b = frame.template lanes<kOther>();
    a_->eval(points, values, scratch);
    b_->eval(points, b, scratch);
    for (int c = 0; c < kLanes; ++c)
      detail::apply(op_, {}, values[c], b[other(c)], values[c], points.paddedCount());
  }
  void evalGrad(const PointBlock& points, const BlockLanes<kLanes>& values,
                const BlockLanes<3 * kLanes>& grads, Scratch& scratch) const override {
    Frame frame(scratch);
    const auto b = frame.template lanes<kOther>();
    const auto gb = frame.template lanes<3 * kOther>();
    a_->evalGrad(points, values, grads, scratch);
    b_->evalGrad(points, b, gb, scratch);
    for (int c = 0; c < kLanes; ++c)
      detail::applyGrad(op_, {}, values[c], b[other(c)], values[c], grads.data() + 3 * c,
                        gb.data() + 3 * other(c), points.paddedCount());
  }
  RangeOf<T> range(const Box& box) const override {
    const RangeOf<T> a = a_->range(box);
    const RangeOf<B> b = b_->range(box);
    RangeOf<T> result;
    for (int c = 0; c < kLanes; ++c)
      rangeComponent(result, c) = rangeOf(op_, {}, rangeComponent(a, c), rangeComponent(b, other(c)));
    return result;
  }
  NodePtr<T> restricted(Restriction& restriction) const override {
    const auto a = restrictNode(a_, restriction);
    const auto b = restrictNode(b_, restriction);
    if (a == a_ && b == b_) return nullptr;
    auto result = componentwise<T, B>(op_, a, b);
    if (auto constant = constantFrom<T>(result->range(restriction.box))) return constant;
    return result;
  }
  float differenceStep() const override { return std::min(a_->differenceStep(), b_->differenceStep()); }

 private:
  static int other(int c) { return kOther == 1 ? 0 : c; }

  Binary op_;
  NodePtr<T> a_;
  NodePtr<B> b_;
};

template <class T, class B>
NodePtr<T> componentwise(Binary op, NodePtr<T> a, NodePtr<B> b) {
  const T* ca = constantOf(a);
  const B* cb = constantOf(b);
  if (ca && cb) {
    T value{};
    for (int c = 0; c < kComponents<T>; ++c)
      component(value, c) =
          detail::scalarValue(op, {}, component(*ca, c), component(*cb, kComponents<B> == 1 ? 0 : c));
    return constantNode(value);
  }
  return std::make_shared<ComponentwiseNode<T, B>>(op, std::move(a), std::move(b));
}

// ---- Products of vectors and matrices

/// result[r] += sign a[i] b[j]
struct Term {
  int r, i, j;
  float sign = 1;
};

using Terms = std::span<const Term>;

constexpr Term kDot[] = {{0, 0, 0}, {0, 1, 1}, {0, 2, 2}};
constexpr Term kCross[] = {{0, 1, 2}, {0, 2, 1, -1}, {1, 2, 0}, {1, 0, 2, -1}, {2, 0, 1}, {2, 1, 0, -1}};
constexpr Term kMatrixVector[] = {{0, 0, 0}, {0, 1, 1}, {0, 2, 2}, {1, 3, 0}, {1, 4, 1},
                                  {1, 5, 2}, {2, 6, 0}, {2, 7, 1}, {2, 8, 2}};
constexpr auto kMatrixMatrix = [] {
  std::array<Term, 27> terms{};
  for (int r = 0, n = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c)
      for (int k = 0; k < 3; ++k) terms[n++] = {3 * r + c, 3 * r + k, 3 * k + c};
  return terms;
}();

template <class R, class A, class B>
NodePtr<R> bilinear(Terms terms, NodePtr<A> a, NodePtr<B> b);

/// A sum of products of components of a and b; terms of one result component stand together.
template <class R, class A, class B>
class BilinearNode final : public FieldNode<R> {
 public:
  static constexpr int kLanes = kComponents<R>;

  BilinearNode(Terms terms, NodePtr<A> a, NodePtr<B> b) : terms_(terms), a_(std::move(a)), b_(std::move(b)) {}

  void eval(const PointBlock& points, const BlockLanes<kLanes>& values, Scratch& scratch) const override {
    Frame frame(scratch);
    const auto a = frame.template lanes<kComponents<A>>();
    a_->eval(points, a, scratch);
    if constexpr (std::is_same_v<A, B>)
      if (a_ == b_) return combine(a, a, values, points.paddedCount());
    const auto b = frame.template lanes<kComponents<B>>();
    b_->eval(points, b, scratch);
    combine(a, b, values, points.paddedCount());
  }
  void evalGrad(const PointBlock& points, const BlockLanes<kLanes>& values,
                const BlockLanes<3 * kLanes>& grads, Scratch& scratch) const override {
    Frame frame(scratch);
    const auto a = frame.template lanes<kComponents<A>>();
    const auto b = frame.template lanes<kComponents<B>>();
    const auto ga = frame.template lanes<3 * kComponents<A>>();
    const auto gb = frame.template lanes<3 * kComponents<B>>();
    a_->evalGrad(points, a, ga, scratch);
    b_->evalGrad(points, b, gb, scratch);
    const int n = points.paddedCount();
    combine(a, b, values, n);
    int before = -1;
    for (const Term& t : terms_) {
      for (int k = 0; k < 3; ++k) {
        detail::product(ga[3 * t.i + k], b[t.j], t.sign, t.r == before, grads[3 * t.r + k], n);
        detail::product(a[t.i], gb[3 * t.j + k], t.sign, true, grads[3 * t.r + k], n);
      }
      before = t.r;
    }
  }
  RangeOf<R> range(const Box& box) const override {
    const RangeOf<A> a = a_->range(box);
    const RangeOf<B> b = b_->range(box);
    const bool same = static_cast<const void*>(a_.get()) == static_cast<const void*>(b_.get());
    RangeOf<R> result;
    int before = -1;
    for (const Term& t : terms_) {
      const Interval& x = rangeComponent(a, t.i);
      Interval p = same && t.i == t.j ? nephele::square(x) : x * rangeComponent(b, t.j);
      if (t.sign < 0) p = -p;
      Interval& r = rangeComponent(result, t.r);
      r = t.r == before ? r + p : p;
      before = t.r;
    }
    return result;
  }
  NodePtr<R> restricted(Restriction& restriction) const override {
    const auto a = restrictNode(a_, restriction);
    const auto b = restrictNode(b_, restriction);
    return a == a_ && b == b_ ? nullptr : bilinear<R, A, B>(terms_, a, b);
  }
  float differenceStep() const override { return std::min(a_->differenceStep(), b_->differenceStep()); }

 private:
  template <std::size_t NA, std::size_t NB>
  void combine(const std::array<float*, NA>& a, const std::array<float*, NB>& b,
               const BlockLanes<kLanes>& values, int n) const {
    int before = -1;
    for (const Term& t : terms_) {
      detail::product(a[t.i], b[t.j], t.sign, t.r == before, values[t.r], n);
      before = t.r;
    }
  }

  Terms terms_;
  NodePtr<A> a_;
  NodePtr<B> b_;
};

template <class R, class A, class B>
NodePtr<R> bilinear(Terms terms, NodePtr<A> a, NodePtr<B> b) {
  const A* ca = constantOf(a);
  const B* cb = constantOf(b);
  if (ca && cb) {
    R value{};
    for (const Term& t : terms) component(value, t.r) += t.sign * component(*ca, t.i) * component(*cb, t.j);
    return constantNode(value);
  }
  return std::make_shared<BilinearNode<R, A, B>>(terms, std::move(a), std::move(b));
}

// ---- Choosing and joining lanes

/// Result component c is component map[c] of a larger value.
template <class R, class A>
class PickNode final : public FieldNode<R> {
 public:
  static constexpr int kLanes = kComponents<R>;
  using Map = std::array<int, kLanes>;

  PickNode(const Map& map, NodePtr<A> a) : map_(map), a_(std::move(a)) {}

  void eval(const PointBlock& points, const BlockLanes<kLanes>& values, Scratch& scratch) const override {
    Frame frame(scratch);
    a_->eval(points, target(frame, values), scratch);
  }
  void evalGrad(const PointBlock& points, const BlockLanes<kLanes>& values,
                const BlockLanes<3 * kLanes>& grads, Scratch& scratch) const override {
    Frame frame(scratch);
    auto g = frame.template lanes<3 * kComponents<A>>();
    for (int c = 0; c < kLanes; ++c)
      for (int k = 0; k < 3; ++k) g[3 * map_[c] + k] = grads[3 * c + k];
    a_->evalGrad(points, target(frame, values), g, scratch);
  }
  RangeOf<R> range(const Box& box) const override {
    const RangeOf<A> a = a_->range(box);
    RangeOf<R> result;
    for (int c = 0; c < kLanes; ++c) rangeComponent(result, c) = rangeComponent(a, map_[c]);
    return result;
  }
  NodePtr<R> restricted(Restriction& restriction) const override {
    const auto a = restrictNode(a_, restriction);
    return a == a_ ? nullptr : make(map_, a);
  }
  float differenceStep() const override { return a_->differenceStep(); }

  static NodePtr<R> make(const Map& map, NodePtr<A> a);

 private:
  BlockLanes<kComponents<A>> target(Frame& frame, const BlockLanes<kLanes>& values) const {
    auto lanes = frame.template lanes<kComponents<A>>();
    for (int c = 0; c < kLanes; ++c) lanes[map_[c]] = values[c];
    return lanes;
  }

  Map map_;
  NodePtr<A> a_;
};

/// Three parts side by side.
template <class R, class A>
class JoinNode final : public FieldNode<R> {
 public:
  static constexpr int kLanes = kComponents<R>;
  static constexpr int kPart = kComponents<A>;

  explicit JoinNode(std::array<NodePtr<A>, 3> parts) : parts_(std::move(parts)) {}

  const std::array<NodePtr<A>, 3>& parts() const { return parts_; }

  void eval(const PointBlock& points, const BlockLanes<kLanes>& values, Scratch& scratch) const override {
    for (int p = 0; p < 3; ++p) parts_[p]->eval(points, slice<kPart>(values, p), scratch);
  }
  void evalGrad(const PointBlock& points, const BlockLanes<kLanes>& values,
                const BlockLanes<3 * kLanes>& grads, Scratch& scratch) const override {
    for (int p = 0; p < 3; ++p)
      parts_[p]->evalGrad(points, slice<kPart>(values, p), slice<3 * kPart>(grads, p), scratch);
  }
  RangeOf<R> range(const Box& box) const override {
    RangeOf<R> result;
    for (int p = 0; p < 3; ++p) {
      const RangeOf<A> part = parts_[p]->range(box);
      for (int c = 0; c < kPart; ++c) rangeComponent(result, p * kPart + c) = rangeComponent(part, c);
    }
    return result;
  }
  NodePtr<R> restricted(Restriction& restriction) const override {
    auto parts = parts_;
    for (auto& part : parts) part = restrictNode(part, restriction);
    return parts == parts_ ? nullptr : make(std::move(parts));
  }
  float differenceStep() const override {
    return std::min({parts_[0]->differenceStep(), parts_[1]->differenceStep(), parts_[2]->differenceStep()});
  }

  static NodePtr<R> make(std::array<NodePtr<A>, 3> parts) {
    R value{};
    bool constant = true;
    for (int p = 0; p < 3; ++p) {
      const A* c = constantOf(parts[p]);
      constant = constant && c;
      for (int k = 0; c && k < kPart; ++k) component(value, p * kPart + k) = component(*c, k);
    }
    if (constant) return constantNode(value);
    return std::make_shared<JoinNode>(std::move(parts));
  }

 private:
  template <int N, std::size_t M>
  static BlockLanes<N> slice(const std::array<float*, M>& lanes, int p) {
    BlockLanes<N> result;
    std::copy_n(lanes.data() + p * N, N, result.data());
    return result;
  }

  std::array<NodePtr<A>, 3> parts_;
};

template <class R, class A>
NodePtr<R> PickNode<R, A>::make(const Map& map, NodePtr<A> a) {
  if (const A* c = constantOf(a)) {
    R value{};
    for (int k = 0; k < kLanes; ++k) component(value, k) = component(*c, map[k]);
    return constantNode(value);
  }
  if constexpr (kComponents<A> == 3 * kLanes)
    if (const auto* join = dynamic_cast<const JoinNode<A, R>*>(a.get()))
      return join->parts()[map[0] / kLanes];
  return std::make_shared<PickNode>(map, std::move(a));
}

// ---- Length and direction

class LengthNode final : public FieldNode<float> {
 public:
  explicit LengthNode(NodePtr<Vec3f> v) : v_(std::move(v)) {}

  void eval(const PointBlock& points, const BlockLanes<1>& values, Scratch& scratch) const override {
    Frame frame(scratch);
    const BlockLanes<3> v = frame.lanes<3>();
    v_->eval(points, v, scratch);
    detail::length3(v.data(), values[0], points.paddedCount());
  }
  void evalGrad(const PointBlock& points, const BlockLanes<1>& values, const BlockLanes<3>& grads,
                Scratch& scratch) const override {
    Frame frame(scratch);
    const BlockLanes<3> v = frame.lanes<3>();
    const BlockLanes<9> g = frame.lanes<9>();
    v_->evalGrad(points, v, g, scratch);
    const int n = points.paddedCount();
    detail::length3(v.data(), values[0], n);
    detail::normalize3(v.data(), values[0], v.data(), n);
    for (int k = 0; k < 3; ++k)
      for (int c = 0; c < 3; ++c) detail::product(v[c], g[3 * c + k], 1, c > 0, grads[k], n);
  }
  Interval range(const Box& box) const override {
    const auto v = v_->range(box);
    return nephele::sqrt(nephele::square(v[0]) + nephele::square(v[1]) + nephele::square(v[2]));
  }
  NodePtr<float> restricted(Restriction& restriction) const override {
    const auto v = restrictNode(v_, restriction);
    if (v == v_) return nullptr;
    if (const Vec3f* c = constantOf(v)) return constantNode(nephele::length(*c));
    return std::make_shared<LengthNode>(v);
  }
  float differenceStep() const override { return v_->differenceStep(); }

 private:
  NodePtr<Vec3f> v_;
};

class NormalizeNode final : public FieldNode<Vec3f> {
 public:
  explicit NormalizeNode(NodePtr<Vec3f> v) : v_(std::move(v)) {}

  void eval(const PointBlock& points, const BlockLanes<3>& values, Scratch& scratch) const override {
    Frame frame(scratch);
    float* const length = frame.lane();
    v_->eval(points, values, scratch);
    detail::length3(values.data(), length, points.paddedCount());
    detail::normalize3(values.data(), length, values.data(), points.paddedCount());
  }
  void evalGrad(const PointBlock& points, const BlockLanes<3>& values, const BlockLanes<9>& grads,
                Scratch& scratch) const override {
    Frame frame(scratch);
    float *const length = frame.lane(), *const along = frame.lane();
    v_->evalGrad(points, values, grads, scratch);
    const int n = points.paddedCount();
    detail::length3(values.data(), length, n);
    detail::normalize3(values.data(), length, values.data(), n);
    for (int k = 0; k < 3; ++k) {
      for (int c = 0; c < 3; ++c) detail::product(values[c], grads[3 * c + k], 1, c > 0, along, n);
      for (int c = 0; c < 3; ++c) detail::product(values[c], along, -1, true, grads[3 * c + k], n);
    }
    for (int k = 0; k < 3; ++k) {
      float* const column[3] = {grads[k], grads[3 + k], grads[6 + k]};
      detail::normalize3(column, length, column, n);
    }
  }
  std::array<Interval, 3> range(const Box& box) const override {
    const auto v = v_->range(box);
    // Lengths that underflow to 0 or overflow give 0 or NaN; only ranges known to be far from both are
    // trusted.
    std::array<Interval, 3> result;
    if (v[0].magnitude() < 1e18f && v[1].magnitude() < 1e18f && v[2].magnitude() < 1e18f)
      result.fill({-1.000001f, 1.000001f});
    for (int c = 0; c < 3; ++c) {
      if (v[c].min >= 0 && result[c].max < 2) result[c].min = 0;
      if (v[c].max <= 0 && result[c].max < 2) result[c].max = 0;
    }
    return result;
  }
  NodePtr<Vec3f> restricted(Restriction& restriction) const override {
    const auto v = restrictNode(v_, restriction);
    if (v == v_) return nullptr;
    if (const Vec3f* c = constantOf(v)) return constantNode(nephele::normalize(*c));
    return std::make_shared<NormalizeNode>(v);
  }
  float differenceStep() const override { return v_->differenceStep(); }

 private:
  NodePtr<Vec3f> v_;
};

// ---- Shared results

std::uint64_t nextSerial() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

template <class T>
class MemoNode final : public FieldNode<T> {
 public:
  static constexpr int kLanes = kComponents<T>;

  explicit MemoNode(NodePtr<T> a) : a_(std::move(a)), serial_(nextSerial()) {}

  void eval(const PointBlock& points, const BlockLanes<kLanes>& values, Scratch& scratch) const override {
    if (const Scratch::MemoEntry* known = find(points, scratch))
      return copy(known->lanes.data(), values, points);
    a_->eval(points, values, scratch);
    keep(points, scratch, false, values);
  }
  void evalGrad(const PointBlock& points, const BlockLanes<kLanes>& values,
                const BlockLanes<3 * kLanes>& grads, Scratch& scratch) const override {
    const Scratch::MemoEntry* known = find(points, scratch);
    if (known && known->hasGradients) {
      copy(known->lanes.data(), values, points);
      return copy(known->lanes.data() + kLanes * kBlockSize, grads, points);
    }
    a_->evalGrad(points, values, grads, scratch);
    float* const rest = keep(points, scratch, true, values);
    for (int c = 0; c < 3 * kLanes; ++c) std::copy_n(grads[c], points.paddedCount(), rest + c * kBlockSize);
  }
  RangeOf<T> range(const Box& box) const override { return a_->range(box); }
  NodePtr<T> restricted(Restriction& restriction) const override {
    const auto a = restrictNode(a_, restriction);
    if (a == a_) return nullptr;
    return constantOf(a) ? a : std::make_shared<MemoNode>(a);
  }
  float differenceStep() const override { return a_->differenceStep(); }

 private:
  const Scratch::MemoEntry* find(const PointBlock& points, Scratch& scratch) const {
    const Scratch::MemoEntry& entry = scratch.memoEntry(serial_);
    return entry.nodeSerial == serial_ && entry.pointsId == points.id ? &entry : nullptr;
  }
  /// Stores the values and returns where the gradients go.
  float* keep(const PointBlock& points, Scratch& scratch, bool withGradients,
              const BlockLanes<kLanes>& values) const {
    Scratch::MemoEntry& entry = scratch.memoEntry(serial_);
    // Room for gradients from the start: a later request must not allocate.
    constexpr std::size_t kRoom = 4 * kLanes * std::size_t(kBlockSize);
    if (entry.lanes.size() < kRoom) entry.lanes.assign(kRoom, 0.0f);
    entry.nodeSerial = serial_;
    entry.pointsId = points.id;
    entry.hasGradients = withGradients;
    for (int c = 0; c < kLanes; ++c)
      std::copy_n(values[c], points.paddedCount(), entry.lanes.data() + c * kBlockSize);
    return entry.lanes.data() + kLanes * kBlockSize;
  }
  template <std::size_t N>
  static void copy(const float* from, const std::array<float*, N>& to, const PointBlock& points) {
    for (std::size_t c = 0; c < N; ++c) std::copy_n(from + c * kBlockSize, points.paddedCount(), to[c]);
  }

  NodePtr<T> a_;
  std::uint64_t serial_;
};

template <class T>
Field<T> memoField(const Field<T>& f) {
  const bool pointless = constantOf(f.node()) || dynamic_cast<const MemoNode<T>*>(f.node().get());
  return pointless ? f : Field<T>(std::make_shared<MemoNode<T>>(f.node()));
}

template <class T, class B>
Field<T> componentwiseField(Binary op, const Field<T>& a, const Field<B>& b) {
  return Field<T>(componentwise<T, B>(op, a.node(), b.node()));
}

}  // namespace

ScalarField operator+(const ScalarField& a, const ScalarField& b) {
  return binaryField(Binary::add, a, b);
}
ScalarField operator-(const ScalarField& a, const ScalarField& b) {
  return binaryField(Binary::subtract, a, b);
}
ScalarField operator*(const ScalarField& a, const ScalarField& b) {
  return a.node() == b.node() ? square(a) : binaryField(Binary::multiply, a, b);
}
ScalarField operator/(const ScalarField& a, const ScalarField& b) {
  return binaryField(Binary::divide, a, b);
}
ScalarField operator-(const ScalarField& a) {
  return unaryField(Unary::negate, a);
}

VectorField operator+(const VectorField& a, const VectorField& b) {
  return componentwiseField(Binary::add, a, b);
}
VectorField operator-(const VectorField& a, const VectorField& b) {
  return componentwiseField(Binary::subtract, a, b);
}
VectorField operator-(const VectorField& a) {
  return a * ScalarField(-1.0f);
}
VectorField operator*(const VectorField& a, const ScalarField& b) {
  return componentwiseField(Binary::multiply, a, b);
}
VectorField operator*(const ScalarField& a, const VectorField& b) {
  return b * a;
}
VectorField operator/(const VectorField& a, const ScalarField& b) {
  return componentwiseField(Binary::divide, a, b);
}

MatrixField operator+(const MatrixField& a, const MatrixField& b) {
  return componentwiseField(Binary::add, a, b);
}
MatrixField operator-(const MatrixField& a, const MatrixField& b) {
  return componentwiseField(Binary::subtract, a, b);
}
MatrixField operator-(const MatrixField& a) {
  return a * ScalarField(-1.0f);
}
MatrixField operator*(const MatrixField& a, const ScalarField& b) {
  return componentwiseField(Binary::multiply, a, b);
}
MatrixField operator*(const ScalarField& a, const MatrixField& b) {
  return b * a;
}
MatrixField operator/(const MatrixField& a, const ScalarField& b) {
  return componentwiseField(Binary::divide, a, b);
}
MatrixField operator*(const MatrixField& a, const MatrixField& b) {
  return MatrixField(bilinear<Mat3f>(kMatrixMatrix, a.node(), b.node()));
}
VectorField operator*(const MatrixField& a, const VectorField& b) {
  return VectorField(bilinear<Vec3f>(kMatrixVector, a.node(), b.node()));
}

ScalarField abs(const ScalarField& f) {
  return unaryField(Unary::absolute, f);
}
ScalarField square(const ScalarField& f) {
  return unaryField(Unary::square, f);
}
ScalarField sqrt(const ScalarField& f) {
  return unaryField(Unary::squareRoot, f);
}
ScalarField exp(const ScalarField& f) {
  return unaryField(Unary::exponential, f);
}
ScalarField log(const ScalarField& f) {
  return unaryField(Unary::logarithm, f);
}
ScalarField sin(const ScalarField& f) {
  return unaryField(Unary::sine, f);
}
ScalarField cos(const ScalarField& f) {
  return unaryField(Unary::cosine, f);
}
ScalarField tan(const ScalarField& f) {
  return unaryField(Unary::tangent, f);
}
ScalarField asin(const ScalarField& f) {
  return unaryField(Unary::arcSine, f);
}
ScalarField acos(const ScalarField& f) {
  return unaryField(Unary::arcCosine, f);
}
ScalarField atan(const ScalarField& f) {
  return unaryField(Unary::arcTangent, f);
}
ScalarField atan2(const ScalarField& y, const ScalarField& x) {
  return binaryField(Binary::arcTangent2, y, x);
}
ScalarField floor(const ScalarField& f) {
  return unaryField(Unary::floor, f);
}

ScalarField pow(const ScalarField& base, const ScalarField& exponent) {
  const float* constant = constantOf(exponent.node());
  if (constant && *constant == 0) return 1.0f;
  if (constant && *constant == 2) return square(base);
  return binaryField(Binary::power, base, exponent);
}

ScalarField min(const ScalarField& a, const ScalarField& b) {
  return binaryField(Binary::minimum, a, b);
}
ScalarField max(const ScalarField& a, const ScalarField& b) {
  return binaryField(Binary::maximum, a, b);
}

ScalarField clamp(const ScalarField& f, float low, float high) {
  require(low <= high,
          "clamp: low must not be above high, got " + std::to_string(low) + " and " + std::to_string(high));
  return unaryField(Unary::clamp, f, {low, high});
}

ScalarField clamp(const ScalarField& f, const ScalarField& low, const ScalarField& high) {
  return min(max(f, low), high);
}

ScalarField mask(const ScalarField& l) {
  return unaryField(Unary::mask, l);
}

ScalarField mask(const ScalarField& l, float edgeThickness) {
  require(edgeThickness > 0 && std::isfinite(edgeThickness),
          "mask: edgeThickness must be > 0 and finite, got " + std::to_string(edgeThickness));
  return smoothstep(-0.5f * edgeThickness, 0.5f * edgeThickness, l);
}

ScalarField smoothstep(float low, float high, const ScalarField& f) {
  require(low < high && std::isfinite(low) && std::isfinite(high),
          "smoothstep: low must be below high and both finite, got " + std::to_string(low) + " and " +
              std::to_string(high));
  return unaryField(Unary::smoothstep, f, {low, high});
}

VectorField vectorField(const ScalarField& x, const ScalarField& y, const ScalarField& z) {
  return VectorField(JoinNode<Vec3f, float>::make({x.node(), y.node(), z.node()}));
}

ScalarField component(const VectorField& v, int index) {
  require(index >= 0 && index <= 2, "component: index must be 0, 1 or 2, got " + std::to_string(index));
  return ScalarField(PickNode<float, Vec3f>::make({index}, v.node()));
}

VectorField row(const MatrixField& m, int index) {
  require(index >= 0 && index <= 2, "row: index must be 0, 1 or 2, got " + std::to_string(index));
  return VectorField(PickNode<Vec3f, Mat3f>::make({3 * index, 3 * index + 1, 3 * index + 2}, m.node()));
}

MatrixField matrixField(const VectorField& row0, const VectorField& row1, const VectorField& row2) {
  return MatrixField(JoinNode<Mat3f, Vec3f>::make({row0.node(), row1.node(), row2.node()}));
}

ScalarField dot(const VectorField& a, const VectorField& b) {
  return ScalarField(bilinear<float>(kDot, a.node(), b.node()));
}

VectorField cross(const VectorField& a, const VectorField& b) {
  return VectorField(bilinear<Vec3f>(kCross, a.node(), b.node()));
}

ScalarField length(const VectorField& v) {
  if (const Vec3f* c = constantOf(v.node())) return nephele::length(*c);
  return ScalarField(std::make_shared<LengthNode>(v.node()));
}

VectorField normalize(const VectorField& v) {
  if (const Vec3f* c = constantOf(v.node())) return nephele::normalize(*c);
  return VectorField(std::make_shared<NormalizeNode>(v.node()));
}

MatrixField transpose(const MatrixField& m) {
  return MatrixField(PickNode<Mat3f, Mat3f>::make({0, 3, 6, 1, 4, 7, 2, 5, 8}, m.node()));
}

ScalarField determinant(const MatrixField& m) {
  const MatrixField shared = memo(m);
  return dot(row(shared, 0), cross(row(shared, 1), row(shared, 2)));
}

ScalarField memo(const ScalarField& f) {
  return memoField(f);
}
VectorField memo(const VectorField& f) {
  return memoField(f);
}
MatrixField memo(const MatrixField& f) {
  return memoField(f);
}

ScalarField blend(const ScalarField& a, const ScalarField& b, float radius) {
  require(radius > 0 && std::isfinite(radius),
          "blend: radius must be > 0 and finite, got " + std::to_string(radius));
  return binaryField(Binary::blend, a, b, {radius, 0});
}

}  // namespace nephele

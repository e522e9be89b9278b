// Arithmetic and functions of scalar fields as nodes.
//
// An operation is known in three places: its values and derivatives in detail/field_kernels.cpp, its truth in
// detail/operation_values.cpp, its range in detail/operation_ranges.cpp.
//
// Restriction first restricts the parts, then looks at their ranges: an operation that is settled by them
// becomes a constant or one of its parts. Shared parts are treated as if they varied independently.
#include "nephele/modeling/field/operations.h"

#include <algorithm>
#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/field/constant_node.h"
#include "nephele/modeling/field/detail/field_kernels.h"
#include "nephele/modeling/field/detail/operation_ranges.h"

namespace nephele {
namespace {

using detail::Binary;
using detail::constantFrom;
using detail::constantNode;
using detail::constantOf;
using detail::Parameters;
using detail::Unary;
using Frame = Scratch::Frame;

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
  Interval range(const Box& box, RangeMemo& memo) const override {
    return detail::rangeOf(op_, p_, memo.of(a_, box));
  }
  NodePtr<float> restricted(Restriction& restriction) const override {
    const NodePtr<float> a = restrictNode(a_, restriction);
    const Interval r = restriction.rangeOf(a);
    if (auto constant = constantFrom<float>(detail::rangeOf(op_, p_, r))) return constant;
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
  Interval range(const Box& box, RangeMemo& memo) const override {
    return detail::rangeOf(op_, p_, memo.of(a_, box), memo.of(b_, box));
  }
  NodePtr<float> restricted(Restriction& restriction) const override {
    const NodePtr<float> a = restrictNode(a_, restriction), b = restrictNode(b_, restriction);
    const Interval ra = restriction.rangeOf(a), rb = restriction.rangeOf(b);
    if (auto constant = constantFrom<float>(detail::rangeOf(op_, p_, ra, rb))) return constant;
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

ScalarField blend(const ScalarField& a, const ScalarField& b, float radius) {
  require(radius > 0 && std::isfinite(radius),
          "blend: radius must be > 0 and finite, got " + numberText(radius));
  return binaryField(Binary::blend, a, b, {radius, 0});
}

ScalarField clamp(const ScalarField& f, float low, float high) {
  require(low <= high,
          "clamp: low must not be above high, got " + numberText(low) + " and " + numberText(high));
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
          "mask: the thickness of the edge must be > 0 and finite, got " + numberText(edgeThickness));
  return smoothstep(-0.5f * edgeThickness, 0.5f * edgeThickness, l);
}

ScalarField smoothstep(float low, float high, const ScalarField& f) {
  require(low < high && std::isfinite(low) && std::isfinite(high),
          "smoothstep: low must be below high and both finite, got " + numberText(low) + " and " +
              numberText(high));
  return unaryField(Unary::smoothstep, f, {low, high});
}

}  // namespace nephele

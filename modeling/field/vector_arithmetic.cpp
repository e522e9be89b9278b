// Arithmetic of vectors and matrices: component by component, or as a sum of products from a table (dot,
// cross, matrix products). Parts write straight into the lanes of the result wherever that saves a copy.
#include <algorithm>

#include "nephele/modeling/field/constant_node.h"
#include "nephele/modeling/field/detail/field_kernels.h"
#include "nephele/modeling/field/detail/operation_ranges.h"
#include "nephele/modeling/field/operations.h"

namespace nephele {
namespace {

using detail::Binary;
using detail::component;
using detail::constantFrom;
using detail::constantNode;
using detail::constantOf;
using detail::rangeComponent;
using Frame = Scratch::Frame;

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
  RangeOf<T> range(const Box& box, RangeMemo& memo) const override {
    const RangeOf<T> a = memo.of(a_, box);
    const RangeOf<B> b = memo.of(b_, box);
    RangeOf<T> result;
    for (int c = 0; c < kLanes; ++c)
      rangeComponent(result, c) = detail::rangeOf(op_, {}, rangeComponent(a, c), rangeComponent(b, other(c)));
    return result;
  }
  NodePtr<T> restricted(Restriction& restriction) const override {
    const auto a = restrictNode(a_, restriction);
    const auto b = restrictNode(b_, restriction);
    if (a == a_ && b == b_) return nullptr;
    auto result = componentwise<T, B>(op_, a, b);
    if (auto constant = constantFrom<T>(restriction.rangeOf(result))) return constant;
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
  RangeOf<R> range(const Box& box, RangeMemo& memo) const override {
    const RangeOf<A> a = memo.of(a_, box);
    const RangeOf<B> b = memo.of(b_, box);
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

template <class T, class B>
Field<T> componentwiseField(Binary op, const Field<T>& a, const Field<B>& b) {
  return Field<T>(componentwise<T, B>(op, a.node(), b.node()));
}

}  // namespace

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

ScalarField dot(const VectorField& a, const VectorField& b) {
  return ScalarField(bilinear<float>(kDot, a.node(), b.node()));
}

VectorField cross(const VectorField& a, const VectorField& b) {
  return VectorField(bilinear<Vec3f>(kCross, a.node(), b.node()));
}

}  // namespace nephele

// First derivatives: the gradient lanes of a field, rearranged. A derivative's own gradient is the default of
// nodes, central differences of the derivative. Where a field is restricted it must stay right a little
// beyond the box, since fields without an exact gradient look there.
#include "nephele/modeling/field/calculus.h"

#include <algorithm>
#include <cmath>

#include "nephele/modeling/field/constant_node.h"
#include "nephele/modeling/field/operations.h"

namespace nephele {
namespace {

using Frame = Scratch::Frame;

/// Result lane c is derivative lane c of a field: (component, axis) pairs in the order of vectors and of
/// matrices.
template <class R, class T>
class GradNode final : public FieldNode<R> {
 public:
  static constexpr int kLanes = kComponents<R>;
  static_assert(kLanes == 3 * kComponents<T>);

  explicit GradNode(NodePtr<T> f) : f_(std::move(f)) {}

  void eval(const PointBlock& points, const BlockLanes<kLanes>& values, Scratch& scratch) const override {
    Frame frame(scratch);
    f_->evalGrad(points, frame.template lanes<kComponents<T>>(), values, scratch);
  }
  NodePtr<R> restricted(Restriction& restriction) const override {
    const Vec3f size = restriction.box.size();
    const float reach = std::max({std::abs(restriction.box.min.x), std::abs(restriction.box.min.y),
                                  std::abs(restriction.box.min.z), size.x, size.y, size.z});
    // Two steps: one for this node's differences, one for those of the field; steps grow far from the origin.
    Restriction wider = restriction.elsewhere(
        restriction.box.expanded(2.5f * std::max(differenceStepOf(*f_), 2e-6f * reach)));
    const auto f = restrictNode(f_, wider);
    if (f == f_) return nullptr;
    if (detail::constantOf(f)) return std::make_shared<detail::ConstantNode<R>>(R{});
    return std::make_shared<GradNode>(f);
  }
  float differenceStep() const override { return f_->differenceStep(); }

 private:
  NodePtr<T> f_;
};

template <class R, class T>
Field<R> gradField(const Field<T>& f) {
  if (detail::constantOf(f.node())) return R{};
  return Field<R>(std::make_shared<GradNode<R, T>>(f.node()));
}

/// A sum of signed components of a matrix for each result component: div and curl of the Jacobian.
template <class R, int N>
class TraceNode final : public FieldNode<R> {
 public:
  static constexpr int kLanes = kComponents<R>;
  struct Part {
    int index;
    float sign;
  };
  using Table = std::array<std::array<Part, N>, kLanes>;

  TraceNode(const Table& table, NodePtr<Mat3f> jacobian) : table_(table), jacobian_(std::move(jacobian)) {}

  void eval(const PointBlock& points, const BlockLanes<kLanes>& values, Scratch& scratch) const override {
    Frame frame(scratch);
    const BlockLanes<9> j = frame.lanes<9>();
    jacobian_->eval(points, j, scratch);
    for (int c = 0; c < kLanes; ++c) {
      detail::fill(values[c], 0.0f, points.paddedCount());
      for (const Part& part : table_[c])
        for (int i = 0; i < points.paddedCount(); ++i) values[c][i] += part.sign * j[part.index][i];
    }
  }
  NodePtr<R> restricted(Restriction& restriction) const override {
    const auto j = restrictNode(jacobian_, restriction);
    if (j == jacobian_) return nullptr;
    if (detail::constantOf(j)) return std::make_shared<detail::ConstantNode<R>>(R{});
    return std::make_shared<TraceNode>(table_, j);
  }
  RangeOf<R> range(const Box& box, RangeMemo& memo) const override {
    const auto j = memo.of(jacobian_, box);
    RangeOf<R> result;
    for (int c = 0; c < kLanes; ++c) {
      Interval sum = Interval::of(0.0f);
      for (const Part& part : table_[c]) sum = part.sign < 0 ? sum - j[part.index] : sum + j[part.index];
      detail::rangeComponent(result, c) = sum;
    }
    return result;
  }
  float differenceStep() const override { return jacobian_->differenceStep(); }

 private:
  Table table_;
  NodePtr<Mat3f> jacobian_;
};

}  // namespace

VectorField grad(const ScalarField& f) {
  return gradField<Vec3f>(f);
}
MatrixField grad(const VectorField& f) {
  return gradField<Mat3f>(f);
}

ScalarField div(const VectorField& f) {
  using Node = TraceNode<float, 3>;
  const MatrixField j = grad(f);
  if (detail::constantOf(j.node())) return 0.0f;
  return ScalarField(std::make_shared<Node>(Node::Table{{{{{0, 1}, {4, 1}, {8, 1}}}}}, j.node()));
}

VectorField curl(const VectorField& f) {
  using Node = TraceNode<Vec3f, 2>;
  const MatrixField j = grad(f);
  if (detail::constantOf(j.node())) return Vec3f{};
  return VectorField(std::make_shared<Node>(
      Node::Table{{{{{7, 1}, {5, -1}}}, {{{2, 1}, {6, -1}}}, {{{3, 1}, {1, -1}}}}}, j.node()));
}

}  // namespace nephele

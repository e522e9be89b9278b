// Components, rows and lengths of vectors and matrices: nodes that choose, join or measure lanes.
#include <algorithm>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/constant_node.h"
#include "nephele/modeling/field/detail/field_kernels.h"
#include "nephele/modeling/field/operations.h"

namespace nephele {
namespace {

using detail::component;
using detail::constantNode;
using detail::constantOf;
using detail::rangeComponent;
using Frame = Scratch::Frame;

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
  RangeOf<R> range(const Box& box, RangeMemo& memo) const override {
    const RangeOf<A> a = memo.of(a_, box);
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
  RangeOf<R> range(const Box& box, RangeMemo& memo) const override {
    RangeOf<R> result;
    for (int p = 0; p < 3; ++p) {
      const RangeOf<A> part = memo.of(parts_[p], box);
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
    if (constant) return detail::constantNode(value);
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
    return detail::constantNode(value);
  }
  if constexpr (kComponents<A> == 3 * kLanes)
    if (const auto* join = dynamic_cast<const JoinNode<A, R>*>(a.get()))
      return join->parts()[map[0] / kLanes];
  return std::make_shared<PickNode>(map, std::move(a));
}

// ---- Length and direction

/// What `kOf` gives for one vector, as the node that derives from this.
template <class R, R (*kOf)(const Vec3f&), class Node>
class OfVectorNode : public FieldNode<R> {
 public:
  explicit OfVectorNode(NodePtr<Vec3f> v) : v_(std::move(v)) {}

  NodePtr<R> restricted(Restriction& restriction) const override {
    const auto v = restrictNode(v_, restriction);
    return v == v_ ? nullptr : make(v);
  }
  float differenceStep() const override { return v_->differenceStep(); }

  static NodePtr<R> make(NodePtr<Vec3f> v) {
    if (const Vec3f* c = constantOf(v)) return detail::constantNode(kOf(*c));
    return std::make_shared<Node>(std::move(v));
  }

 protected:
  NodePtr<Vec3f> v_;
};

class LengthNode final : public OfVectorNode<float, nephele::length, LengthNode> {
 public:
  using OfVectorNode::OfVectorNode;

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
  Interval range(const Box& box, RangeMemo& memo) const override {
    const auto v = memo.of(v_, box);
    return nephele::sqrt(nephele::square(v[0]) + nephele::square(v[1]) + nephele::square(v[2]));
  }
};

class NormalizeNode final : public OfVectorNode<Vec3f, nephele::normalize, NormalizeNode> {
 public:
  using OfVectorNode::OfVectorNode;

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
  std::array<Interval, 3> range(const Box& box, RangeMemo& memo) const override {
    const auto v = memo.of(v_, box);
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
};

}  // namespace

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

ScalarField length(const VectorField& v) {
  return ScalarField(LengthNode::make(v.node()));
}

VectorField normalize(const VectorField& v) {
  return VectorField(NormalizeNode::make(v.node()));
}

MatrixField transpose(const MatrixField& m) {
  return MatrixField(PickNode<Mat3f, Mat3f>::make({0, 3, 6, 1, 4, 7, 2, 5, 8}, m.node()));
}

ScalarField determinant(const MatrixField& m) {
  const MatrixField shared = memo(m);
  return dot(row(shared, 0), cross(row(shared, 1), row(shared, 2)));
}

}  // namespace nephele

// Fields read elsewhere than at the query point: by a map that is itself a field, or by an affine map, which
// needs no evaluation of its own. Both make a new block of points for the field that they read; gradients
// come back through the transposed Jacobian of the map.
#include "nephele/modeling/field/space.h"

#include <algorithm>
#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/field/constant_node.h"
#include "nephele/modeling/field/detail/field_kernels.h"
#include "nephele/modeling/field/operations.h"

namespace nephele {
namespace {

using detail::constantOf;
using Frame = Scratch::Frame;

class PositionNode final : public FieldNode<Vec3f> {
 public:
  void eval(const PointBlock& points, const BlockLanes<3>& values, Scratch&) const override {
    std::copy_n(points.x, points.paddedCount(), values[0]);
    std::copy_n(points.y, points.paddedCount(), values[1]);
    std::copy_n(points.z, points.paddedCount(), values[2]);
  }
  void evalGrad(const PointBlock& points, const BlockLanes<3>& values, const BlockLanes<9>& grads,
                Scratch& scratch) const override {
    eval(points, values, scratch);
    for (int i = 0; i < 9; ++i) detail::fill(grads[i], i % 4 == 0 ? 1.0f : 0.0f, points.paddedCount());
  }
  std::array<Interval, 3> range(const Box& box, RangeMemo&) const override { return rangeOf(box); }
  float differenceStep() const override { return kNoLength; }
};

bool isPosition(const NodePtr<Vec3f>& node) {
  return dynamic_cast<const PositionNode*>(node.get()) != nullptr;
}

template <class T>
NodePtr<T> composed(NodePtr<T> f, NodePtr<Vec3f> map);

template <class T>
class ComposeNode final : public FieldNode<T> {
 public:
  static constexpr int kLanes = kComponents<T>;

  ComposeNode(NodePtr<T> f, NodePtr<Vec3f> map) : f_(std::move(f)), map_(std::move(map)) {}

  void eval(const PointBlock& points, const BlockLanes<kLanes>& values, Scratch& scratch) const override {
    Frame frame(scratch);
    const BlockLanes<3> xyz = frame.lanes<3>();
    map_->eval(points, xyz, scratch);
    f_->eval(scratch.pointBlock(xyz, points.count), values, scratch);
  }
  void evalGrad(const PointBlock& points, const BlockLanes<kLanes>& values,
                const BlockLanes<3 * kLanes>& grads, Scratch& scratch) const override {
    Frame frame(scratch);
    const BlockLanes<3> xyz = frame.lanes<3>();
    const BlockLanes<9> jacobian = frame.lanes<9>();
    const auto outer = frame.template lanes<3 * kLanes>();
    map_->evalGrad(points, xyz, jacobian, scratch);
    f_->evalGrad(scratch.pointBlock(xyz, points.count), values, outer, scratch);
    for (int c = 0; c < kLanes; ++c)
      for (int k = 0; k < 3; ++k)
        for (int j = 0; j < 3; ++j)
          detail::product(outer[3 * c + j], jacobian[3 * j + k], 1, j > 0, grads[3 * c + k],
                          points.paddedCount());
  }
  RangeOf<T> range(const Box& box, RangeMemo& memo) const override {
    return memo.of(f_, boxOf(memo.of(map_, box)));
  }
  NodePtr<T> restricted(Restriction& restriction) const override {
    const auto map = restrictNode(map_, restriction);
    Restriction there = restriction.elsewhere(boxOf(restriction.rangeOf(map)));
    const auto f = there.box == Box::everywhere() ? f_ : restrictNode(f_, there);
    return f == f_ && map == map_ ? nullptr : composed(f, map);
  }
  float differenceStep() const override { return std::min(f_->differenceStep(), map_->differenceStep()); }

 private:
  NodePtr<T> f_;
  NodePtr<Vec3f> map_;
};

template <class T>
NodePtr<T> composed(NodePtr<T> f, NodePtr<Vec3f> map) {
  if (constantOf(f) || isPosition(map)) return f;
  if constexpr (std::is_same_v<T, Vec3f>)
    if (isPosition(f)) return map;
  return std::make_shared<ComposeNode<T>>(std::move(f), std::move(map));
}

/// f(toField(x)).
template <class T>
class AffineNode final : public FieldNode<T> {
 public:
  static constexpr int kLanes = kComponents<T>;

  AffineNode(NodePtr<T> f, const Affine& toField)
      : f_(std::move(f)),
        toField_(toField),
        transposed_(transpose(toField.linear)),
        // A step in this space becomes shorter or longer in the field's own.
        lengthRatio_(std::cbrt(std::abs(determinant(toField.linear)))) {}

  const NodePtr<T>& field() const { return f_; }
  const Affine& toField() const { return toField_; }

  void eval(const PointBlock& points, const BlockLanes<kLanes>& values, Scratch& scratch) const override {
    Frame frame(scratch);
    f_->eval(mapped(points, frame, scratch), values, scratch);
  }
  void evalGrad(const PointBlock& points, const BlockLanes<kLanes>& values,
                const BlockLanes<3 * kLanes>& grads, Scratch& scratch) const override {
    constexpr float kZero[3] = {};
    Frame frame(scratch);
    f_->evalGrad(mapped(points, frame, scratch), values, grads, scratch);
    for (int c = 0; c < kLanes; ++c) {
      float* const* const g = grads.data() + 3 * c;
      detail::affine3(transposed_.m.data(), kZero, g, g, points.paddedCount());
    }
  }
  RangeOf<T> range(const Box& box, RangeMemo& memo) const override { return memo.of(f_, mapped(box)); }
  NodePtr<T> restricted(Restriction& restriction) const override {
    Restriction there = restriction.elsewhere(mapped(restriction.box));
    const auto f = restrictNode(f_, there);
    if (f == f_) return nullptr;
    return constantOf(f) ? f : std::make_shared<AffineNode>(f, toField_);
  }
  float differenceStep() const override {
    const float step = f_->differenceStep();
    return step < kNoLength ? step / lengthRatio_ : step;
  }

 private:
  PointBlock mapped(const PointBlock& points, Frame& frame, Scratch& scratch) const {
    const BlockLanes<3> xyz = frame.lanes<3>();
    const float* const from[3] = {points.x, points.y, points.z};
    detail::affine3(toField_.linear.m.data(), &toField_.translation.x, from, xyz.data(),
                    points.paddedCount());
    return scratch.pointBlock(xyz, points.count);
  }
  Box mapped(const Box& box) const {
    const auto x = rangeOf(box);
    std::array<Interval, 3> result;
    for (int r = 0; r < 3; ++r) {
      Interval sum = Interval::of(0.0f);
      for (int c = 0; c < 3; ++c)
        if (const float m = toField_.linear(r, c); m != 0) sum = sum + Interval::of(m) * x[c];
      result[r] = sum + Interval::of(toField_.translation[r]);
    }
    return boxOf(result);
  }

  NodePtr<T> f_;
  Affine toField_;
  Mat3f transposed_;
  float lengthRatio_;
};

template <class T>
Field<T> transformedField(const Field<T>& f, const Affine& map) {
  if (constantOf(f.node())) return f;
  Affine toField = inverse(map);
  if (const auto* inner = dynamic_cast<const AffineNode<T>*>(f.node().get())) {
    const Affine& a = inner->toField();
    toField = {a.linear * toField.linear, a(toField.translation)};
    return Field<T>(std::make_shared<AffineNode<T>>(inner->field(), toField));
  }
  return Field<T>(std::make_shared<AffineNode<T>>(f.node(), toField));
}

Affine translation(const Vec3f& offset) {
  require(isFinite(offset), "translate: the offset must be finite");
  return {Mat3f::identity(), offset};
}

Affine scaling(float factor) {
  require(factor > 0 && std::isfinite(factor),
          "scale: factor must be > 0 and finite, got " + numberText(factor));
  return {Mat3f::scaling(factor), {}};
}

}  // namespace

VectorField position() {
  static const VectorField field(std::make_shared<PositionNode>());
  return field;
}
VectorField identity() {
  return position();
}

ScalarField compose(const ScalarField& f, const VectorField& X) {
  return ScalarField(composed(f.node(), X.node()));
}
VectorField compose(const VectorField& f, const VectorField& X) {
  return VectorField(composed(f.node(), X.node()));
}
MatrixField compose(const MatrixField& f, const VectorField& X) {
  return MatrixField(composed(f.node(), X.node()));
}

ScalarField translate(const ScalarField& f, const Vec3f& offset) {
  return transformedField(f, translation(offset));
}
VectorField translate(const VectorField& f, const Vec3f& offset) {
  return transformedField(f, translation(offset));
}
MatrixField translate(const MatrixField& f, const Vec3f& offset) {
  return transformedField(f, translation(offset));
}

ScalarField rotate(const ScalarField& f, const Vec3f& axis, float radians) {
  return transformedField(f, {Mat3f::rotation(axis, radians), {}});
}
VectorField rotate(const VectorField& f, const Vec3f& axis, float radians) {
  const Mat3f turn = Mat3f::rotation(axis, radians);
  return MatrixField(turn) * transformedField(f, {turn, {}});
}
MatrixField rotate(const MatrixField& f, const Vec3f& axis, float radians) {
  const Mat3f turn = Mat3f::rotation(axis, radians);
  return MatrixField(turn) * transformedField(f, {turn, {}}) * MatrixField(transpose(turn));
}

ScalarField scale(const ScalarField& f, float factor) {
  return transformedField(f, scaling(factor));
}
VectorField scale(const VectorField& f, float factor) {
  return transformedField(f, scaling(factor));
}
MatrixField scale(const MatrixField& f, float factor) {
  return transformedField(f, scaling(factor));
}

ScalarField transformed(const ScalarField& f, const Affine& map) {
  return transformedField(f, map);
}
VectorField transformed(const VectorField& f, const Affine& map) {
  return transformedField(f, map);
}
MatrixField transformed(const MatrixField& f, const Affine& map) {
  return transformedField(f, map);
}

}  // namespace nephele

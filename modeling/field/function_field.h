#pragma once

#include <functional>
#include <type_traits>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/field/constant_node.h"
#include "nephele/modeling/field/field.h"

namespace nephele {

/// The derivative of a value by the point: gradient, Jacobian (row i = gradient of component i), or 27
/// numbers.
template <class T>
struct DerivativeFor;
template <>
struct DerivativeFor<float> {
  using type = Vec3f;
};
template <>
struct DerivativeFor<Vec3f> {
  using type = Mat3f;
};
template <>
struct DerivativeFor<Mat3f> {
  using type = std::array<float, 27>;
};

/// What is known about a function; all of it optional.
template <class T>
struct FunctionOptions {
  /// Step of central differences, world units, used where `gradient` is not given. Must be > 0.
  float differenceStep = kDefaultStep;
  /// Bounds of the values on a box. Default: everything.
  std::function<RangeOf<T>(const Box&)> range{};
  /// Exact derivative at a point.
  std::function<typename DerivativeFor<T>::type(const Vec3f&)> gradient{};
};

namespace detail {

template <class T, class F>
class FunctionNode final : public FieldNode<T> {
 public:
  static constexpr int kLanes = kComponents<T>;

  FunctionNode(F function, FunctionOptions<T> options)
      : function_(std::move(function)), options_(std::move(options)) {}

  void eval(const PointBlock& points, const BlockLanes<kLanes>& values, Scratch&) const override {
    for (int i = 0; i < points.count; ++i) {
      const T v = function_(Vec3f{points.x[i], points.y[i], points.z[i]});
      for (int c = 0; c < kLanes; ++c) values[c][i] = component(v, c);
    }
  }
  void evalGrad(const PointBlock& points, const BlockLanes<kLanes>& values,
                const BlockLanes<3 * kLanes>& grads, Scratch& scratch) const override {
    if (!options_.gradient) return FieldNode<T>::evalGrad(points, values, grads, scratch);
    eval(points, values, scratch);
    for (int i = 0; i < points.count; ++i) {
      const auto g = options_.gradient(Vec3f{points.x[i], points.y[i], points.z[i]});
      for (int c = 0; c < 3 * kLanes; ++c) grads[c][i] = derivative(g, c);
    }
  }
  RangeOf<T> range(const Box& box, RangeMemo&) const override {
    return options_.range ? options_.range(box) : RangeOf<T>{};
  }
  float differenceStep() const override { return options_.differenceStep; }

 private:
  static float derivative(const Vec3f& g, int i) { return g[i]; }
  static float derivative(const Mat3f& g, int i) { return g.m[i]; }
  static float derivative(const std::array<float, 27>& g, int i) { return g[i]; }

  F function_;
  FunctionOptions<T> options_;
};

}  // namespace detail

/// Any function of a point as a field: a lambda that takes a Vec3f and returns float, Vec3f or Mat3f.
///
/// It is called from many threads at once, once per point, and must not throw. What `options` says is
/// believed: a range that is too narrow leads to missing parts when the field is baked.
/// @throws Error unless options.differenceStep > 0.
template <class F, class T = std::decay_t<std::invoke_result_t<const F&, const Vec3f&>>>
Field<T> functionField(F function, std::type_identity_t<FunctionOptions<T>> options = {}) {
  require(options.differenceStep > 0,
          "functionField: differenceStep must be > 0, got " + numberText(options.differenceStep));
  return Field<T>(std::make_shared<detail::FunctionNode<T, F>>(std::move(function), std::move(options)));
}

}  // namespace nephele

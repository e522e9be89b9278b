#pragma once

#include "nephele/modeling/field/field.h"

/// Constants, and how expressions recognise them. For the implementation of fields.
namespace nephele::detail {

/// Component `i` of a value in lane order: a float itself, x y z, or matrix rows first.
inline float& component(float& v, int) {
  return v;
}
inline float& component(Vec3f& v, int i) {
  return v[i];
}
inline float& component(Mat3f& v, int i) {
  return v.m[i];
}
inline float component(const float& v, int) {
  return v;
}
inline float component(const Vec3f& v, int i) {
  return v[i];
}
inline float component(const Mat3f& v, int i) {
  return v.m[i];
}

inline Interval& rangeComponent(Interval& r, int) {
  return r;
}
template <std::size_t N>
Interval& rangeComponent(std::array<Interval, N>& r, int i) {
  return r[i];
}
inline const Interval& rangeComponent(const Interval& r, int) {
  return r;
}
template <std::size_t N>
const Interval& rangeComponent(const std::array<Interval, N>& r, int i) {
  return r[i];
}

inline void fill(float* lane, float value, int count) {
  for (int i = 0; i < count; ++i) lane[i] = value;
}

/// The same value everywhere.
template <class T>
class ConstantNode final : public FieldNode<T> {
 public:
  static constexpr int kLanes = kComponents<T>;

  explicit ConstantNode(const T& value) : value_(value) {}

  const T& value() const { return value_; }

  void eval(const PointBlock& points, const BlockLanes<kLanes>& values, Scratch&) const override {
    for (int c = 0; c < kLanes; ++c) fill(values[c], component(value_, c), points.paddedCount());
  }
  void evalGrad(const PointBlock& points, const BlockLanes<kLanes>& values,
                const BlockLanes<3 * kLanes>& grads, Scratch& scratch) const override {
    eval(points, values, scratch);
    for (float* g : grads) fill(g, 0.0f, points.paddedCount());
  }
  RangeOf<T> range(const Box&, RangeMemo&) const override {
    RangeOf<T> result;
    for (int c = 0; c < kLanes; ++c) {
      const float v = component(value_, c);
      rangeComponent(result, c) = v == v ? Interval::of(v) : Interval::everything();
    }
    return result;
  }
  float differenceStep() const override { return kNoLength; }

 private:
  T value_;
};

template <class T>
NodePtr<T> constantNode(const T& value) {
  return std::make_shared<ConstantNode<T>>(value);
}

/// The constant behind `node`, or null.
template <class T>
const T* constantOf(const NodePtr<T>& node) {
  const auto* constant = dynamic_cast<const ConstantNode<T>*>(node.get());
  return constant ? &constant->value() : nullptr;
}

/// A constant node if `range` is a single value, else null.
template <class T>
NodePtr<T> constantFrom(const RangeOf<T>& range) {
  T value{};
  for (int c = 0; c < kComponents<T>; ++c) {
    const Interval& r = rangeComponent(range, c);
    if (!r.isPoint()) return nullptr;
    component(value, c) = r.min;
  }
  return constantNode(value);
}

}  // namespace nephele::detail

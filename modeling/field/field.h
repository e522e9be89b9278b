#pragma once

#include <span>
#include <vector>

#include "nephele/modeling/field/field_node.h"

namespace nephele {

/// N spans of equal length: structure-of-arrays data of any length.
template <int N>
struct Spans {
  std::array<std::span<float>, N> lanes;

  std::size_t size() const { return lanes[0].size(); }
};

/// One span stands for scalar values.
template <>
struct Spans<1> {
  std::array<std::span<float>, 1> lanes;

  Spans(std::span<float> values) : lanes{values} {}
  Spans(std::vector<float>& values) : lanes{std::span<float>(values)} {}
  std::size_t size() const { return lanes[0].size(); }
};

/// Points to query, structure of arrays, equal lengths.
struct PointSpans {
  std::span<const float> x, y, z;

  std::size_t size() const { return x.size(); }
};

/// An immutable expression that has a value of type T (float, Vec3f, Mat3f) everywhere in space.
///
/// A handle: cheap to copy, never null, safe to share between threads. Scalar fields that describe a shape
/// are positive inside, negative outside. Values may be infinite or NaN where the mathematics says so;
/// evaluation never throws. Evaluation of many points at once is one to two orders of magnitude faster per
/// point than one by one.
template <class T>
class Field {
 public:
  using Value = T;

  /// The same value everywhere.
  Field(const T& constant);

  /// @throws Error if `node` is null.
  explicit Field(NodePtr<T> node);

  /// Values at `points`; all spans must have one length. @throws Error if they do not.
  void eval(const PointSpans& points, const Spans<kComponents<T>>& values) const;

  /// Values, and derivatives: component i by x, y, z in grads.lanes[3 i .. 3 i + 2]. Exact for shapes, noise
  /// and operators; differences at the voxel size for grids.
  void evalGrad(const PointSpans& points, const Spans<kComponents<T>>& values,
                const Spans<3 * kComponents<T>>& grads) const;

  /// Value at one point. A convenience: hundreds of nanoseconds, never for a loop.
  T operator()(const Vec3f& point) const;

  /// Bounds that contain every value on `box`, rounded outward. May be wide, is never wrong.
  RangeOf<T> range(const Box& box) const;

  /// A field equal to this one on `box`, often cheaper there, arbitrary elsewhere.
  Field restrictedTo(const Box& box) const;

  /// Step in world units at which differences of this field make sense.
  float differenceStep() const { return differenceStepOf(*node_); }

  const NodePtr<T>& node() const { return node_; }

 private:
  NodePtr<T> node_;
};

using ScalarField = Field<float>;
using VectorField = Field<Vec3f>;
using MatrixField = Field<Mat3f>;

extern template class Field<float>;
extern template class Field<Vec3f>;
extern template class Field<Mat3f>;

}  // namespace nephele

#pragma once

#include <limits>
#include <memory>

#include "nephele/modeling/base/interval.h"
#include "nephele/modeling/base/math.h"
#include "nephele/modeling/field/scratch.h"

/// What a new kind of field implements. Users of fields need modeling/field/field.h only.
namespace nephele {

/// Difference step of fields that say nothing else, world units.
inline constexpr float kDefaultStep = 1e-3f;
/// Difference step of a node without any length of its own, such as a constant: it leaves the choice to
/// others.
inline constexpr float kNoLength = std::numeric_limits<float>::max();

template <class T>
inline constexpr int kComponents = 1;
template <>
inline constexpr int kComponents<Vec3f> = 3;
template <>
inline constexpr int kComponents<Mat3f> = 9;

template <class T>
class FieldNode;
template <class T>
using NodePtr = std::shared_ptr<const FieldNode<T>>;

/// Ranges of the nodes of an expression, each found once on a box however many others read it: a node asks
/// for those of its parts here. Belongs to one question and one thread.
class RangeMemo {
 public:
  RangeMemo();
  ~RangeMemo();

  /// Bounds of all values of `node` on `box`.
  template <class T>
  RangeOf<T> of(const NodePtr<T>& node, const Box& box);

 private:
  struct Tables;
  std::unique_ptr<Tables> tables_;
  int asked_ = 0;
};

/// What is remembered while an expression is restricted, so that shared sub-expressions stay shared and are
/// looked at once.
class RestrictionMemo {
 public:
  RestrictionMemo();
  ~RestrictionMemo();

  RangeMemo ranges;

 private:
  template <class T>
  friend NodePtr<T> restrictNode(const NodePtr<T>& node, struct Restriction& restriction);

  struct Done;
  std::unique_ptr<Done> done_;
};

/// A box that an expression is restricted to.
struct Restriction {
  Box box;
  RestrictionMemo& memo;

  /// Of the same expression, to another box: for nodes that read their parts elsewhere.
  Restriction elsewhere(const Box& other) const { return {other, memo}; }
  /// The range of `node` on the box.
  template <class T>
  RangeOf<T> rangeOf(const NodePtr<T>& node) {
    return memo.ranges.of(node, box);
  }
};

/// One operation of a field expression: immutable, shared between expressions and threads.
template <class T>
class FieldNode {
 public:
  static constexpr int kLanes = kComponents<T>;

  virtual ~FieldNode() = default;

  /// Writes the value at each of `points.count` points; may write up to the padded count. Output lanes never
  /// overlap the points or each other. Must not throw, lock or allocate.
  virtual void eval(const PointBlock& points, const BlockLanes<kLanes>& values, Scratch& scratch) const = 0;

  /// As `eval`, the same values bit for bit, and the derivative of component i by x, y, z in grads[3 i], [3 i
  /// + 1], [3 i + 2]. Default: central differences at `differenceStep()`.
  virtual void evalGrad(const PointBlock& points, const BlockLanes<kLanes>& values,
                        const BlockLanes<3 * kLanes>& grads, Scratch& scratch) const;

  /// Bounds that contain every value on `box`. Default: everything. A node asks `memo` for the ranges of its
  /// parts, never the parts themselves, so that what is shared is ranged once.
  virtual RangeOf<T> range(const Box& box, RangeMemo& memo) const;

  /// A node equal to this one inside `restriction.box` and cheaper there, or null if there is none. Outside
  /// the box the result may be anything. Default: null. A node that reads its parts beyond the box, as
  /// differences do, must restrict them to a box that is larger by as much.
  virtual NodePtr<T> restricted(Restriction& restriction) const;

  /// Step of the default `evalGrad`, and of differences of this field's gradient, in world units.
  /// A compound node returns the smallest step of its parts, and kNoLength if none of them has a length of
  /// its own.
  virtual float differenceStep() const { return kDefaultStep; }
};

/// The step that `node` asks for; kDefaultStep where it has no length of its own.
template <class T>
float differenceStepOf(const FieldNode<T>& node) {
  const float step = node.differenceStep();
  return step < kNoLength ? step : kDefaultStep;
}

/// `node` restricted to `restriction.box`; `node` itself where nothing is gained.
template <class T>
NodePtr<T> restrictNode(const NodePtr<T>& node, Restriction& restriction);

extern template class FieldNode<float>;
extern template class FieldNode<Vec3f>;
extern template class FieldNode<Mat3f>;

}  // namespace nephele

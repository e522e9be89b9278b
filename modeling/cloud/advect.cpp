// Gridless advection: the density after n steps is the first density read at X_n(x) = X_(n-1)(x - u dt).
// (Tessendorf, Resolution Independent Volumes, chapter 7, equations 7.1 to 7.4 and 8.8.) Evaluated from the
// outside inwards, X_n walks a point back through all steps, the last one first; one node does the whole walk
// in a loop, so that its depth and its memory do not grow with the steps. Jacobians multiply along the way.
//
// Limits: time grows with the steps; a trace that leaves the float range gives NaN, and the range says so.
#include "nephele/modeling/cloud/advect.h"

#include <algorithm>
#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"

namespace nephele {
namespace {

using Frame = Scratch::Frame;

/// to = from - scale v, for each axis.
void moveBy(const BlockLanes<3>& from, const BlockLanes<3>& v, float scale, const BlockLanes<3>& to,
            int count) {
  for (int c = 0; c < 3; ++c)
    for (int i = 0; i < count; ++i) to[c][i] = from[c][i] - scale * v[c][i];
}

/// out = I - scale a, for 3 x 3 matrices in lanes.
void identityMinus(const BlockLanes<9>& a, float scale, const BlockLanes<9>& out, int count) {
  for (int k = 0; k < 9; ++k)
    for (int i = 0; i < count; ++i) out[k][i] = (k % 4 == 0 ? 1.0f : 0.0f) - scale * a[k][i];
}

/// out = a b, for 3 x 3 matrices in lanes; `out` is neither of them.
void multiply(const BlockLanes<9>& a, const BlockLanes<9>& b, const BlockLanes<9>& out, int count) {
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c)
      for (int i = 0; i < count; ++i)
        out[3 * r + c][i] =
            a[3 * r][i] * b[c][i] + a[3 * r + 1][i] * b[3 + c][i] + a[3 * r + 2][i] * b[6 + c][i];
}

void copy(const BlockLanes<9>& from, const BlockLanes<9>& to, int count) {
  for (int k = 0; k < 9; ++k) std::copy_n(from[k], count, to[k]);
}

bool isBounded(const Box& box) {
  return !box.isEmpty() && isFinite(box.min) && isFinite(box.max);
}

/// Walks back through the velocities, `repeats` times each, from the last to the first.
class TraceBackNode final : public FieldNode<Vec3f> {
 public:
  TraceBackNode(std::vector<NodePtr<Vec3f>> velocities, int repeats, float dt, TraceRule rule)
      : velocities_(std::move(velocities)), repeats_(repeats), dt_(dt), rule_(rule) {}

  void eval(const PointBlock& points, const BlockLanes<3>& values, Scratch& scratch) const override {
    const int padded = points.paddedCount();
    start(points, values);
    Frame frame(scratch);
    const BlockLanes<3> u = frame.lanes<3>(), middle = frame.lanes<3>();
    PointBlock here = points;
    for (std::size_t step = stepCount(); step-- > 0;) {
      CancelScope::check();
      const FieldNode<Vec3f>& velocity = velocityOf(step);
      velocity.eval(here, u, scratch);
      if (rule_ == TraceRule::midpoint) {
        moveBy(values, u, 0.5f * dt_, middle, padded);
        velocity.eval(scratch.pointBlock(middle, points.count), u, scratch);
      }
      moveBy(values, u, dt_, values, padded);
      here = scratch.pointBlock(values, points.count);
    }
  }

  void evalGrad(const PointBlock& points, const BlockLanes<3>& values, const BlockLanes<9>& grads,
                Scratch& scratch) const override {
    const int padded = points.paddedCount();
    start(points, values);
    for (int k = 0; k < 9; ++k) std::fill_n(grads[k], padded, k % 4 == 0 ? 1.0f : 0.0f);
    Frame frame(scratch);
    const BlockLanes<3> u = frame.lanes<3>(), middle = frame.lanes<3>();
    const BlockLanes<9> du = frame.lanes<9>(), half = frame.lanes<9>(), both = frame.lanes<9>();
    PointBlock here = points;
    for (std::size_t step = stepCount(); step-- > 0;) {
      CancelScope::check();
      const FieldNode<Vec3f>& velocity = velocityOf(step);
      velocity.evalGrad(here, u, du, scratch);
      if (rule_ == TraceRule::midpoint) {
        moveBy(values, u, 0.5f * dt_, middle, padded);
        identityMinus(du, 0.5f * dt_, half, padded);
        velocity.evalGrad(scratch.pointBlock(middle, points.count), u, du, scratch);
        multiply(du, half, both, padded);
        identityMinus(both, dt_, du, padded);
      } else {
        identityMinus(du, dt_, half, padded);
        copy(half, du, padded);
      }
      multiply(du, grads, both, padded);
      copy(both, grads, padded);
      moveBy(values, u, dt_, values, padded);
      here = scratch.pointBlock(values, points.count);
    }
  }

  std::array<Interval, 3> range(const Box& box, RangeMemo& memo) const override {
    Box reached = box;
    return rangeOf(walked(box, reached, memo));
  }

  NodePtr<Vec3f> restricted(Restriction& restriction) const override {
    Box reached = restriction.box;
    walked(restriction.box, reached, restriction.memo.ranges);
    if (!isBounded(reached)) return nullptr;
    Restriction there = restriction.elsewhere(reached);
    std::vector<NodePtr<Vec3f>> velocities;
    for (const NodePtr<Vec3f>& velocity : velocities_) velocities.push_back(restrictNode(velocity, there));
    if (velocities == velocities_) return nullptr;
    return std::make_shared<TraceBackNode>(std::move(velocities), repeats_, dt_, rule_);
  }

  float differenceStep() const override {
    float step = kNoLength;
    for (const NodePtr<Vec3f>& velocity : velocities_) step = std::min(step, velocity->differenceStep());
    return step;
  }

 private:
  static void start(const PointBlock& points, const BlockLanes<3>& values) {
    std::copy_n(points.x, points.paddedCount(), values[0]);
    std::copy_n(points.y, points.paddedCount(), values[1]);
    std::copy_n(points.z, points.paddedCount(), values[2]);
  }

  std::size_t stepCount() const { return velocities_.size() * std::size_t(repeats_); }
  const NodePtr<Vec3f>& nodeOf(std::size_t step) const { return velocities_[step / std::size_t(repeats_)]; }
  const FieldNode<Vec3f>& velocityOf(std::size_t step) const { return *nodeOf(step); }

  static Box minus(const Box& box, const std::array<Interval, 3>& u, float dt) {
    auto x = rangeOf(box);
    for (int c = 0; c < 3; ++c) x[c] = x[c] - Interval::of(dt) * u[c];
    return boxOf(x);
  }

  /// What contains X of `box`; `reached` grows by every box that the velocity is read in.
  Box walked(const Box& box, Box& reached, RangeMemo& memo) const {
    Box here = box;
    for (std::size_t step = stepCount(); step-- > 0 && isBounded(here);) {
      CancelScope::check();
      const NodePtr<Vec3f>& velocity = nodeOf(step);
      reached = reached.including(here);
      auto u = memo.of(velocity, here);
      if (rule_ == TraceRule::midpoint) {
        const Box middle = minus(here, u, 0.5f * dt_);
        reached = reached.including(middle);
        u = memo.of(velocity, middle);
      }
      here = minus(here, u, dt_);
    }
    // Rounding of the walk itself is within that of its intervals.
    return isBounded(here) ? here : Box::everywhere();
  }

  std::vector<NodePtr<Vec3f>> velocities_;
  int repeats_;
  float dt_;
  TraceRule rule_;
};

void requireSane(const AdvectOptions& options) {
  require(std::isfinite(options.dt), "advect: dt must be finite");
  require(options.steps >= 0, "advect: steps must be >= 0, got " + std::to_string(options.steps));
}

}  // namespace

VectorField traceBack(const VectorField& velocity, const AdvectOptions& options) {
  requireSane(options);
  if (options.steps == 0) return identity();
  return VectorField(
      std::make_shared<TraceBackNode>(std::vector{velocity.node()}, options.steps, options.dt, options.rule));
}

VectorField traceBack(const std::vector<VectorField>& velocities, const AdvectOptions& options) {
  requireSane(options);
  if (velocities.empty()) return identity();
  std::vector<NodePtr<Vec3f>> nodes;
  for (const VectorField& velocity : velocities) nodes.push_back(velocity.node());
  return VectorField(std::make_shared<TraceBackNode>(std::move(nodes), 1, options.dt, options.rule));
}

ScalarField advect(const ScalarField& field, const VectorField& velocity, const AdvectOptions& options) {
  return compose(field, traceBack(velocity, options));
}

VectorField advect(const VectorField& field, const VectorField& velocity, const AdvectOptions& options) {
  return compose(field, traceBack(velocity, options));
}

namespace {

ScalarField limited(const ScalarField& f, const std::vector<ScalarField>& between) {
  ScalarField low = between[0], high = between[0];
  for (const ScalarField& value : between) low = min(low, value), high = max(high, value);
  return clamp(f, low, high);
}

VectorField limited(const VectorField& f, const std::vector<VectorField>& between) {
  std::vector<ScalarField> parts;
  for (int c = 0; c < 3; ++c) {
    std::vector<ScalarField> values;
    for (const VectorField& value : between) values.push_back(component(value, c));
    parts.push_back(limited(component(f, c), values));
  }
  return vectorField(parts[0], parts[1], parts[2]);
}

template <class T>
Field<T> corrected(const Field<T>& f, const VectorField& velocity, float dt) {
  const VectorField u = memo(velocity);
  const VectorField before = memo(traceBack(u, {.dt = dt, .rule = TraceRule::euler}));
  const VectorField after = traceBack(u, {.dt = -dt, .rule = TraceRule::euler});
  const VectorField again = memo(compose(traceBack(velocity, {.dt = dt, .rule = TraceRule::euler}), after));
  const Field<T> plain = memo(compose(f, before));
  const ScalarField reach = memo(length(again - position()) + 0.5f * f.differenceStep());
  std::vector<Field<T>> between{plain};
  for (int corner = 0; corner < 8; ++corner) {
    const auto side = [&](int axis) { return corner >> axis & 1 ? 1.0f : -1.0f; };
    const Vec3f away(side(0), side(1), side(2));
    between.push_back(memo(compose(f, before + reach * VectorField(away))));
  }
  return limited(memo(plain + (f - compose(f, again)) * ScalarField(0.5f)), between);
}

}  // namespace

ScalarField macCormack(const ScalarField& field, const VectorField& velocity, float dt) {
  return corrected(field, velocity, dt);
}

VectorField macCormack(const VectorField& field, const VectorField& velocity, float dt) {
  return corrected(field, velocity, dt);
}

}  // namespace nephele

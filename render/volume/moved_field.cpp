// Eulerian motion blur of fields: a mean over lines through the velocity at their ends.
#include "nephele/render/volume/moved_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>

#include "nephele/modeling/base/error.h"

namespace nephele {

namespace {

constexpr int kMostPlaces = 64;
// Share of the box that things may leave it by.
constexpr float kFarthest = 0.25f;
// Sums of as many values as there are places may be off by so much of them.
constexpr float kRounding = 1e-5f;

Interval meanOf(const Interval& values, bool leavesBox) {
  const Interval all = leavesBox ? values.hull(Interval::of(0)) : values;
  if (all.isPoint()) return all;
  const float margin = kRounding * all.magnitude();
  return {all.min - margin, all.max + margin};
}

std::array<Interval, 3> meanOf(const std::array<Interval, 3>& values, bool leavesBox) {
  return {meanOf(values[0], leavesBox), meanOf(values[1], leavesBox), meanOf(values[2], leavesBox)};
}

template <class T>
class BlurredNode final : public FieldNode<T> {
 public:
  static constexpr int kLanes = kComponents<T>;

  BlurredNode(NodePtr<T> f, FieldMotion motion) : f_(std::move(f)), motion_(std::move(motion)) {}

  void eval(const PointBlock& points, const BlockLanes<kLanes>& values, Scratch& scratch) const override {
    Scratch::Frame frame(scratch);
    const BlockLanes<3> velocity = frame.lanes<3>(), place = frame.lanes<3>();
    const auto found = frame.template lanes<kLanes>();
    motion_.velocity.node()->eval(points, velocity, scratch);
    const float spacing = motion_.spacing, opening = float(motion_.shutter.open),
                open = float(motion_.shutter.close - motion_.shutter.open);
    std::array<int, kBlockSize> counts;
    int most = 0;
    for (int i = 0; i != points.count; ++i) {
      const float way = open * length(Vec3f{velocity[0][i], velocity[1][i], velocity[2][i]});
      counts[std::size_t(i)] =
          way > spacing ? int(std::min(std::ceil(way / spacing), float(kMostPlaces))) : 1;
      most = std::max(most, counts[std::size_t(i)]);
      for (float* lane : values) lane[i] = 0.0f;
    }
    std::array<std::uint16_t, kBlockSize> which;
    for (int n = 0; n != most; ++n) {
      int count = 0;
      for (int i = 0; i != points.count; ++i) {
        if (n >= counts[std::size_t(i)]) continue;
        const float time = opening + open * (float(n) + 0.5f) / float(counts[std::size_t(i)]);
        const Vec3f p{points.x[i] - velocity[0][i] * time, points.y[i] - velocity[1][i] * time,
                      points.z[i] - velocity[2][i] * time};
        if (!motion_.box.contains(p)) continue;
        for (int axis = 0; axis != 3; ++axis) place[std::size_t(axis)][count] = p[axis];
        which[std::size_t(count++)] = std::uint16_t(i);
      }
      if (count == 0) continue;
      f_->eval(scratch.pointBlock(place, count), found, scratch);
      for (int k = 0; k != count; ++k)
        for (std::size_t c = 0; c != found.size(); ++c) values[c][which[std::size_t(k)]] += found[c][k];
    }
    for (int i = 0; i != points.count; ++i)
      for (float* lane : values) lane[i] /= float(counts[std::size_t(i)]);
  }
  RangeOf<T> range(const Box& box, RangeMemo& memo) const override {
    const Box from = origins(box, memo.of(motion_.velocity.node(), box)),
              inside = from.intersection(motion_.box);
    if (inside.isEmpty()) return meanOf(zero(), false);
    return meanOf(memo.of(f_, inside), inside != from);
  }
  NodePtr<T> restricted(Restriction& restriction) const override {
    const NodePtr<Vec3f>& before = motion_.velocity.node();
    const NodePtr<Vec3f> velocity = restrictNode(before, restriction);
    const Box inside = origins(restriction.box, restriction.rangeOf(velocity)).intersection(motion_.box);
    if (inside.isEmpty()) return Field<T>(T{}).node();
    Restriction there = restriction.elsewhere(inside);
    const NodePtr<T> f = restrictNode(f_, there);
    if (f == f_ && velocity == before) return nullptr;
    FieldMotion motion = motion_;
    motion.velocity = VectorField(velocity);
    return std::make_shared<BlurredNode>(f, std::move(motion));
  }
  float differenceStep() const override {
    return std::min(f_->differenceStep(), motion_.velocity.node()->differenceStep());
  }

 private:
  // Where what is in `box` may have come from.
  Box origins(const Box& box, const RangeOf<Vec3f>& velocity) const {
    const Interval times{float(motion_.shutter.open), float(motion_.shutter.close)};
    std::array<Interval, 3> result = rangeOf(box);
    for (std::size_t axis = 0; axis != 3; ++axis) result[axis] = result[axis] - velocity[axis] * times;
    return boxOf(result);
  }
  static RangeOf<T> zero() {
    if constexpr (kLanes == 1)
      return Interval::of(0);
    else
      return {Interval::of(0), Interval::of(0), Interval::of(0)};
  }

  NodePtr<T> f_;
  FieldMotion motion_;
};

template <class T>
Field<T> blurredBy(const Field<T>& f, const FieldMotion& motion) {
  require(std::isfinite(motion.spacing) && motion.spacing > 0, "motion blur: expected a spacing > 0");
  return Field<T>(std::make_shared<BlurredNode<T>>(f.node(), motion));
}

}  // namespace

Box FieldMotion::reached() const {
  const Box most = box.expanded(kFarthest * box.longestSide());
  const float time = float(std::max(std::fabs(shutter.open), std::fabs(shutter.close)));
  const RangeOf<Vec3f> range = velocity.range(most);
  Box result = box;
  for (int axis = 0; axis != 3; ++axis) {
    const float way = range[std::size_t(axis)].magnitude() * time;
    result.min[axis] -= way;
    result.max[axis] += way;
  }
  return result.intersection(most);
}

ScalarField blurred(const ScalarField& f, const FieldMotion& motion) {
  return blurredBy(f, motion);
}

VectorField blurred(const VectorField& f, const FieldMotion& motion) {
  return blurredBy(f, motion);
}

}  // namespace nephele

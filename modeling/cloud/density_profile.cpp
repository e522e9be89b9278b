// Density is shaped by multiplication, so that what is asked for apart needs no order. Every factor depends
// on the height alone or on noise: a bake finds the parts that are even, empty or whole from their ranges.
#include "nephele/modeling/cloud/density_profile.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/field/constant_node.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/noise/noise.h"
#include "nephele/modeling/shape/shapes.h"

namespace nephele {
namespace {

constexpr int kInteriorOctaves = 4;

class RampNode final : public FieldNode<float> {
 public:
  RampNode(NodePtr<float> f, std::vector<RampStop> stops) : f_(std::move(f)), stops_(std::move(stops)) {}

  void eval(const PointBlock& points, const BlockLanes<1>& values, Scratch& scratch) const override {
    f_->eval(points, values, scratch);
    for (int i = 0; i < points.count; ++i) values[0][i] = at(values[0][i]);
  }
  void evalGrad(const PointBlock& points, const BlockLanes<1>& values, const BlockLanes<3>& grads,
                Scratch& scratch) const override {
    f_->evalGrad(points, values, grads, scratch);
    for (int i = 0; i < points.count; ++i) {
      const float slope = slopeAt(values[0][i]);
      values[0][i] = at(values[0][i]);
      for (int axis = 0; axis < 3; ++axis) grads[axis][i] = slope == 0 ? 0.0f : slope * grads[axis][i];
    }
  }
  Interval range(const Box& box, RangeMemo& memo) const override {
    const Interval f = memo.of(f_, box);
    Interval r = Interval::of(at(f.min)).hull(Interval::of(at(f.max)));
    for (const RampStop& stop : stops_)
      if (f.contains(stop.at)) r = r.hull(Interval::of(stop.value));
    // Nothing to widen: every operation of `at` rises or falls with f, rounding included.
    return r;
  }
  NodePtr<float> restricted(Restriction& restriction) const override {
    const Interval r = range(restriction.box, restriction.memo.ranges);
    if (r.isPoint()) return std::make_shared<detail::ConstantNode<float>>(r.min);
    NodePtr<float> f = restrictNode(f_, restriction);
    return f == f_ ? nullptr : std::make_shared<RampNode>(std::move(f), stops_);
  }
  float differenceStep() const override { return f_->differenceStep(); }

 private:
  /// Index of the first stop above f.
  std::size_t above(float f) const {
    return std::size_t(std::upper_bound(stops_.begin(), stops_.end(), f,
                                        [](float v, const RampStop& stop) { return v < stop.at; }) -
                       stops_.begin());
  }
  float at(float f) const {
    if (!(f >= stops_.front().at)) return stops_.front().value;
    const std::size_t next = above(f);
    if (next == stops_.size()) return stops_.back().value;
    const RampStop &a = stops_[next - 1], &b = stops_[next];
    if (a.value == b.value) return a.value;
    const double t = (double(f) - a.at) / (double(b.at) - a.at);
    return float(a.value + t * (double(b.value) - a.value));
  }
  float slopeAt(float f) const {
    if (!(f >= stops_.front().at)) return 0;
    const std::size_t next = above(f);
    if (next == stops_.size()) return 0;
    const RampStop &a = stops_[next - 1], &b = stops_[next];
    return float((double(b.value) - a.value) / (double(b.at) - a.at));
  }

  NodePtr<float> f_;
  std::vector<RampStop> stops_;
};

void requireAbove(float value, float low, const char* name) {
  require(value > low && std::isfinite(value), "densityFactor: " + std::string(name) + " must be > " +
                                                   numberText(low) + " and finite, got " + numberText(value));
}

void requireWithin(float value, float low, float high, const char* name) {
  require(value >= low && value <= high, "densityFactor: " + std::string(name) + " must be " +
                                             numberText(low) + " to " + numberText(high) + ", got " +
                                             numberText(value));
}

}  // namespace

ScalarField ramp(const ScalarField& f, std::vector<RampStop> stops) {
  require(!stops.empty(), "ramp: there must be at least one stop");
  for (std::size_t i = 0; i < stops.size(); ++i) {
    require(std::isfinite(stops[i].at) && std::isfinite(stops[i].value),
            "ramp: stop " + std::to_string(i + 1) + " is not finite");
    if (i == 0) continue;
    require(stops[i].at >= stops[i - 1].at, "ramp: places must rise, got " + numberText(stops[i].at) +
                                                " after " + numberText(stops[i - 1].at));
  }
  return ScalarField(std::make_shared<RampNode>(f.node(), std::move(stops)));
}

ScalarField heightBetween(float low, float high) {
  require(low < high && std::isfinite(low) && std::isfinite(high),
          "heightBetween: low must be below high, got " + numberText(low) + " and " + numberText(high));
  return plane({0, low, 0}, {0, 1, 0}) / (high - low);
}

ScalarField densityFactor(const DensityProfile& profile) {
  ScalarField factor = 1.0f;
  if (profile.flatBase) {
    requireAbove(profile.flatBase->softness, 0, "flatBase.softness");
    require(std::isfinite(profile.flatBase->height), "densityFactor: flatBase.height must be finite");
    const ScalarField above = plane({0, profile.flatBase->height, 0}, {0, 1, 0});
    factor = smoothstep(0, profile.flatBase->softness, above);
  }
  if (!profile.heightProfile.empty()) {
    for (const RampStop& stop : profile.heightProfile)
      require(stop.value >= 0,
              "densityFactor: values of heightProfile must be >= 0, got " + numberText(stop.value));
    factor = factor * ramp(heightBetween(profile.low, profile.high), profile.heightProfile);
  }
  requireWithin(profile.thinOut, 0, 1, "thinOut");
  if (profile.thinOut > 0) {
    requireWithin(profile.thinOutFrom, 0, 0.999f, "thinOutFrom");
    factor = factor * (1.0f - profile.thinOut * smoothstep(profile.thinOutFrom, 1,
                                                           heightBetween(profile.low, profile.high)));
  }
  require(profile.interiorNoise >= 0 && std::isfinite(profile.interiorNoise),
          "densityFactor: interiorNoise must be >= 0 and finite, got " + numberText(profile.interiorNoise));
  if (profile.interiorNoise > 0) {
    requireAbove(profile.interiorFrequency, 0, "interiorFrequency");
    const ScalarField noise = fractalSum(
        {.octaves = kInteriorOctaves, .frequency = profile.interiorFrequency, .seed = profile.seed});
    factor = factor * max(1.0f + profile.interiorNoise * noise, 0.0f);
  }
  return factor;
}

}  // namespace nephele

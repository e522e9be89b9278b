// A ladder of noises at fixed frequencies, of which the two nearest in frequency are blended at every point.
// Weights are the cosine and sine of one angle, since independent noises add their squares. The angle stands
// still where a noise is reached, so that no crease follows the surfaces on which one noise takes over from
// another. The mean square frequency of a blend lies between those of its parts, off the one asked for by
// some percent. Smaller steps would follow it better, but change from noise to noise faster where the
// frequency varies, which adds slopes of its own.
//
// Source: Tessendorf, Resolution Independent Volumes, 3.1, "spatial mixing", asks for parameters that vary;
// how the frequency may is not said there. Limits: where the frequency changes by more than a factor of 2
// over one feature, features are cut off rather than stretched.
#include "nephele/modeling/noise/varying_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/noise/noise_draw.h"

namespace nephele {
namespace {

constexpr float kRightAngle = 1.57079632679f;
/// Steps per factor of two.
constexpr float kStepsPerOctave = 2;
/// Values are never cut nearer to 0 than this, in rms.
constexpr float kLeastCut = kPerlinBound;
/// A blend of two values within +-b reaches sqrt(2) b.
constexpr float kOctavesPerUnit = 1.44269504f;  // 1 / log 2
constexpr float kBlendReach = 1.4142137f;

/// Rounding of weights.
constexpr float kWeightError = 1e-5f;

/// Where a frequency lies between two noises of the ladder.
struct Place {
  int rung;
  float low, high;  ///< Weights of noises `rung` and `rung + 1`.
  float angleRate;  ///< Derivative of the angle by the frequency.
};

class VaryingNoiseNode final : public FieldNode<float> {
 public:
  VaryingNoiseNode(std::vector<NodePtr<float>> noises, NodePtr<float> frequency, const Interval& range)
      : noises_(std::move(noises)), frequency_(std::move(frequency)), least_(range.min) {
    const double octaves = std::log2(double(range.max) / double(range.min));
    perOctave_ = float(double(steps()) / octaves);
    Interval all{0, 0};
    for (const auto& noise : noises_) all = all.hull(RangeMemo().of(noise, Box::everywhere()));
    bounds_ = {-cut(-all.min), cut(all.max)};
    for (const auto& noise : noises_) step_ = std::min(step_, noise->differenceStep());
  }

  void eval(const PointBlock& points, const BlockLanes<1>& values, Scratch& scratch) const override {
    Scratch::Frame frame(scratch);
    float* const frequency = frame.lane();
    frequency_->eval(points, {frequency}, scratch);
    std::array<Place, kBlockSize> places;
    locate(frequency, points.count, places);
    std::fill_n(values[0], points.count, 0.0f);
    const BlockLanes<3> where = frame.lanes<3>();
    float* const noise = frame.lane();
    forRungs(points, places, where, scratch, [&](int rung, const PointBlock& block, const Members& members) {
      noises_[std::size_t(rung)]->eval(block, {noise}, scratch);
      for (int i = 0; i < block.count; ++i) values[0][members.at[i]] += members.weight[i] * noise[i];
    });
    for (int i = 0; i < points.count; ++i) values[0][i] = std::clamp(values[0][i], bounds_.min, bounds_.max);
  }

  void evalGrad(const PointBlock& points, const BlockLanes<1>& values, const BlockLanes<3>& grads,
                Scratch& scratch) const override {
    Scratch::Frame frame(scratch);
    float* const frequency = frame.lane();
    const BlockLanes<3> slope = frame.lanes<3>();
    frequency_->evalGrad(points, {frequency}, slope, scratch);
    std::array<Place, kBlockSize> places;
    locate(frequency, points.count, places);
    std::fill_n(values[0], points.count, 0.0f);
    for (float* const g : grads) std::fill_n(g, points.count, 0.0f);
    const BlockLanes<3> where = frame.lanes<3>(), noiseSlope = frame.lanes<3>();
    float* const noise = frame.lane();
    forRungs(points, places, where, scratch, [&](int rung, const PointBlock& block, const Members& members) {
      noises_[std::size_t(rung)]->evalGrad(block, {noise}, noiseSlope, scratch);
      for (int i = 0; i < block.count; ++i) {
        const int at = members.at[i];
        const Place& place = places[std::size_t(at)];
        const float turned = (rung == place.rung ? -place.high : place.low) * place.angleRate * noise[i];
        values[0][at] += members.weight[i] * noise[i];
        for (int a = 0; a < 3; ++a)
          grads[a][at] += members.weight[i] * noiseSlope[a][i] + turned * slope[a][at];
      }
    });
    for (int i = 0; i < points.count; ++i) {
      const float value = values[0][i];
      values[0][i] = std::clamp(value, bounds_.min, bounds_.max);
      if (values[0][i] != value)
        for (float* const g : grads) g[i] = 0;
    }
  }

  Interval range(const Box& box, RangeMemo& memo) const override {
    const Interval frequency = memo.of(frequency_, box);
    const float first = stepOf(frequency.min), last = stepOf(frequency.max);
    Interval result = bounds_;
    bool isFirst = true;
    for (int rung = rungOf(first); rung <= rungOf(last); ++rung) {
      const Interval r = blendRange(rung, memo.of(noises_[std::size_t(rung)], box),
                                    memo.of(noises_[std::size_t(rung) + 1], box), first, last);
      result = isFirst ? r : result.hull(r);
      isFirst = false;
    }
    return {std::clamp(result.min, bounds_.min, bounds_.max),
            std::clamp(result.max, bounds_.min, bounds_.max)};
  }

  NodePtr<float> restricted(Restriction& restriction) const override {
    auto frequency = restrictNode(frequency_, restriction);
    if (frequency == frequency_) return nullptr;
    auto copy = std::make_shared<VaryingNoiseNode>(*this);
    copy->frequency_ = std::move(frequency);
    return copy;
  }

  float differenceStep() const override { return std::min(step_, frequency_->differenceStep()); }

 private:
  /// Points of a block that read one noise, with its weight.
  struct Members {
    std::array<std::uint8_t, kBlockSize> at;
    std::array<float, kBlockSize> weight;
  };

  static float smooth(float t) { return t * t * (3 - 2 * t); }
  static float cut(float bound) { return std::max(bound, std::min(kBlendReach * bound, kLeastCut)); }

  int steps() const { return int(noises_.size()) - 1; }

  /// The place of a frequency on the ladder, 0 to `steps`.
  float stepOf(float frequency) const {
    const float step = std::log2(frequency / least_) * perOctave_;
    return step > 0 ? std::min(step, float(steps())) : 0.0f;
  }
  int rungOf(float step) const { return std::min(int(step), steps() - 1); }

  void locate(const float* frequency, int count, std::array<Place, kBlockSize>& places) const {
    for (int i = 0; i < count; ++i) {
      const float step = stepOf(frequency[i]);
      const int rung = rungOf(step);
      const float t = step - float(rung), angle = kRightAngle * smooth(t);
      // Exactly 0 on the noises themselves, so that one is enough there.
      places[std::size_t(i)] = {
          rung, t == 1 ? 0.0f : std::cos(angle), t == 0 ? 0.0f : std::sin(angle),
          t == 0 || t == 1 ? 0.0f
                           : kRightAngle * 6 * t * (1 - t) * perOctave_ * kOctavesPerUnit / frequency[i]};
    }
  }

  /// Calls body(rung, points, members) with the points at which each noise has a weight.
  template <class Body>
  void forRungs(const PointBlock& points, const std::array<Place, kBlockSize>& places,
                const BlockLanes<3>& where, Scratch& scratch, const Body& body) const {
    int first = steps(), last = 0;
    for (int i = 0; i < points.count; ++i) {
      first = std::min(first, places[std::size_t(i)].rung);
      last = std::max(last, places[std::size_t(i)].rung + 1);
    }
    Members members;
    for (int rung = first; rung <= last; ++rung) {
      int count = 0;
      for (int i = 0; i < points.count; ++i) {
        const Place& place = places[std::size_t(i)];
        if (place.rung != rung && place.rung + 1 != rung) continue;
        const float weight = place.rung == rung ? place.low : place.high;
        if (weight == 0) continue;
        where[0][count] = points.x[i];
        where[1][count] = points.y[i];
        where[2][count] = points.z[i];
        members.weight[std::size_t(count)] = weight;
        members.at[std::size_t(count++)] = std::uint8_t(i);
      }
      if (count > 0) body(rung, scratch.pointBlock(where, count), members);
    }
  }

  /// What blends of values within `low` and `high` can be for steps from `first` to `last`.
  Interval blendRange(int rung, const Interval& low, const Interval& high, float first, float last) const {
    const float from = kRightAngle * smooth(std::clamp(first - float(rung), 0.0f, 1.0f));
    const float to = kRightAngle * smooth(std::clamp(last - float(rung), 0.0f, 1.0f));
    const Interval sine{std::max(std::sin(from) - kWeightError, 0.0f), std::sin(to) + kWeightError};
    const Interval cosine{std::max(std::cos(to) - kWeightError, 0.0f), std::cos(from) + kWeightError};
    const Interval sum = cosine * low + sine * high;
    // No blend is longer than the two values together, as a vector.
    const float above = std::hypot(std::max(low.max, 0.0f), std::max(high.max, 0.0f)) * (1 + kWeightError);
    const float below = std::hypot(std::min(low.min, 0.0f), std::min(high.min, 0.0f)) * (1 + kWeightError);
    return {std::max(sum.min, -below), std::min(sum.max, above)};
  }

  std::vector<NodePtr<float>> noises_;
  NodePtr<float> frequency_;
  float least_, perOctave_ = 1;
  Interval bounds_;
  float step_ = kNoLength;
};

}  // namespace

ScalarField noiseOfFrequency(const NoiseOptions& options, const ScalarField& frequency) {
  const Interval range = frequency.range(Box::everywhere());
  require(range.min > 0 && std::isfinite(range.max),
          "noiseOfFrequency: frequency must be > 0 with a finite range, got " + numberText(range.min) +
              " to " + numberText(range.max));
  NoiseOptions rung = options;
  rung.frequency = range.min;
  if (range.isPoint()) return noise(rung);
  const double ratio = double(range.max) / double(range.min);
  require(ratio <= double(kLargestFrequencyRatio),
          "noiseOfFrequency: the greatest frequency must be at most " +
              std::to_string(int(kLargestFrequencyRatio)) + " times the least, got " + numberText(range.min) +
              " to " + numberText(range.max));
  const int steps = std::max(1, int(std::ceil(std::log2(ratio) * kStepsPerOctave)));
  detail::Draw draw(options.seed + 0x7f4a7c15u);
  std::vector<NodePtr<float>> noises;
  for (int k = 0; k <= steps; ++k) {
    rung.frequency = float(double(range.min) * std::pow(ratio, double(k) / steps));
    rung.seed = draw.bits();
    noises.push_back(noise(rung).node());
  }
  return ScalarField(std::make_shared<VaryingNoiseNode>(std::move(noises), frequency.node(), range));
}

}  // namespace nephele

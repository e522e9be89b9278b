// No #pragma once: read once for every instruction set, by files that use <hwy/foreach_target.h>.
#if defined(NEPHELE_MARCHER) == defined(HWY_TARGET_TOGGLE)
#ifdef NEPHELE_MARCHER
#undef NEPHELE_MARCHER
#else
#define NEPHELE_MARCHER
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "nephele/render/march/detail/lit_steps.h"
#include "nephele/render/march/detail/local_light.h"
#include "nephele/render/march/detail/march_samples.h"
#include "nephele/render/march/march_kernels.h"
#include "nephele/render/volume/brick_walk.h"

HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

// Enough that the processor need not wait for one vector before it starts the next, and few enough that a ray
// ends soon behind what hides the rest.
constexpr int kBlock = 32;

// One ray's march: collects steps, adds the opacity of a block of them at a time, and the light of a vector
// of those that are seen. Three colours where MarchScene::isColoured, else one.
template <int kColours>
class Marcher {
 public:
  Marcher(const MarchScene& scene, const MarchRay& ray, MarchResult& result, MarchRecord* record)
      : scene_(scene),
        ray_(ray),
        result_(result),
        record_(record),
        isHeld_(!ray.holdout.empty()),
        needsBegin_(isHeld_ || record) {
    std::fill_n(through_, kColours, 1.0f);
    for (std::size_t i = 0; i != sumCount(); ++i) sums_[i] = hn::Zero(Lanes());
  }

  // `count` steps of length `ds` from `start` on, of this density if it is not negative. False once the ray
  // is as good as opaque.
  bool take(float start, float ds, int count, float density) {
    const Lanes d;
    float begin = start;
    start += ray_.jitter * ds;
    while (count > 0) {
      if (density >= 0 && !std::exchange(someKnown_, true)) std::fill_n(known_, kBlock, -1.0f);
      // Whole vectors: the processor would wait long before it loads one that was stored in parts.
      for (int i = count_ / kLanes * kLanes; i < std::min(count_ + count, kBlock); i += kLanes) {
        const Floats index = hn::Iota(d, float(i - count_));
        const auto isNew = hn::Ge(index, hn::Zero(d));
        const auto put = [&](Floats values, float* block) HWY_ATTR {
          hn::Store(hn::IfThenElse(isNew, values, hn::Load(d, block + i)), d, block + i);
        };
        put(hn::MulAdd(index, hn::Set(d, ds), hn::Set(d, start)), s_);
        put(hn::Set(d, ds), ds_);
        if (needsBegin_) put(hn::MulAdd(index, hn::Set(d, ds), hn::Set(d, begin)), begin_);
        if (someKnown_) put(hn::Set(d, density), known_);
      }
      const int taken = std::min(count, kBlock - count_);
      count_ += taken;
      count -= taken;
      start += float(taken) * ds;
      begin += float(taken) * ds;
      if (count_ == kBlock && (!flush() || isHidden_)) return false;
    }
    return true;
  }

  // One step that is known. False once the ray is as good as opaque.
  bool take(const MarchStep& step) {
    jitter_ = 0.5f;
    s_[count_] = step.place;
    begin_[count_] = step.begin;
    ds_[count_] = step.length;
    known_[count_] = step.opticalDepth / (scene_.extinction * step.length);
    someKnown_ = true;
    return ++count_ != kBlock || (flush() && !isHidden_);
  }

  void finish() {
    if (count_ > 0) flush();
    lightAll();
    result_.opticalDepth = depth_;
    if (record_) mark();
    addSums(result_);
  }

 private:
  // Adds the steps collected. False once the ray is as good as opaque.
  bool flush() {
    const Lanes d;
    // Of whole vectors.
    const int used = count_, end = (used + kLanes - 1) / kLanes * kLanes;
    if (used != end) repeatLast();
    count_ = 0;
    result_.samples += std::uint32_t(used);

    // Optical depths of the steps, and behind them.
    alignas(64) float own[kBlock], after[kBlock];
    Places places[kBlock / kLanes];
    const bool needsLookUp = !someKnown_ || someUnknown(end);
    if (needsLookUp) locateAll(scene_.density, ray_.density, end / kLanes, s_, places);
    readLight();
    if (needsLookUp) readAll(scene_.density, end / kLanes, places, own);
    if (std::exchange(someKnown_, false)) takeKnown(end, needsLookUp, own);
    Floats most = hn::Zero(d);
    for (int i = 0; i != end; i += kLanes) most = hn::Max(most, hn::Load(d, own + i));
    if (!scene_.emission.table && hn::AllTrue(d, hn::Eq(most, hn::Zero(d)))) return true;
    const float before = depth_;
    Floats behind = hn::Set(d, depth_);
    for (int i = 0; i != end; i += kLanes) {
      const Floats depth =
          hn::Mul(hn::Mul(hn::Load(d, own + i), hn::Set(d, scene_.extinction)), hn::Load(d, ds_ + i));
      const Floats sums = runningSum(depth, behind);
      behind = broadcastLast(sums);
      hn::Store(depth, d, own + i);
      hn::Store(sums, d, after + i);
    }
    depth_ = hn::GetLane(behind);
    if (!isHeld_ && before <= detail::kVisibleDepth && depth_ > detail::kVisibleDepth) {
      int first = 0;
      while (after[first] <= detail::kVisibleDepth) ++first;
      result_.distance = ray_.start + s_[first];
    }
    if (isHeld_) hold(before, after, used);
    if (record_) record(before, after, used);

    for (int i = 0; i != end; i += kLanes) {
      LitPart<kColours> steps{hn::Load(d, s_ + i), hn::Load(d, ds_ + i), {}};
      weigh(hn::Load(d, own + i), hn::Load(d, after + i), isHeld_ ? hn::Load(d, seen_ + i) : hn::Set(d, 1.0f),
            steps);
      if (lit_.empty() && hn::AllTrue(d, hn::Gt(steps.weightOfAll(), hn::Zero(d)))) {
        light(steps);
      } else {
        lit_.add(steps);
        if (lit_.full()) light(lit_.take());
      }
    }
    return *std::max_element(through_, through_ + kColours) > scene_.cutoff;
  }

  // Fills the last vector with steps of no length at the place of the last.
  void repeatLast() {
    const Lanes d;
    const Floats s = hn::Set(d, s_[count_ - 1]), known = hn::Set(d, known_[count_ - 1]);
    const int i = count_ / kLanes * kLanes;
    const auto isUsed = hn::Lt(hn::Iota(d, float(i)), hn::Set(d, float(count_)));
    hn::Store(hn::IfThenElse(isUsed, hn::Load(d, s_ + i), s), d, s_ + i);
    hn::Store(hn::IfThenElseZero(isUsed, hn::Load(d, ds_ + i)), d, ds_ + i);
    hn::Store(hn::IfThenElse(isUsed, hn::Load(d, known_ + i), known), d, known_ + i);
  }

  bool someUnknown(int end) const {
    const Lanes d;
    Floats least = hn::Load(d, known_);
    for (int i = kLanes; i < end; i += kLanes) least = hn::Min(least, hn::Load(d, known_ + i));
    return !hn::AllTrue(d, hn::Ge(least, hn::Zero(d)));
  }

  // Densities that are known in place of those looked up, if any were.
  void takeKnown(int end, bool wereLookedUp, float* density) {
    const Lanes d;
    for (int i = 0; i != end; i += kLanes) {
      const Floats known = hn::Load(d, known_ + i);
      const Floats other = wereLookedUp ? hn::Load(d, density + i) : known;
      hn::Store(hn::IfThenElse(hn::Ge(known, hn::Zero(d)), known, other), d, density + i);
    }
  }

  // What the holdout leaves of every step, and of its opacity.
  void hold(float before, const float* after, int used) {
    for (int i = 0; i != used; ++i) {
      const float begin = ray_.start + begin_[i];
      seen_[i] = ray_.holdout.seen(begin * ray_.cosine, (begin + ds_[i]) * ray_.cosine, after[i] - before,
                                   holdoutCursor_);
      for (int c = 0; c != 3; ++c) {
        const float share = scene_.extinctionColour[c];
        result_.heldOpacity[c] += seen_[i] * (std::exp(-std::min(before * share, 80.0f)) -
                                              std::exp(-std::min(after[i] * share, 80.0f)));
      }
      before = after[i];
      if (std::isinf(result_.distance) && isVisible(result_.heldOpacity))
        result_.distance = ray_.start + s_[i];
    }
    for (int i = used; i != kBlock; ++i) seen_[i] = seen_[used - 1];
    isHidden_ = seen_[used - 1] <= scene_.cutoff;
  }

  static bool isVisible(const float* opacity) {
    return opacity[0] + opacity[1] + opacity[2] > 3 * detail::kVisibleOpacity;
  }

  // The result so far, with the light that is waited for: what is added to it later stays as without a
  // record.
  void mark() {
    readLight();
    const MarchResult before = result_;
    const LitSteps<kColours> waiting = lit_;
    Floats sums[kMostSums];
    std::copy_n(sums_, sumCount(), sums);
    lightAll();
    addSums(result_);
    record_->marks.push_back({record_->steps.size(), result_});
    result_ = before;
    lit_ = waiting;
    std::copy_n(sums, sumCount(), sums_);
  }

  // The steps of a block, before its light is added.
  void record(float before, const float* after, int used) {
    mark();
    float opacity = record_->steps.empty() ? 0.0f : record_->steps.back().opacity;
    for (int i = 0; i != used; ++i) {
      if (after[i] == before && !scene_.emission.table) continue;
      const float gain = scene_.meanOpacity(after[i]) - scene_.meanOpacity(before);
      opacity = isHeld_ ? opacity + seen_[i] * gain : scene_.meanOpacity(after[i]);
      record_->steps.push_back({begin_[i], begin_[i] + ds_[i], opacity});
      before = after[i];
    }
  }

  // What steps weigh in the picture, by their own optical depths and those behind them: the transmittance
  // that each takes away, and nothing where the ray is as good as opaque. Adds what glows in them.
  HWY_INLINE void weigh(Floats own, Floats after, Floats seen, LitPart<kColours>& steps) {
    const Lanes d;
    Floats before[kColours];
    for (int c = 0; c != kColours; ++c) {
      const Floats depth = kColours == 1 ? after : hn::Mul(after, hn::Set(d, scene_.extinctionColour[c]));
      const Floats left = expOfMinus(hn::Min(depth, hn::Set(d, 80.0f)));
      before[c] = movedUp(left, hn::Set(d, through_[c]));
      steps.weight[c] = hn::Sub(before[c], left);
      through_[c] = hn::GetLane(broadcastLast(left));
    }
    Floats most = before[0];
    for (int c = 1; c != kColours; ++c) most = hn::Max(most, before[c]);
    const auto isSeen = hn::Gt(most, hn::Set(d, scene_.cutoff));
    for (Floats& weight : steps.weight) weight = hn::IfThenElseZero(isSeen, weight);
    if constexpr (kColours == 3) {
      if (scene_.emission.table) glow(own, before, seen, steps);
      if (scene_.colour.table) colour(own, steps);
    }
    if (isHeld_)
      for (Floats& weight : steps.weight) weight = hn::Mul(weight, seen);
  }

  // T (1 - exp(-t)) / t, by its series where the difference would lose its digits.
  void glow(Floats own, const Floats (&before)[kColours], Floats seen, const LitPart<kColours>& steps) {
    const Lanes d;
    Floats glow[3];
    sampleColour(scene_.emission, pointAt(ray_.density, steps.s), glow);
    const Floats step = hn::Mul(steps.length, hn::Set(d, scene_.extinction * scene_.emissionScale));
    for (int c = 0; c != 3; ++c) {
      const Floats t = hn::Mul(own, hn::Set(d, scene_.extinctionColour[c]));
      const Floats thin =
          hn::NegMulAdd(t, hn::NegMulAdd(t, hn::Set(d, 1.0f / 6), hn::Set(d, 0.5f)), hn::Set(d, 1.0f));
      const Floats mean = hn::IfThenElse(hn::Lt(t, hn::Set(d, 0.03f)), hn::Mul(before[c], thin),
                                         hn::Div(steps.weight[c], hn::Max(t, hn::Set(d, 0.03f))));
      result_.emission[c] +=
          hn::GetLane(hn::SumOfLanes(d, hn::Mul(hn::Mul(glow[c], step), hn::Mul(mean, seen))));
    }
  }

  void colour(Floats own, LitPart<kColours>& steps) {
    const Lanes d;
    const Floats density =
        hn::Div(own, hn::Max(hn::Mul(steps.length, hn::Set(d, scene_.extinction)), hn::Set(d, 1e-30f)));
    const auto some = hn::Gt(density, hn::Set(d, 1e-30f));
    Floats colour[3];
    sampleColour(scene_.colour, pointAt(ray_.density, steps.s), colour);
    for (int c = 0; c != 3; ++c)
      steps.weight[c] = hn::Mul(steps.weight[c], hn::IfThenElseZero(some, hn::Div(colour[c], density)));
  }

  // Of all that wait for it.
  void lightAll() {
    if (!lit_.empty()) light(lit_.take());
    readLight();
  }

  // Finds where the light of steps is. It is read when the next densities have been found: the processor does
  // not look far enough ahead to read one while it looks for the other.
  void light(const LitPart<kColours>& steps) {
    readLight();
    located_ = steps;
    isLocated_ = true;
    for (std::size_t sun = 0; sun != scene_.suns.size(); ++sun)
      locate<CodedBricks::kWidth>(scene_.suns[sun], pointAt(ray_.suns[sun], steps.s), places_[sun]);
    if (!scene_.scattered.empty())
      locate(scene_.scatteredSize, clamped(pointAt(ray_.scattered, steps.s), scene_.scatteredSize), cells_);
  }

  // Adds the light that located steps send to the eye.
  void readLight() {
    if (!std::exchange(isLocated_, false)) return;
    const Lanes d;
    const LitPart<kColours>& steps = located_;
    for (std::size_t sun = 0; sun != scene_.suns.size(); ++sun) {
      const Floats column = readCoded(scene_.suns[sun], places_[sun]);
      // Of every colour of the result, and one where a weight is all colours'.
      const int colours = kColours == 1 ? scene_.colours : kColours;
      Floats sums[3] = {hn::Zero(d), hn::Zero(d), hn::Zero(d)};
      for (int n = 0; n != scene_.octaves; ++n) {
        Floats lit[kColours];
        for (int c = 0; c != kColours; ++c) {
          const float share = scene_.extinction * scene_.attenuation[n] *
                              (kColours == 1 ? 1.0f : scene_.extinctionColour[c]) *
                              scene_.suns[sun].shadow[c];
          lit[c] = expOfMinus(hn::Min(hn::Mul(column, hn::Set(d, share)), hn::Set(d, 80.0f)));
        }
        for (int c = 0; c != colours; ++c)
          sums[c] = hn::MulAdd(lit[kColours == 1 ? 0 : c], hn::Set(d, ray_.weight[sun][c][n]), sums[c]);
      }
      for (int c = 0; c != colours; ++c) {
        Floats& sum = sums_[3 * sun + std::size_t(c)];
        sum = hn::MulAdd(sums[c], steps.weight[kColours == 1 ? 0 : c], sum);
      }
    }
    for (std::size_t n = 0; n != scene_.locals.size(); ++n)
      addLocal(scene_, ray_, n, jitter_, steps.s, steps.length, steps.weight, result_);
    scattered(steps);
  }

  // The part of it that the lattices hold.
  void scattered(const LitPart<kColours>& steps) {
    Floats* sum = sums_ + 3 * scene_.suns.size();
    for (const MarchScene::Scattered& lattice : scene_.scattered) {
      Floats two[2];
      readTwo(lattice.nodes, cells_, two);
      for (int n = 0; n != 2; ++n, ++sum)
        *sum = hn::MulAdd(two[n], steps.weight[kColours == 1 ? 0 : lattice.kinds[n].part], *sum);
    }
  }

  // Of the light so far, a vector each: three colours of every sun, then the scattered lattices.
  static constexpr std::size_t kMostSums = 3 * MarchScene::kMostSuns + 2 * MarchScene::kMostScattered;
  std::size_t sumCount() const { return 3 * scene_.suns.size() + 2 * scene_.scattered.size(); }

  void addSums(MarchResult& result) const {
    const Lanes d;
    const Floats* sum = sums_;
    for (std::size_t sun = 0; sun != scene_.suns.size(); ++sun, sum += 3)
      for (int c = 0; c != scene_.colours; ++c) result.suns[sun][c] += hn::GetLane(hn::SumOfLanes(d, sum[c]));
    for (const MarchScene::Scattered& lattice : scene_.scattered) {
      for (int n = 0; n != lattice.count; ++n)
        result.of(lattice.kinds[n]) += hn::GetLane(hn::SumOfLanes(d, sum[n]));
      sum += 2;
    }
  }

  const MarchScene& scene_;
  const MarchRay& ray_;
  MarchResult& result_;
  MarchRecord* record_;
  const bool isHeld_, needsBegin_;
  // Whether some densities of the block need no look-up.
  bool someKnown_ = false;
  // Nothing farther away is seen.
  bool isHidden_ = false;
  std::size_t holdoutCursor_ = 0;
  // Where in its step a sample is, about.
  float jitter_ = ray_.jitter;
  alignas(64) float seen_[kBlock];
  alignas(64) float s_[kBlock] = {};
  alignas(64) float ds_[kBlock] = {};
  alignas(64) float begin_[kBlock] = {};
  // Densities, negative where they have to be looked up.
  alignas(64) float known_[kBlock] = {};
  int count_ = 0;
  float depth_ = 0.0f;
  // What is left of light from behind, per colour.
  float through_[kColours];
  LitSteps<kColours> lit_;
  // Steps whose light is located, and where it is.
  bool isLocated_ = false;
  LitPart<kColours> located_;
  Places places_[MarchScene::kMostSuns];
  Cells cells_;
  Floats sums_[kMostSums];
};

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif

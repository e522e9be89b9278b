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

#include "nephele/render/march/detail/local_light.h"
#include "nephele/render/march/detail/march_samples.h"
#include "nephele/render/march/march_kernels.h"
#include "nephele/render/volume/brick_walk.h"

HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

// Two vectors of the widest kind: while one waits for memory, the processor works on the other.
constexpr int kBlock = 32;

// One ray's march: collects steps, and adds a block of them at a time.
class Marcher {
 public:
  Marcher(const MarchScene& scene, const MarchRay& ray, MarchResult& result, MarchRecord* record)
      : scene_(scene),
        ray_(ray),
        result_(result),
        record_(record),
        isHeld_(!ray.holdout.empty()),
        needsBegin_(isHeld_ || record) {}

  // `count` steps of length `ds` from `start` on, of this density if it is not negative. False once the ray
  // is as good as opaque.
  bool take(float start, float ds, int count, float density) {
    const Lanes d;
    const int lanes = int(hn::Lanes(d));
    float begin = start;
    start += ray_.jitter * ds;
    while (count > 0) {
      if (density >= 0 && !someKnown_) {
        std::fill_n(known_, count_, -1.0f);
        someKnown_ = true;
      }
      // Whole vectors, whatever room there is: the blocks have as much again behind them.
      for (int i = 0; i < std::min(count, kBlock); i += lanes) {
        const Floats index = hn::Iota(d, float(i));
        hn::StoreU(hn::MulAdd(index, hn::Set(d, ds), hn::Set(d, start)), d, s_ + count_ + i);
        hn::StoreU(hn::Set(d, ds), d, ds_ + count_ + i);
        if (needsBegin_)
          hn::StoreU(hn::MulAdd(index, hn::Set(d, ds), hn::Set(d, begin)), d, begin_ + count_ + i);
        if (someKnown_) hn::StoreU(hn::Set(d, density), d, known_ + count_ + i);
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
    result_.opticalDepth = depth_;
    if (record_) mark();
  }

 private:
  template <int kColours>
  struct Weights {
    alignas(64) float of[kColours][kBlock];
  };

  // Adds the steps collected. False once the ray is as good as opaque.
  bool flush() { return count_ > kBlock / 2 ? flushFirst<kBlock>() : flushFirst<kBlock / 2>(); }

  // Those among the first kSize of the block, where all are.
  template <int kSize>
  bool flushFirst() {
    const Lanes d;
    const std::size_t lanes = hn::Lanes(d);
    const int used = count_;
    for (int i = used; i != kSize; ++i) s_[i] = s_[used - 1], ds_[i] = 0.0f, known_[i] = known_[used - 1];
    count_ = 0;
    const bool someKnown = someKnown_;
    someKnown_ = false;
    result_.samples += std::uint32_t(used);

    // The first sun's light is read here, beside the densities, which have to be waited for.
    alignas(64) float depth[kSize], column[kSize];
    const bool hasSun = !scene_.suns.empty();
    Places places[kSize / kLanes], sunPlaces[kSize / kLanes];
    if (!someKnown) locateBlock<kSize>(scene_.density, ray_.density, s_, places);
    if (hasSun) locateBlock<kSize>(scene_.suns[0], ray_.suns[0], s_, sunPlaces);
    if (!someKnown) {
      readBlock<kSize>(scene_.density, places, depth);
    } else {
      for (std::size_t i = 0; i < kSize; i += lanes) {
        Floats density = hn::Load(d, known_ + i);
        if (!hn::AllTrue(d, hn::Ge(density, hn::Zero(d)))) {
          locate<CodedBricks::kWidth>(scene_.density, pointAt(ray_.density, hn::Load(d, s_ + i)), places[0]);
          density = readCoded(scene_.density, places[0]);
        }
        hn::Store(density, d, depth + i);
      }
    }
    if (!scene_.emission.table) {
      Floats most = hn::Zero(d);
      for (std::size_t i = 0; i < kSize; i += lanes) most = hn::Max(most, hn::Load(d, depth + i));
      if (hn::AllTrue(d, hn::Eq(most, hn::Zero(d)))) return true;
    }
    if (hasSun) readBlock<kSize>(scene_.suns[0], sunPlaces, column);
    const Floats extinction = hn::Set(d, scene_.extinction);
    for (std::size_t i = 0; i < kSize; i += lanes)
      hn::Store(hn::Mul(hn::Mul(hn::Load(d, depth + i), extinction), hn::Load(d, ds_ + i)), d, depth + i);
    alignas(64) float after[kBlock];
    const float start = depth_;
    Floats behind = hn::Set(d, depth_);
    for (std::size_t i = 0; i < kSize; i += lanes) {
      const Floats sums = runningSum(hn::Load(d, depth + i), behind);
      behind = broadcastLast(sums);
      hn::Store(sums, d, after + i);
    }
    depth_ = hn::GetLane(behind);
    if (!isHeld_ && start <= detail::kVisibleDepth && depth_ > detail::kVisibleDepth) {
      int first = 0;
      while (after[first] <= detail::kVisibleDepth) ++first;
      result_.distance = ray_.start + s_[first];
    }

    if (isHeld_) hold(start, after, used);
    if (record_) record(start, after, used);
    if (scene_.isColoured()) return flushColours<kSize>(depth, after, column);

    Weights<1> weights;
    Floats through = hn::Set(d, through_);
    for (std::size_t i = 0; i < kSize; i += lanes) {
      const Floats tau = hn::Min(hn::Load(d, after + i), hn::Set(d, 80.0f));
      const Floats left = expOfMinus(tau);
      Floats weight = hn::Sub(movedUp(left, through), left);
      if (isHeld_) weight = hn::Mul(weight, hn::Load(d, seen_ + i));
      hn::Store(weight, d, weights.of[0] + i);
      through = broadcastLast(left);
    }
    through_ = hn::GetLane(through);
    light<kSize>(weights, column);
    return through_ > scene_.cutoff;
  }

  // What the holdout leaves of every step, and of its opacity.
  void hold(float before, const float* after, int used) {
    for (int i = 0; i != used; ++i) {
      const float middle = ray_.start + begin_[i] + 0.5f * ds_[i];
      seen_[i] = ray_.holdout.transmittance(middle * ray_.cosine, holdoutCursor_);
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

  void mark() { record_->marks.push_back({record_->steps.size(), result_}); }

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

  // The same where colours differ in more than their albedo: `after` are optical depths behind the steps,
  // `depth` their own.
  template <int kSize>
  bool flushColours(const float* depth, const float* after, const float* column) {
    const Lanes d;
    const std::size_t lanes = hn::Lanes(d);
    alignas(64) float through[3][kBlock + 1];
    for (int c = 0; c != 3; ++c) {
      through[c][0] = throughColours_[c];
      const Floats share = hn::Set(d, scene_.extinctionColour[c]);
      for (std::size_t i = 0; i < kSize; i += lanes) {
        const Floats tau = hn::Min(hn::Mul(hn::Load(d, after + i), share), hn::Set(d, 80.0f));
        hn::StoreU(expOfMinus(tau), d, through[c] + 1 + i);
      }
      throughColours_[c] = through[c][kSize];
    }
    Weights<3> weights;
    for (std::size_t i = 0; i < kSize; i += lanes) {
      const Floats s = hn::Load(d, s_ + i), own = hn::Load(d, depth + i);
      Floats weight[3];
      for (int c = 0; c != 3; ++c)
        weight[c] = hn::Sub(hn::LoadU(d, through[c] + i), hn::LoadU(d, through[c] + i + 1));
      const Floats seen = isHeld_ ? hn::Load(d, seen_ + i) : hn::Set(d, 1.0f);
      if (scene_.emission.table) {
        // T (1 - exp(-t)) / t, by its series where the difference would lose its digits.
        Floats glow[3];
        sampleColour(scene_.emission, pointAt(ray_.density, s), glow);
        const Floats step =
            hn::Mul(hn::Load(d, ds_ + i), hn::Set(d, scene_.extinction * scene_.emissionScale));
        for (int c = 0; c != 3; ++c) {
          const Floats t = hn::Mul(own, hn::Set(d, scene_.extinctionColour[c]));
          const Floats thin =
              hn::NegMulAdd(t, hn::NegMulAdd(t, hn::Set(d, 1.0f / 6), hn::Set(d, 0.5f)), hn::Set(d, 1.0f));
          const Floats mean =
              hn::IfThenElse(hn::Lt(t, hn::Set(d, 0.03f)), hn::Mul(hn::LoadU(d, through[c] + i), thin),
                             hn::Div(weight[c], hn::Max(t, hn::Set(d, 0.03f))));
          result_.emission[c] +=
              hn::GetLane(hn::SumOfLanes(d, hn::Mul(hn::Mul(glow[c], step), hn::Mul(mean, seen))));
        }
      }
      if (scene_.colour.table) {
        const Floats density = hn::Div(
            own, hn::Max(hn::Mul(hn::Load(d, ds_ + i), hn::Set(d, scene_.extinction)), hn::Set(d, 1e-30f)));
        const auto some = hn::Gt(density, hn::Set(d, 1e-30f));
        Floats colour[3];
        sampleColour(scene_.colour, pointAt(ray_.density, s), colour);
        for (int c = 0; c != 3; ++c)
          weight[c] = hn::Mul(weight[c], hn::IfThenElseZero(some, hn::Div(colour[c], density)));
      }
      for (int c = 0; c != 3; ++c) hn::Store(hn::Mul(weight[c], seen), d, weights.of[c] + i);
    }
    light<kSize>(weights, column);
    return std::max({throughColours_[0], throughColours_[1], throughColours_[2]}) > scene_.cutoff;
  }

  // Adds the light that steps of one weight, or of one for each colour, send to the eye.
  template <int kSize, int kColours>
  void light(const Weights<kColours>& weights, const float* firstColumn) {
    const Lanes d;
    for (std::size_t sun = 0; sun != scene_.suns.size(); ++sun) {
      alignas(64) float other[kSize];
      if (sun > 0) sampleBlock<kSize>(scene_.suns[sun], ray_.suns[sun], s_, other);
      const float* column = sun > 0 ? other : firstColumn;
      for (int n = 0; n != scene_.octaves; ++n)
        for (int c = 0; c != kColours; ++c) {
          const float share = scene_.extinction * scene_.attenuation[n] *
                              (kColours == 1 ? 1.0f : scene_.extinctionColour[c]) *
                              scene_.suns[sun].shadow[c];
          Floats sum = hn::Zero(d);
          for (int i = 0; i != kSize; i += kLanes) {
            const Floats left =
                hn::Min(hn::Mul(hn::Load(d, column + i), hn::Set(d, share)), hn::Set(d, 80.0f));
            sum = hn::MulAdd(expOfMinus(left), hn::Load(d, weights.of[c] + i), sum);
          }
          const float all = hn::GetLane(hn::SumOfLanes(d, sum));
          if constexpr (kColours == 1)
            for (int k = 0; k != scene_.colours; ++k) result_.suns[sun][k] += all * ray_.weight[sun][k][n];
          else
            result_.suns[sun][c] += all * ray_.weight[sun][c][n];
        }
    }
    if (scene_.locals.empty() && scene_.scattered.empty() && (kColours == 1 || !scene_.glow[0])) return;
    for (int i = 0; i != kSize; i += kLanes) {
      const Floats s = hn::Load(d, s_ + i), ds = hn::Load(d, ds_ + i);
      Floats weight[kColours];
      for (int c = 0; c != kColours; ++c) weight[c] = hn::Load(d, weights.of[c] + i);
      for (std::size_t n = 0; n != scene_.locals.size(); ++n)
        addLocal(scene_, ray_, n, jitter_, s, ds, weight, result_);
      if (!scene_.scattered.empty()) scattered(s, weight);
      if constexpr (kColours == 3)
        if (scene_.glow[0]) scatteredGlow(s, weight);
    }
  }

  void scatteredGlow(Floats s, const Floats (&weight)[3]) {
    const Lanes d;
    Cells cells;
    locate(scene_.scatteredSize, clamped(pointAt(ray_.scattered, s), scene_.scatteredSize), cells);
    for (int c = 0; c != 3; ++c) {
      const Floats there = read(scene_.glow[c], cells);
      result_.emission[c] += hn::GetLane(hn::SumOfLanes(d, hn::Mul(there, weight[c])));
    }
  }

  template <int kColours>
  void scattered(Floats s, const Floats (&weight)[kColours]) {
    const Lanes d;
    Cells cells;
    locate(scene_.scatteredSize, clamped(pointAt(ray_.scattered, s), scene_.scatteredSize), cells);
    std::size_t lattice = 0;
    for (std::size_t light = 0; light <= scene_.lightCount(); ++light) {
      float* result = light < scene_.lightCount() ? result_.suns[light] : result_.sky;
      for (int c = 0; c != scene_.colours; ++c) {
        const float* values = scene_.scattered[lattice++];
        if (!values) continue;
        const Floats there = read(values, cells);
        result[c] += hn::GetLane(hn::SumOfLanes(d, hn::Mul(there, weight[kColours == 1 ? 0 : c])));
      }
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
  alignas(64) float s_[2 * kBlock];
  alignas(64) float ds_[2 * kBlock];
  alignas(64) float begin_[2 * kBlock];
  // Densities, negative where they have to be looked up.
  alignas(64) float known_[2 * kBlock];
  int count_ = 0;
  float depth_ = 0.0f;
  float through_ = 1.0f;
  float throughColours_[3] = {1.0f, 1.0f, 1.0f};
};

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif

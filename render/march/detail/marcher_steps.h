// How a Marcher adds a block of steps. No #pragma once: read for every instruction set, by
// <hwy/foreach_target.h>.
#if defined(NEPHELE_MARCHER_STEPS) == defined(HWY_TARGET_TOGGLE)
#ifdef NEPHELE_MARCHER_STEPS
#undef NEPHELE_MARCHER_STEPS
#else
#define NEPHELE_MARCHER_STEPS
#endif

#include <hwy/highway.h>

#include <utility>

#include "nephele/render/march/detail/marcher.h"

HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

template <int kColours>
inline bool Marcher<kColours>::flush() {
  const Lanes d;
  const auto ofWholeVectors = [](int n) { return (n + kLanes - 1) / kLanes * kLanes; };
  int used = count_, end = ofWholeVectors(used);
  if (used != end) repeatLast();
  count_ = 0;
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
  if (!scene_.glows() && hn::AllTrue(d, hn::Eq(most, hn::Zero(d)))) {
    result_.samples += unsigned(used);
    return true;
  }
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
  const bool isOpaque = hn::GetLane(behind) >= opaque_;
  // The sum of whole vectors may round up over the limit where that of no step does.
  for (int i = 0; isOpaque && i != used; ++i)
    if (after[i] >= opaque_) used = i + 1;
  if (isHeld_) used = hold(before, after, used);
  end = ofWholeVectors(used);
  depth_ = after[used - 1];
  result_.samples += unsigned(used);
  if (!isHeld_ && before <= detail::kVisibleDepth && depth_ > detail::kVisibleDepth) {
    int first = 0;
    while (after[first] <= detail::kVisibleDepth) ++first;
    result_.distance = ray_.start + s_[first];
  }
  if (record_) record(before, after, used);

  for (int i = 0; i != end; i += kLanes) {
    LitPart<kColours> steps{hn::Load(d, s_ + i), hn::Load(d, ds_ + i), {}};
    weigh(i, hn::Load(d, own + i), hn::Load(d, after + i),
          isHeld_ ? hn::Load(d, seen_ + i) : hn::Set(d, 1.0f), steps);
    if constexpr (kColours == 3) {
      for (int c = 0; c != 3 && scene_.hasStepColours; ++c)
        steps.weight[c] = hn::Mul(steps.weight[c], hn::Load(d, colours_[c] + i));
      Floats* coloured = sums_ + sumCount() - 3;
      for (int c = 0; c != 3 && scene_.hasColour(); ++c) coloured[c] = hn::Add(coloured[c], steps.weight[c]);
    }
    if (lit_.empty() && hn::AllTrue(d, hn::Gt(steps.weightOfAll(), hn::Zero(d)))) {
      light(steps);
    } else {
      lit_.add(steps);
      if (lit_.full()) light(lit_.take());
    }
  }
  return !isOpaque && !(isHeld_ && seen_[used - 1] <= scene_.cutoff);
}

template <int kColours>
inline void Marcher<kColours>::repeatLast() {
  const Lanes d;
  const Floats s = hn::Set(d, s_[count_ - 1]), known = hn::Set(d, known_[count_ - 1]);
  const int i = count_ / kLanes * kLanes;
  const auto isUsed = hn::Lt(hn::Iota(d, float(i)), hn::Set(d, float(count_)));
  hn::Store(hn::IfThenElse(isUsed, hn::Load(d, s_ + i), s), d, s_ + i);
  hn::Store(hn::IfThenElseZero(isUsed, hn::Load(d, ds_ + i)), d, ds_ + i);
  hn::Store(hn::IfThenElse(isUsed, hn::Load(d, known_ + i), known), d, known_ + i);
}

template <int kColours>
inline bool Marcher<kColours>::someUnknown(int end) const {
  const Lanes d;
  Floats least = hn::Load(d, known_);
  for (int i = kLanes; i < end; i += kLanes) least = hn::Min(least, hn::Load(d, known_ + i));
  return !hn::AllTrue(d, hn::Ge(least, hn::Zero(d)));
}

template <int kColours>
inline void Marcher<kColours>::takeKnown(int end, bool wereLookedUp, float* density) {
  const Lanes d;
  for (int i = 0; i != end; i += kLanes) {
    const Floats known = hn::Load(d, known_ + i);
    const Floats other = wereLookedUp ? hn::Load(d, density + i) : known;
    hn::Store(hn::IfThenElse(hn::Ge(known, hn::Zero(d)), known, other), d, density + i);
  }
}

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif

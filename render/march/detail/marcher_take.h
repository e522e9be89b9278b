// How a Marcher collects steps. No #pragma once: read for every instruction set, by <hwy/foreach_target.h>.
#if defined(NEPHELE_MARCHER_TAKE) == defined(HWY_TARGET_TOGGLE)
#ifdef NEPHELE_MARCHER_TAKE
#undef NEPHELE_MARCHER_TAKE
#else
#define NEPHELE_MARCHER_TAKE
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <utility>

#include "nephele/render/march/detail/marcher.h"

HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

template <int kColours>
inline bool Marcher<kColours>::take(float start, float ds, int count, float density) {
  const Lanes d;
  return takeAll(count, density, [&](Floats n, Floats& length) HWY_ATTR {
    length = hn::Set(d, ds);
    return hn::MulAdd(n, length, hn::Set(d, start));
  });
}

template <int kColours>
inline bool Marcher<kColours>::take(const detail::GrowingSteps& steps, float density) {
  const Lanes d;
  const auto placeOf = [&](Floats n) HWY_ATTR {
    const Floats v = hn::MulAdd(n, hn::Set(d, steps.each), hn::Set(d, steps.firstV)),
                 grown = hn::Min(v, hn::Set(d, steps.law.lastV)), six = hn::Set(d, 6.0f);
    const Floats curve =
        hn::Div(hn::Mul(grown, hn::Sub(six, grown)), hn::NegMulAdd(hn::Set(d, 4.0f), grown, six));
    const Floats x = hn::MulAdd(hn::Sub(v, grown), hn::Set(d, steps.law.most), curve);
    return hn::MulAdd(hn::Sub(x, hn::Set(d, steps.firstX)), hn::Set(d, steps.lengthPerX),
                      hn::Set(d, steps.start));
  };
  return takeAll(steps.count, density, [&](Floats n, Floats& length) HWY_ATTR {
    const Floats begin = placeOf(n);
    length = hn::Sub(placeOf(hn::Add(n, hn::Set(d, 1.0f))), begin);
    return begin;
  });
}

template <int kColours>
template <class StepsOf>
HWY_INLINE bool Marcher<kColours>::takeAll(int count, float density, StepsOf&& stepsOf) {
  const Lanes d;
  for (int done = 0; done != count;) {
    if (density >= 0 && !std::exchange(someKnown_, true)) std::fill_n(known_, kBlock, -1.0f);
    const int taken = std::min(count - done, together_ - count_);
    // Whole vectors: the processor would wait long before it loads one that was stored in parts.
    for (int i = count_ / kLanes * kLanes; i < count_ + taken; i += kLanes) {
      const Floats index = hn::Iota(d, float(i - count_));
      const auto isNew = hn::Ge(index, hn::Zero(d));
      const auto put = [&](Floats values, float* block) HWY_ATTR {
        hn::Store(hn::IfThenElse(isNew, values, hn::Load(d, block + i)), d, block + i);
      };
      Floats length;
      const Floats begin = stepsOf(hn::Add(index, hn::Set(d, float(done))), length);
      put(hn::MulAdd(length, hn::Set(d, ray_.jitter), begin), s_);
      put(length, ds_);
      if (needsBegin_) put(begin, begin_);
      if (someKnown_) put(hn::Set(d, density), known_);
    }
    count_ += taken;
    done += taken;
    if (count_ == together_ && !flush()) return false;
  }
  return true;
}

template <int kColours>
inline bool Marcher<kColours>::take(const MarchStep& step) {
  jitter_ = 0.5f;
  s_[count_] = step.place;
  begin_[count_] = step.begin;
  ds_[count_] = step.length;
  known_[count_] = step.opticalDepth / (scene_.extinction * step.length);
  someKnown_ = true;
  for (int c = 0; c != kColours; ++c) {
    colours_[c][count_] = step.colour[c];
    glows_[c][count_] = step.glow[c];
  }
  return ++count_ != together_ || flush();
}

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif

// No #pragma once: read once for every instruction set, by files that use <hwy/foreach_target.h>.
#if defined(NEPHELE_MARCHER_RECORD) == defined(HWY_TARGET_TOGGLE)
#ifdef NEPHELE_MARCHER_RECORD
#undef NEPHELE_MARCHER_RECORD
#else
#define NEPHELE_MARCHER_RECORD
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>

#include "nephele/render/march/detail/marcher.h"

/// What a Marcher hides behind holdouts, what it records for deep pictures, and what it adds to a result.
HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

template <int kColours>
inline int Marcher<kColours>::hold(float before, const float* after, int used) {
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
    const float* held = result_.heldOpacity;
    if (std::isinf(result_.distance) && held[0] + held[1] + held[2] > 3 * detail::kVisibleOpacity)
      result_.distance = ray_.start + s_[i];
    if (seen_[i] <= scene_.cutoff) used = i + 1;
  }
  std::fill(seen_ + used, seen_ + kBlock, 0.0f);
  return used;
}

template <int kColours>
inline void Marcher<kColours>::lightAll() {
  if (!lit_.empty()) light(lit_.take());
  readLight();
}

template <int kColours>
inline void Marcher<kColours>::mark() {
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

template <int kColours>
inline void Marcher<kColours>::record(float before, const float* after, int used) {
  mark();
  float opacity = record_->steps.empty() ? 0.0f : record_->steps.back().opacity;
  for (int i = 0; i != used; ++i) {
    if (after[i] == before && !scene_.glows()) continue;
    const float gain = scene_.meanOpacity(after[i]) - scene_.meanOpacity(before);
    opacity = isHeld_ ? opacity + seen_[i] * gain : scene_.meanOpacity(after[i]);
    record_->steps.push_back({begin_[i], begin_[i] + ds_[i], opacity});
    before = after[i];
  }
}

template <int kColours>
inline void Marcher<kColours>::addSums(MarchResult& result) const {
  const Lanes d;
  const Floats* sum = sums_;
  for (std::size_t sun = 0; sun != scene_.suns.size(); ++sun, sum += 3)
    for (int c = 0; c != scene_.colours; ++c) result.suns[sun][c] += hn::GetLane(hn::SumOfLanes(d, sum[c]));
  for (const MarchScene::Scattered& lattice : scene_.scattered) {
    for (int n = 0; n != lattice.count; ++n)
      result.of(lattice.kinds[n]) += hn::GetLane(hn::SumOfLanes(d, sum[n]));
    sum += 2;
  }
  if constexpr (kColours == 3)
    for (int c = 0; c != 3; ++c) result.colouredOpacity[c] += hn::GetLane(hn::SumOfLanes(d, sum[c]));
}

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif

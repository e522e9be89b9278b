// No #pragma once: read once for every instruction set, by files that use <hwy/foreach_target.h>.
#if defined(NEPHELE_LIT_STEPS) == defined(HWY_TARGET_TOGGLE)
#ifdef NEPHELE_LIT_STEPS
#undef NEPHELE_LIT_STEPS
#else
#define NEPHELE_LIT_STEPS
#endif

#include <hwy/highway.h>

#include "nephele/render/march/detail/march_lanes.h"

/// Steps of a ray that wait for their light: those that are seen at all, without gaps between them, so that
/// vectors of them are full.
HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

// A vector of steps that wait for their light: where it is read, how long they are and what they weigh.
template <int kColours>
struct LitPart {
  Floats s, length, weight[kColours];

  HWY_INLINE Floats weightOfAll() const {
    Floats all = weight[0];
    for (int c = 1; c != kColours; ++c) all = hn::Add(all, weight[c]);
    return all;
  }
};

// Those that weigh anything, the first `count` of the result; the rest weighs nothing.
template <int kColours>
HWY_INLINE LitPart<kColours> compacted(const LitPart<kColours>& steps, int& count) {
  const Lanes d;
  const auto some = hn::Gt(steps.weightOfAll(), hn::Zero(d));
  count = int(hn::CountTrue(d, some));
  const auto used = hn::FirstN(d, std::size_t(count));
  LitPart<kColours> out{hn::Compress(steps.s, some), hn::Compress(steps.length, some), {}};
  for (int c = 0; c != kColours; ++c)
    out.weight[c] = hn::IfThenElseZero(used, hn::Compress(steps.weight[c], some));
  return out;
}

// Steps without gaps between them, so that vectors of them are full.
template <int kColours>
class LitSteps {
 public:
  using Part = LitPart<kColours>;

  bool empty() const { return count_ == 0; }
  // A whole vector of them.
  bool full() const { return count_ >= kLanes; }

  // Those of these that weigh anything, while it is not full.
  HWY_INLINE void add(const Part& steps) {
    const Lanes d;
    int added;
    const Part some = compacted(steps, added);
    hn::StoreU(some.s, d, s_ + count_);
    hn::StoreU(some.length, d, length_ + count_);
    for (int c = 0; c != kColours; ++c) hn::StoreU(some.weight[c], d, weight_[c] + count_);
    count_ += added;
  }

  // The first vector, while it is not empty. Lanes that hold nothing repeat the last one without a weight.
  HWY_INLINE Part take() {
    const Lanes d;
    const auto part = [&](int from) HWY_ATTR {
      Part steps{hn::LoadU(d, s_ + from), hn::LoadU(d, length_ + from), {}};
      for (int c = 0; c != kColours; ++c) steps.weight[c] = hn::LoadU(d, weight_[c] + from);
      return steps;
    };
    Part first = part(0);
    if (count_ == kLanes) {
      count_ = 0;
      return first;
    }
    if (full()) {
      const Part next = part(kLanes);
      hn::StoreU(next.s, d, s_);
      hn::StoreU(next.length, d, length_);
      for (int c = 0; c != kColours; ++c) hn::StoreU(next.weight[c], d, weight_[c]);
      count_ -= kLanes;
      return first;
    }
    const auto used = hn::FirstN(d, std::size_t(count_));
    first.s = hn::IfThenElse(used, first.s, hn::Set(d, s_[count_ - 1]));
    first.length = hn::IfThenElseZero(used, first.length);
    for (int c = 0; c != kColours; ++c) first.weight[c] = hn::IfThenElseZero(used, first.weight[c]);
    count_ = 0;
    return first;
  }

 private:
  int count_ = 0;
  alignas(64) float s_[2 * kLanes], length_[2 * kLanes], weight_[kColours][2 * kLanes];
};

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif

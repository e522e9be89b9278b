// No #pragma once: read once for every instruction set, by files that use <hwy/foreach_target.h>.
#if defined(NEPHELE_MARCH_LANES) == defined(HWY_TARGET_TOGGLE)
#ifdef NEPHELE_MARCH_LANES
#undef NEPHELE_MARCH_LANES
#else
#define NEPHELE_MARCH_LANES
#endif

#include <hwy/highway.h>

#include <cstdint>
#include <type_traits>

#include "nephele/render/light/exp_of_minus_lanes.h"
#include "nephele/render/volume/lattice_ray.h"

/// Vectors of floats as the march uses them: points along rays, sums along the lanes, exp.
HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Two vectors of the widest kind: while one waits for memory, the processor works on the other.
using Lanes = hn::CappedTag<float, 16>;
using IntLanes = hn::RebindToSigned<Lanes>;
using Floats = hn::Vec<Lanes>;
using Ints = hn::Vec<IntLanes>;

struct Point {
  Floats x, y, z;
};

HWY_INLINE Point pointAt(const LatticeRay& ray, Floats s) {
  const Lanes d;
  return {hn::MulAdd(s, hn::Set(d, ray.direction.x), hn::Set(d, ray.origin.x)),
          hn::MulAdd(s, hn::Set(d, ray.direction.y), hn::Set(d, ray.origin.y)),
          hn::MulAdd(s, hn::Set(d, ray.direction.z), hn::Set(d, ray.origin.z))};
}

constexpr int kLanes = int(hn::MaxLanes(Lanes()));

// An integer >= 0 and < 2^23 that is held as a float.
HWY_INLINE Ints wholeOf(Floats x) {
  const Lanes d;
  const IntLanes i;
  return hn::And(hn::BitCast(i, hn::Add(x, hn::Set(d, 8388608.0f))), hn::Set(i, 0x7fffff));
}

// Of vectors that hold pairs side by side, all the first halves or all the second.
#if HWY_TARGET == HWY_SCALAR
HWY_INLINE Floats firstOf(Floats low, Floats) {
  return low;
}
HWY_INLINE Floats secondOf(Floats, Floats high) {
  return high;
}
#else
HWY_INLINE Floats firstOf(Floats low, Floats high) {
  return hn::ConcatEven(Lanes(), high, low);
}
HWY_INLINE Floats secondOf(Floats low, Floats high) {
  return hn::ConcatOdd(Lanes(), high, low);
}
#endif

// Lane n of the result is lane `from[n]` of x.
struct LaneOrder {
  alignas(64) std::int32_t from[kLanes];
};
HWY_INLINE Floats reordered(Floats x, [[maybe_unused]] const LaneOrder& order) {
#if HWY_TARGET == HWY_SCALAR
  return x;
#else
  return hn::TableLookupLanes(x, hn::SetTableIndices(Lanes(), order.from));
#endif
}
template <class From>
constexpr LaneOrder laneOrder(From&& from) {
  LaneOrder order{};
  for (int n = 0; n != kLanes; ++n) order.from[n] = from(n);
  return order;
}

// The sums of each lane and those before it, and `before`.
HWY_INLINE Floats runningSum(Floats x, Floats before) {
  const Lanes d;
  const IntLanes i;
  const auto step = [&](auto width) HWY_ATTR {
    constexpr int kWidth = decltype(width)::value;
    if constexpr (kWidth < kLanes) {
      static constexpr LaneOrder order =
          laneOrder([](int n) { return n & kWidth ? (n & ~(kWidth - 1)) - 1 : n; });
      const auto odd = hn::RebindMask(d, hn::Ne(hn::And(hn::Iota(i, 0), hn::Set(i, kWidth)), hn::Zero(i)));
      x = hn::Add(x, hn::IfThenElseZero(odd, reordered(x, order)));
    }
  };
  step(std::integral_constant<int, 1>());
  step(std::integral_constant<int, 2>());
  step(std::integral_constant<int, 4>());
  step(std::integral_constant<int, 8>());
  return hn::Add(x, before);
}

HWY_INLINE Floats broadcastLast(Floats x) {
  static constexpr LaneOrder order = laneOrder([](int) { return kLanes - 1; });
  return reordered(x, order);
}

// The lanes moved up by one, with the first one of `first` before them.
HWY_INLINE Floats movedUp(Floats x, Floats first) {
  const Lanes d;
  static constexpr LaneOrder order = laneOrder([](int n) { return n > 0 ? n - 1 : 0; });
  return hn::IfThenElse(hn::FirstN(d, 1), first, reordered(x, order));
}

HWY_INLINE Floats expOfMinus(Floats x) {
  return expOfMinus(Lanes(), x);
}

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif

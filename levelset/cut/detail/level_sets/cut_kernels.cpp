// Signs and minima of the samples of a brick, a vector at a time.
//
// Comparisons and choices are those of std::min and std::max in the same order, so that the vector code gives
// the bits of the plain loops, NaN and zeros of both signs included.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nephele/levelset/cut/detail/level_sets/cut_kernels.cpp"
#include "nephele/levelset/cut/detail/level_sets/cut_kernels.h"

#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>

HWY_BEFORE_NAMESPACE();
namespace nephele::detail::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
constexpr std::size_t kSamples = 512, kSlice = 64;

/// A bit per lane.
template <class D, class M>
HWY_INLINE std::uint64_t bitsOf(D d, M mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, mask, bytes);
  return bytes[0] | std::uint64_t(bytes[1]) << 8;
}

Sides sides(const float* values, float limit) {
  const hn::CappedTag<float, 16> d;
  const std::size_t lanes = hn::Lanes(d);
  const auto high = hn::Set(d, limit);
  Sides result;
  for (std::size_t z = 0; z < kSamples / kSlice; ++z) {
    std::uint64_t above = 0, below = 0;
    for (std::size_t i = 0; i < kSlice; i += lanes) {
      const auto v = hn::LoadU(d, values + kSlice * z + i);
      above |= bitsOf(d, hn::Gt(v, high)) << i;
      below |= bitsOf(d, hn::Gt(hn::Neg(v), high)) << i;
    }
    result.above.slices[z] = above;
    result.below.slices[z] = below;
  }
  return result;
}

/// kKnives of them, or as many as there are if kKnives < 0: unrolled, this takes half the time.
template <int kKnives>
Interval minimaOf(const float* shape, std::span<const KnifeSide> knives, float halfKerf, float band,
                  float* values) {
  const hn::CappedTag<float, 16> d;
  using V = hn::Vec<decltype(d)>;
  const std::size_t lanes = hn::Lanes(d), count = kKnives < 0 ? knives.size() : std::size_t(kKnives);
  const V half = hn::Set(d, halfKerf), top = hn::Set(d, band), bottom = hn::Set(d, -band);
  const auto least = [](V a, V b) { return hn::IfThenElse(hn::Lt(b, a), b, a); };
  const auto most = [](V a, V b) { return hn::IfThenElse(hn::Lt(a, b), b, a); };
  V low = top, high = bottom;
  for (std::size_t s = 0; s < kSamples; s += lanes) {
    V v = hn::LoadU(d, shape + s);
    for (std::size_t k = 0; k < count; ++k)
      v = least(v, hn::Sub(hn::Mul(hn::Set(d, knives[k].sign), hn::LoadU(d, knives[k].samples + s)), half));
    // Adding 0 leaves one kind of zero, whatever came first.
    v = hn::Add(most(bottom, least(v, top)), hn::Zero(d));
    low = least(low, v);
    high = most(high, v);
    hn::StoreU(v, d, values + s);
  }
  return {hn::GetLane(hn::MinOfLanes(d, low)), hn::GetLane(hn::MaxOfLanes(d, high))};
}

Interval minima(const float* shape, std::span<const KnifeSide> knives, float halfKerf, float band,
                float* values) {
  switch (knives.size()) {
    case 0:
      return minimaOf<0>(shape, knives, halfKerf, band, values);
    case 1:
      return minimaOf<1>(shape, knives, halfKerf, band, values);
    case 2:
      return minimaOf<2>(shape, knives, halfKerf, band, values);
    case 3:
      return minimaOf<3>(shape, knives, halfKerf, band, values);
    default:
      return minimaOf<-1>(shape, knives, halfKerf, band, values);
  }
}

}  // namespace nephele::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace nephele::detail {

HWY_EXPORT(sides);
HWY_EXPORT(minima);

Sides sidesOf(const float* values, float limit) {
  return HWY_DYNAMIC_DISPATCH(sides)(values, limit);
}

Interval pieceSamples(const float* shape, std::span<const KnifeSide> knives, float halfKerf, float band,
                      float* values) {
  return HWY_DYNAMIC_DISPATCH(minima)(shape, knives, halfKerf, band, values);
}

Sides sidesOfScalar(const float* values, float limit) {
  Sides result;
  for (int s = 0; s < 512; ++s) {
    if (values[s] > limit) result.above.add(s);
    if (-values[s] > limit) result.below.add(s);
  }
  return result;
}

Interval pieceSamplesScalar(const float* shape, std::span<const KnifeSide> knives, float halfKerf, float band,
                            float* values) {
  Interval range{band, -band};
  for (std::size_t s = 0; s < 512; ++s) {
    float v = shape[s];
    for (const KnifeSide& knife : knives) v = std::min(v, knife.sign * knife.samples[s] - halfKerf);
    v = std::max(-band, std::min(v, band)) + 0.0f;
    range = {std::min(range.min, v), std::max(range.max, v)};
    values[s] = v;
  }
  return range;
}

}  // namespace nephele::detail
#endif

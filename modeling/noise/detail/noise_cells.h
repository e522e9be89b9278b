// No #pragma once: read once for every instruction set, by files that use <hwy/foreach_target.h>.
#if defined(NEPHELE_NOISE_CELLS) == defined(HWY_TARGET_TOGGLE)
#ifdef NEPHELE_NOISE_CELLS
#undef NEPHELE_NOISE_CELLS
#else
#define NEPHELE_NOISE_CELLS
#endif

#include "nephele/modeling/noise/detail/noise_lanes.h"
#include "nephele/modeling/noise/lattice_noise.h"

#ifndef NEPHELE_NOISE_HASH
#define NEPHELE_NOISE_HASH
namespace nephele::detail {

// Odd multipliers with well spread bits.
inline constexpr std::uint32_t kX = 0x9e3779b1u, kY = 0x85ebca77u, kZ = 0xc2b2ae3du;
inline constexpr std::uint32_t kMixRow = 0x7feb352du, kMixCorner = 0x846ca68bu;
inline constexpr std::uint32_t kSecond = 0xadb4a92du, kThirdNumber = 0xd1342543u, kAgain = 0x2c1b3c6du;
// Thirds of the signed 32-bit range: below the first gradients lie in xy, below the second in xz, else in yz.
inline constexpr std::int32_t kThird = -715827883, kTwoThirds = 715827882;
/// Cells are whole floats up to here, and fit an int.
inline constexpr float kFarthest = 1e9f;

}  // namespace nephele::detail
#endif

/// What all noises of a lattice share: cells, and random numbers of their corners.
HWY_BEFORE_NAMESPACE();
namespace nephele::detail::HWY_NAMESPACE {

template <class F>
struct Vector {
  F x, y, z;
};

/// The raw noise and its gradient by lattice coordinates.
template <class F>
struct NoiseSample {
  F value;
  Vector<F> gradient;
};

template <class F>
HWY_INLINE F dot(const Vector<F>& a, const Vector<F>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class F>
HWY_INLINE Vector<F> scaled(const Vector<F>& a, F s) {
  return {a.x * s, a.y * s, a.z * s};
}
template <class F>
HWY_INLINE Vector<F> sum(const Vector<F>& a, const Vector<F>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
/// One axis: cell number, and position in the cell, 0 where the coordinate is not finite.
template <class F>
struct LatticeCell {
  Whole<F> number;
  F at;
};

template <class F>
HWY_INLINE LatticeCell<F> cellOf(F q) {
  const F whole = floorOf(q), t = q - whole;
  const auto finite = t >= F(0.0f);
  const F limited = minOf(maxOf(select(finite, whole, F(0.0f)), F(-kFarthest)), F(kFarthest));
  return {toWhole(limited), select(finite, t, F(0.0f))};
}

/// Mixed bits of a lattice point: the row, then the point in it.
template <class U>
HWY_INLINE U hashRow(U y, U z, std::uint32_t seed) {
  const U row = y * U(kY) + (z * U(kZ) + U(seed));
  return (row ^ right<15>(row)) * U(kMixRow);
}
template <class U>
HWY_INLINE U hashCorner(U row, U x) {
  U h = row ^ (x * U(kX));
  h = (h ^ right<15>(h)) * U(kMixCorner);
  return h ^ right<16>(h);
}
/// Other bits from mixed bits.
template <class U>
HWY_INLINE U hashAgain(U h) {
  h = (h + U(kX)) * U(kAgain);
  return h ^ right<15>(h);
}
/// Uniform in [0, 1), of the top 24 bits.
template <class F>
HWY_INLINE F uniform(Whole<F> h) {
  return toFloat(right<8>(h)) * F(0x1p-24f);
}
/// An index of the clock from bits 4 to 7.
template <class U>
HWY_INLINE U rateOf(U h) {
  return right<4>(h) & U(15u);
}

HWY_INLINE Lanes absOf(Lanes a) {
  return Lanes(hn::Abs(a.v));
}
HWY_INLINE float absOf(float a) {
  return std::abs(a);
}
HWY_INLINE Lanes sqrtOf(Lanes a) {
  return Lanes(hn::Sqrt(a.v));
}
HWY_INLINE float sqrtOf(float a) {
  return std::sqrt(a);
}
/// a < limit, both read as signed numbers.
HWY_INLINE LaneMask signedBelow(WholeLanes a, std::int32_t limit) {
  return {hn::RebindMask(D(), hn::Lt(hn::BitCast(SignedTag(), a.v), hn::Set(SignedTag(), limit)))};
}
HWY_INLINE bool signedBelow(std::uint32_t a, std::int32_t limit) {
  return std::int32_t(a) < limit;
}
/// table[index], indices 0 to 15.
HWY_INLINE Lanes lookUp(const float* table, WholeLanes index) {
  const auto at = hn::BitCast(SignedTag(), index.v);
  // A table of as many numbers as lanes is a permutation, much cheaper than reading memory by lanes.
  if constexpr ((HWY_TARGET & (HWY_AVX3 | HWY_AVX3_DL)) != 0) {
    const D d;
    return Lanes(hn::TableLookupLanes(hn::Load(d, table), hn::IndicesFromVec(d, at)));
  } else {
    return Lanes(hn::GatherIndex(D(), table, at));
  }
}
HWY_INLINE float lookUp(const float* table, std::uint32_t index) {
  return table[index];
}

}  // namespace nephele::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif

// No #pragma once: read once for every instruction set, by files that use <hwy/foreach_target.h>.
#if defined(NEPHELE_NOISE_LANES) == defined(HWY_TARGET_TOGGLE)
#ifdef NEPHELE_NOISE_LANES
#undef NEPHELE_NOISE_LANES
#else
#define NEPHELE_NOISE_LANES
#endif

#include <cmath>
#include <cstdint>

#include "nephele/modeling/base/float_lanes.h"

/// The numbers that noise is written in: lanes of floats and of whole numbers with the operators of plain
/// ones. A noise is one template of them: with float and std::uint32_t it is the scalar truth, with Lanes and
/// WholeLanes the kernel. Both do the same exactly rounded operations in the same order, never fused, and
/// agree bit for bit.
HWY_BEFORE_NAMESPACE();
namespace nephele::detail::HWY_NAMESPACE {

using WholeTag = hn::RebindToUnsigned<D>;
using SignedTag = hn::RebindToSigned<D>;

/// Which lanes a condition holds in.
struct LaneMask {
  hn::Mask<D> m;
};

struct Lanes {
  V v;

  HWY_INLINE Lanes() = default;
  HWY_INLINE Lanes(float a) : v(hn::Set(D(), a)) {}
  HWY_INLINE explicit Lanes(V a) : v(a) {}
  friend HWY_INLINE Lanes operator+(Lanes a, Lanes b) { return Lanes(hn::Add(a.v, b.v)); }
  friend HWY_INLINE Lanes operator-(Lanes a, Lanes b) { return Lanes(hn::Sub(a.v, b.v)); }
  friend HWY_INLINE Lanes operator*(Lanes a, Lanes b) { return Lanes(hn::Mul(a.v, b.v)); }
  friend HWY_INLINE Lanes operator/(Lanes a, Lanes b) { return Lanes(hn::Div(a.v, b.v)); }
  friend HWY_INLINE LaneMask operator<(Lanes a, Lanes b) { return {hn::Lt(a.v, b.v)}; }
  friend HWY_INLINE LaneMask operator>=(Lanes a, Lanes b) { return {hn::Ge(a.v, b.v)}; }
};

/// 32-bit whole numbers, modulo 2^32.
struct WholeLanes {
  hn::Vec<WholeTag> v;

  HWY_INLINE WholeLanes() = default;
  HWY_INLINE WholeLanes(std::uint32_t a) : v(hn::Set(WholeTag(), a)) {}
  HWY_INLINE explicit WholeLanes(hn::Vec<WholeTag> a) : v(a) {}
  friend HWY_INLINE WholeLanes operator+(WholeLanes a, WholeLanes b) { return WholeLanes(hn::Add(a.v, b.v)); }
  friend HWY_INLINE WholeLanes operator*(WholeLanes a, WholeLanes b) { return WholeLanes(hn::Mul(a.v, b.v)); }
  friend HWY_INLINE WholeLanes operator^(WholeLanes a, WholeLanes b) { return WholeLanes(hn::Xor(a.v, b.v)); }
  friend HWY_INLINE WholeLanes operator&(WholeLanes a, WholeLanes b) { return WholeLanes(hn::And(a.v, b.v)); }
};

template <class F>
struct WholeFor;
template <>
struct WholeFor<float> {
  using type = std::uint32_t;
};
template <>
struct WholeFor<Lanes> {
  using type = WholeLanes;
};
/// The whole numbers that belong to F.
template <class F>
using Whole = typename WholeFor<F>::type;

template <int kBits>
HWY_INLINE WholeLanes right(WholeLanes a) {
  return WholeLanes(hn::ShiftRight<kBits>(a.v));
}
template <int kBits>
HWY_INLINE std::uint32_t right(std::uint32_t a) {
  return a >> kBits;
}
HWY_INLINE Lanes select(LaneMask m, Lanes yes, Lanes no) {
  return Lanes(hn::IfThenElse(m.m, yes.v, no.v));
}
HWY_INLINE float select(bool m, float yes, float no) {
  return m ? yes : no;
}
HWY_INLINE LaneMask both(LaneMask a, LaneMask b) {
  return {hn::And(a.m, b.m)};
}
HWY_INLINE bool both(bool a, bool b) {
  return a && b;
}
HWY_INLINE bool none(LaneMask m) {
  return hn::AllFalse(D(), m.m);
}
HWY_INLINE bool none(bool m) {
  return !m;
}
HWY_INLINE Lanes floorOf(Lanes a) {
  return Lanes(hn::Floor(a.v));
}
HWY_INLINE float floorOf(float a) {
  return std::floor(a);
}
/// The smaller and the larger; no NaN.
template <class F>
HWY_INLINE F minOf(F a, F b) {
  return select(a < b, a, b);
}
template <class F>
HWY_INLINE F maxOf(F a, F b) {
  return select(a < b, b, a);
}
/// A whole number below 2^31 as a float, and back, rounding down.
HWY_INLINE Lanes toFloat(WholeLanes a) {
  return Lanes(hn::ConvertTo(D(), hn::BitCast(SignedTag(), a.v)));
}
HWY_INLINE float toFloat(std::uint32_t a) {
  return float(std::int32_t(a));
}
HWY_INLINE WholeLanes toWhole(Lanes a) {
  return WholeLanes(hn::BitCast(WholeTag(), hn::ConvertTo(SignedTag(), a.v)));
}
HWY_INLINE std::uint32_t toWhole(float a) {
  return std::uint32_t(std::int32_t(a));
}
HWY_INLINE void store(float a, float* to) {
  *to = a;
}
HWY_INLINE void store(Lanes a, float* to) {
  hn::Store(a.v, D(), to);
}
}  // namespace nephele::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif

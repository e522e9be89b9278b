// No #pragma once: read once for every instruction set, by files that use <hwy/foreach_target.h>.
#if defined(NEPHELE_MARCH_LOADS) == defined(HWY_TARGET_TOGGLE)
#ifdef NEPHELE_MARCH_LOADS
#undef NEPHELE_MARCH_LOADS
#else
#define NEPHELE_MARCH_LOADS
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

#include "nephele/render/march/detail/march_lanes.h"

/// Numbers from places of their own for every lane, by plain loads.
HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

// Keeps the compiler from taking a stored vector apart in registers, which costs more than loading its parts.
HWY_INLINE const volatile std::int32_t* inMemory(const std::int32_t* stored) {
  return stored;
}

// The numbers at[n][offset] and at[n][offset + 1] of as many places as half a vector has lanes.
template <class D>
HWY_INLINE hn::Vec<D> pairsAt(D d, const float* const* HWY_RESTRICT at, int offset) {
#if HWY_TARGET == HWY_SCALAR
  return hn::Set(d, at[0][offset]);
#else
  if constexpr (hn::MaxLanes(D()) == 2) {
    return hn::LoadU(d, at[0] + offset);
#if HWY_ARCH_X86 && HWY_TARGET != HWY_EMU128
  } else if constexpr (hn::MaxLanes(D()) == 4) {
    const auto* first = reinterpret_cast<const __m128i*>(at[0] + offset);
    const auto* second = reinterpret_cast<const __m64*>(at[1] + offset);
    return hn::Vec<D>{_mm_loadh_pi(_mm_castsi128_ps(_mm_loadl_epi64(first)), second)};
#endif
  } else {
    const hn::Half<D> half;
    constexpr int quarter = int(hn::MaxLanes(D())) / 4;
    return hn::Combine(d, pairsAt(half, at + quarter, offset), pairsAt(half, at, offset));
  }
#endif
}

// The four numbers at values + at[0], values + at[4] ..., as many as fit into a vector.
template <class D>
HWY_INLINE hn::Vec<D> foursAt(D d, const float* HWY_RESTRICT values, const std::int32_t* HWY_RESTRICT at) {
#if HWY_TARGET == HWY_SCALAR
  return hn::Set(d, values[at[0]]);
#else
  if constexpr (hn::MaxLanes(D()) == 4) {
    return hn::LoadU(d, values + inMemory(at)[0]);
  } else {
    const hn::Half<D> half;
    constexpr int quads = int(hn::MaxLanes(D())) / 8;
    return hn::Combine(d, foursAt(half, values, at + 4 * quads), foursAt(half, values, at));
  }
#endif
}

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif

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
#include <cstring>

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

// One vector of some that follow each other.
template <class D, class Part>
HWY_INLINE hn::Vec<D> joined([[maybe_unused]] D d, const Part* parts) {
#if HWY_TARGET == HWY_SCALAR
  return parts[0];
#else
  if constexpr (sizeof(hn::Vec<D>) == sizeof(Part))
    return parts[0];
  else
    return hn::Combine(d, parts[1], parts[0]);
#endif
}

// The 32 bits that lie `offset` codes behind at[n], for every lane.
template <class D>
HWY_INLINE hn::Vec<D> wordsAt([[maybe_unused]] D d, const std::uint16_t* const* HWY_RESTRICT at, int offset) {
  constexpr int kCount = int(hn::MaxLanes(D()));
#if HWY_ARCH_X86 && HWY_TARGET != HWY_EMU128 && HWY_TARGET != HWY_SCALAR
  if constexpr (kCount == 4) {
    const auto two = [&](int n) HWY_ATTR {
      return _mm_unpacklo_epi32(_mm_loadu_si32(at[n] + offset), _mm_loadu_si32(at[n + 1] + offset));
    };
    return hn::Vec<D>{_mm_castsi128_ps(_mm_unpacklo_epi64(two(0), two(2)))};
  } else {
    const hn::Half<D> half;
    return hn::Combine(d, wordsAt(half, at + kCount / 2, offset), wordsAt(half, at, offset));
  }
#else
  float words[kCount];
  for (int n = 0; n != kCount; ++n) std::memcpy(words + n, at[n] + offset, sizeof(float));
  return hn::LoadU(d, words);
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

// No #pragma once: read once for every instruction set, by files that use <hwy/foreach_target.h>.
#if defined(NEPHELE_MARCH_CODE_LOADS) == defined(HWY_TARGET_TOGGLE)
#ifdef NEPHELE_MARCH_CODE_LOADS
#undef NEPHELE_MARCH_CODE_LOADS
#else
#define NEPHELE_MARCH_CODE_LOADS
#endif

#include <hwy/highway.h>

#include <cstdint>
#include <cstring>

#include "nephele/render/march/detail/march_lanes.h"

/// Loads from coded bricks: four codes of a cell's face at a time, and the bricks' own numbers.
HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

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

// The 32 bits that lie at at[n], for every lane.
template <class D>
HWY_INLINE hn::Vec<D> wordsAt([[maybe_unused]] D d, const float* const* HWY_RESTRICT at) {
  constexpr int kCount = int(hn::MaxLanes(D()));
#if HWY_ARCH_X86 && HWY_TARGET != HWY_EMU128 && HWY_TARGET != HWY_SCALAR
  if constexpr (kCount == 4) {
    const auto two = [&](int n) HWY_ATTR {
      return _mm_unpacklo_epi32(_mm_loadu_si32(at[n]), _mm_loadu_si32(at[n + 1]));
    };
    return hn::Vec<D>{_mm_castsi128_ps(_mm_unpacklo_epi64(two(0), two(2)))};
  } else {
    const hn::Half<D> half;
    return hn::Combine(d, wordsAt(half, at + kCount / 2), wordsAt(half, at));
  }
#else
  float words[kCount];
  for (int n = 0; n != kCount; ++n) words[n] = *at[n];
  return hn::LoadU(d, words);
#endif
}

#if HWY_TARGET != HWY_SCALAR
// The 16 bytes at at[0], at[1] ..., as many as a vector has blocks.
template <class D>
HWY_INLINE hn::Vec<D> blocksAt(D d, const std::int16_t* const* HWY_RESTRICT at, int offset) {
  if constexpr (hn::MaxLanes(D()) == 4) {
    return hn::LoadU(d, reinterpret_cast<const float*>(at[0] + offset));
  } else {
    const hn::Half<D> half;
    return hn::Combine(d, blocksAt(half, at + hn::MaxLanes(D()) / 8, offset), blocksAt(half, at, offset));
  }
}
#endif

// Pairs of codes, in 32 bits each, of the four rows of a cell for every lane: those at codesOf(lane), kRow
// codes behind, `plane` behind, and both.
template <int kRow, class CodesOf>
HWY_INLINE void pairsOfRows(int plane, CodesOf&& codesOf, Floats (&pairs)[4]) {
  const Lanes d;
#if HWY_TARGET == HWY_SCALAR
  for (int n = 0; n != 4; ++n) {
    float words;
    std::memcpy(&words, codesOf(0) + (n % 2 * kRow + n / 2 * plane), sizeof(float));
    pairs[n] = hn::Set(d, words);
  }
#else
  // Two rows lie in 16 bytes; of those of four lanes the first rows are brought side by side, and the second.
  static_assert(kRow <= 6);
  constexpr std::uint8_t k = 2 * kRow;
  alignas(16) static constexpr std::uint8_t kBoth[16] = {0, 1,     2,     3,     0, 1,     2,     3,
                                                         k, k + 1, k + 2, k + 3, k, k + 1, k + 2, k + 3};
  const hn::Repartition<std::uint8_t, Lanes> bytes;
  const hn::Repartition<std::uint64_t, Lanes> wide;
  const auto both = hn::LoadDup128(bytes, kBoth);
  Floats near[4], far[4];
  for (int n = 0; n != 4; ++n) {
    const std::int16_t* at[kLanes / 4];
    for (int block = 0; block != kLanes / 4; ++block) at[block] = codesOf(4 * block + n);
    near[n] = blocksAt(d, at, 0);
    far[n] = blocksAt(d, at, plane);
  }
  const auto sort = [&](const Floats(&blocks)[4], Floats* rows) HWY_ATTR {
    const auto spread = [&](Floats x) HWY_ATTR {
      return hn::BitCast(d, hn::TableLookupBytes(hn::BitCast(bytes, x), both));
    };
    const auto two = [&](int n) HWY_ATTR {
      return hn::BitCast(wide, hn::OddEven(spread(blocks[n + 1]), spread(blocks[n])));
    };
    rows[0] = hn::BitCast(d, hn::InterleaveLower(wide, two(0), two(2)));
    rows[1] = hn::BitCast(d, hn::InterleaveUpper(wide, two(0), two(2)));
  };
  sort(near, pairs);
  sort(far, pairs + 2);
#endif
}

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif

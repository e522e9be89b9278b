// No #pragma once: read once for every instruction set, by files that use <hwy/foreach_target.h>.
#if defined(NEPHELE_MARCH_CODED_BRICKS) == defined(HWY_TARGET_TOGGLE)
#ifdef NEPHELE_MARCH_CODED_BRICKS
#undef NEPHELE_MARCH_CODED_BRICKS
#else
#define NEPHELE_MARCH_CODED_BRICKS
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

#include "nephele/render/march/detail/march_bricks.h"
#include "nephele/render/march/detail/march_code_loads.h"
#include "nephele/render/march/detail/march_lanes.h"
#include "nephele/render/march/detail/march_loads.h"
#include "nephele/render/volume/march_scene.h"

/// Look-ups of the march in coded bricks, a vector of points at a time.
HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

// Places of points in coded bricks.
HWY_INLINE void locateCoded(const MarchScene::Bricks& bricks, Point p, Places& places) {
  locate(bricks, p, places, [](Ints x, Ints y, Ints z) HWY_ATTR {
    const IntLanes i;
    static_assert(CodedBricks::kHalfCells == 4);
    const Ints half = hn::ShiftRight<2>(x), row = hn::Add(hn::Mul(z, hn::Set(i, CodedBricks::kWidth)), y);
    return hn::Add(hn::Add(hn::Mul(row, hn::Set(i, CodedBricks::kRow)), x),
                   hn::Mul(half, hn::Set(i, CodedBricks::kHalf - CodedBricks::kHalfCells)));
  });
}

// At places in coded bricks; nothing is below 0.
HWY_INLINE Floats readCoded(const MarchScene::Bricks& bricks, const Places& places) {
  const Lanes d;
  const auto entryOf = [&](int lane) HWY_ATTR { return bricks.entries + inMemory(places.entry)[lane]; };
  Floats pairs[4];
  pairsOfRows<CodedBricks::kRow>(
      CodedBricks::kPlane,
      [&](int lane) HWY_ATTR {
        return bricks.codes + (entryOf(lane)->first + std::uint32_t(inMemory(places.node)[lane]));
      },
      pairs);
  // As many at a time as addresses fit into registers.
  constexpr int kTogether = kLanes < 8 ? kLanes : 8;
  using Some = hn::CappedTag<float, kTogether>;
  hn::Vec<Some> units[kLanes / kTogether];
  for (int part = 0; part != kLanes / kTogether; ++part) {
    const float* own[kTogether];
    for (int n = 0; n != kTogether; ++n) own[n] = &entryOf(part * kTogether + n)->unit;
    units[part] = wordsAt(Some(), own);
  }
  // Along x in whole numbers, which multiplies and adds two at once: the share of x in kOne-ths, of which an
  // error is as that of a code. 512 + x has them as its last bits.
  constexpr int kOne = 1 << 14;
  const IntLanes i;
  const Ints bits = hn::BitCast(i, hn::Add(places.share.x, hn::Set(d, 512.0f)));
  const auto alongX = [&](Floats pair) HWY_ATTR {
#if HWY_TARGET == HWY_SCALAR
    const Ints both = hn::BitCast(i, pair), share = hn::And(bits, hn::Set(i, 2 * kOne - 1)),
               first = hn::ShiftRight<16>(hn::ShiftLeft<16>(both)), second = hn::ShiftRight<16>(both);
    return hn::ConvertTo(d,
                         hn::Add(hn::Mul(first, hn::Sub(hn::Set(i, kOne), share)), hn::Mul(second, share)));
#else
    // kOne - x and x side by side, as the nodes are.
    const Ints shares = hn::Add(hn::Sub(hn::ShiftLeft<16>(bits), bits), hn::Set(i, 0x44000000 + kOne));
    const hn::Repartition<std::int16_t, Lanes> halves;
    Ints odd = hn::Zero(i);
    const Ints even = hn::ReorderWidenMulAccumulate(i, hn::BitCast(halves, pair), hn::BitCast(halves, shares),
                                                    hn::Zero(i), odd);
    return hn::ConvertTo(d, hn::RearrangeToOddPlusEven(even, odd));
#endif
  };
  const auto alongY = [&](Floats first, Floats second) HWY_ATTR {
    const Floats low = alongX(first), high = alongX(second);
    return hn::MulAdd(places.share.y, hn::Sub(high, low), low);
  };
  const Floats near = alongY(pairs[0], pairs[1]), far = alongY(pairs[2], pairs[3]);
  const Floats code = hn::MulAdd(places.share.z, hn::Sub(far, near), near);
  const Floats above =
      hn::Max(hn::MulAdd(code, hn::Set(d, 1.0f / kOne), hn::Set(d, -CodedBricks::kZero)), hn::Zero(d));
  return hn::Mul(above, joined(d, units));
}

// Places in coded bricks of vectors of samples, at distances s along a ray. All are found before the first
// value is read, so that the processor need not wait for one vector before it starts the next.
HWY_INLINE void locateAll(const MarchScene::Bricks& bricks, const LatticeRay& ray, int vectors,
                          const float* HWY_RESTRICT s, Places* HWY_RESTRICT places) {
  for (int v = 0; v != vectors; ++v)
    locateCoded(bricks, pointAt(ray, hn::Load(Lanes(), s + v * kLanes)), places[v]);
}

HWY_INLINE void readAll(const MarchScene::Bricks& bricks, int vectors, const Places* HWY_RESTRICT places,
                        float* HWY_RESTRICT values) {
  for (int v = 0; v != vectors; ++v) hn::Store(readCoded(bricks, places[v]), Lanes(), values + v * kLanes);
}

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif

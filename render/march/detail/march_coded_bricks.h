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
#include "nephele/render/march/detail/march_lanes.h"
#include "nephele/render/march/detail/march_loads.h"
#include "nephele/render/volume/march_scene.h"

/// Look-ups of the march in coded bricks, a vector of points at a time.
HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

// At places in coded bricks; nothing is below 0.
HWY_INLINE Floats readCoded(const MarchScene::Bricks& bricks, const Places& places) {
  const Lanes d;
  constexpr int kRow = CodedBricks::kWidth, kPlane = CodedBricks::kPlane;
  // As many at a time as addresses fit into registers.
  constexpr int kTogether = kLanes < 8 ? kLanes : 8;
  // Two nodes along x in each: of the four rows of a cell; and what belongs to the brick.
  using Some = hn::CappedTag<float, kTogether>;
  hn::Vec<Some> words[5][kLanes / kTogether];
  for (int part = 0; part != kLanes / kTogether; ++part) {
    const std::uint16_t *at[kTogether], *own[kTogether];
    for (int n = 0; n != kTogether; ++n) {
      const int lane = part * kTogether + n;
      const CodedBricks::Entry* entry = bricks.entries + inMemory(places.entry)[lane];
      own[n] = reinterpret_cast<const std::uint16_t*>(&entry->unit);
      at[n] = bricks.codes + (entry->first + std::uint32_t(inMemory(places.node)[lane]));
    }
    for (int n = 0; n != 4; ++n) words[n][part] = wordsAt(Some(), at, n / 2 * kPlane + n % 2 * kRow);
    words[4][part] = wordsAt(Some(), own, 0);
  }
  const auto alongX = [&](const hn::Vec<Some>* pairs) HWY_ATTR {
    const IntLanes i;
    const hn::RebindToUnsigned<Lanes> u;
    const auto bits = hn::BitCast(u, joined(d, pairs));
    const Floats first = hn::ConvertTo(d, hn::BitCast(i, hn::And(bits, hn::Set(u, 0xffffu)))),
                 second = hn::ConvertTo(d, hn::BitCast(i, hn::ShiftRight<16>(bits)));
    return hn::MulAdd(places.share.x, hn::Sub(second, first), first);
  };
  const auto alongY = [&](const hn::Vec<Some>* first, const hn::Vec<Some>* second) HWY_ATTR {
    const Floats low = alongX(first), high = alongX(second);
    return hn::MulAdd(places.share.y, hn::Sub(high, low), low);
  };
  const Floats near = alongY(words[0], words[1]), far = alongY(words[2], words[3]);
  const Floats code = hn::MulAdd(places.share.z, hn::Sub(far, near), near);
  const Floats above = hn::Max(hn::Sub(code, hn::Set(d, CodedBricks::kZero)), hn::Zero(d));
  return hn::Mul(above, joined(d, words[4]));
}

// Places in coded bricks of vectors of samples, at distances s along a ray. All are found before the first
// value is read, so that the processor need not wait for one vector before it starts the next.
HWY_INLINE void locateAll(const MarchScene::Bricks& bricks, const LatticeRay& ray, int vectors,
                          const float* HWY_RESTRICT s, Places* HWY_RESTRICT places) {
  for (int v = 0; v != vectors; ++v)
    locate<CodedBricks::kWidth>(bricks, pointAt(ray, hn::Load(Lanes(), s + v * kLanes)), places[v]);
}

HWY_INLINE void readAll(const MarchScene::Bricks& bricks, int vectors, const Places* HWY_RESTRICT places,
                        float* HWY_RESTRICT values) {
  for (int v = 0; v != vectors; ++v) hn::Store(readCoded(bricks, places[v]), Lanes(), values + v * kLanes);
}

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif

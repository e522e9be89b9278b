// The values of codes, row by row along x: one sample of the brick before, eight own, two of the brick after.
#include "nephele/levelset/grid/detail/brick_codes.h"

#include "nephele/levelset/grid/brick_layout.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nephele/levelset/grid/detail/brick_codes.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace nephele::detail {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Which of three bricks along an axis a stored sample is of, and which it is there.
struct StoredAt {
  int brick, own;

  explicit constexpr StoredAt(int stored)
      : brick((stored - BrickLayout::kBefore + BrickLayout::kBrick) / BrickLayout::kBrick),
        own((stored - BrickLayout::kBefore + BrickLayout::kBrick) % BrickLayout::kBrick) {}
};

void decode(const CodesAround& around, float* samples) {
  constexpr int kBrick = BrickLayout::kBrick, kWidth = BrickLayout::kWidth;
  const hn::CappedTag<float, kBrick> d;
  const hn::Rebind<std::int32_t, decltype(d)> di;
  const hn::Rebind<std::uint16_t, decltype(d)> du;
  const auto value = [&](int brick, int own) {
    return around.low[brick] + around.unit[brick] * float(around.codes[brick][own]);
  };
  for (int z = 0; z < kWidth; ++z)
    for (int y = 0; y < kWidth; ++y, samples += kWidth) {
      const StoredAt atY(y), atZ(z);
      const int before = (atZ.brick * 3 + atY.brick) * 3, first = (atZ.own * kBrick + atY.own) * kBrick;
      samples[0] = value(before, first + kBrick - 1);
      const auto low = hn::Set(d, around.low[before + 1]), unit = hn::Set(d, around.unit[before + 1]);
      const std::uint16_t* own = around.codes[before + 1] + first;
      for (int x = 0; x < kBrick; x += int(hn::Lanes(d))) {
        const auto codes = hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(du, own + x)));
        hn::StoreU(low + unit * codes, d, samples + BrickLayout::kBefore + x);
      }
      for (int x = 0; x < BrickLayout::kAfter; ++x)
        samples[BrickLayout::kBefore + kBrick + x] = value(before + 2, first + x);
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace nephele::detail
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace nephele::detail {

HWY_EXPORT(decode);

void decodeBrick(const CodesAround& around, float* samples) {
  HWY_DYNAMIC_DISPATCH(decode)(around, samples);
}

}  // namespace nephele::detail
#endif  // HWY_ONCE

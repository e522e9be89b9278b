// The inner loop of LightSweep: eight cells of a row in four directions at a time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nephele/render/light/detail/slice_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "nephele/render/light/detail/light_sweep.h"

HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using RowLanes = hn::CappedTag<float, detail::ScatteringLattice::kRow>;
using RowFloats = hn::Vec<RowLanes>;

HWY_INLINE RowFloats comesIn(const detail::SliceWork::Way& way, std::size_t at, std::size_t planeStride) {
  const RowLanes d;
  const float *a = way.before + at, *b = a + planeStride;
  // Products first, then sums of pairs, so that mirrored light has the same bits.
  const auto share = [&](int n, const float* from)
                         HWY_ATTR { return hn::Mul(hn::Set(d, way.shares[n]), hn::LoadU(d, from)); };
  return hn::Add(hn::Add(share(0, a), share(1, a + 1)), hn::Add(share(2, b), share(3, b + 1)));
}

template <int kMoments>
void carryRows(const detail::SliceWork& work) {
  const RowLanes d;
  const int lanes = int(hn::Lanes(d));
  for (int row = work.rowBegin; row != work.rowEnd; ++row) {
    const std::size_t first = std::size_t(row) * work.rowStride, plane = std::size_t(row) * work.planeStride;
    const auto [begin, end] = work.active[std::size_t(row) * work.activeStride];
    const auto pass = [&](int from, int to) HWY_ATTR {
      for (const detail::SliceWork::Way& way : work.ways)
        for (int x = from; x < to; x += lanes)
          hn::StoreU(comesIn(way, plane + std::size_t(x), work.planeStride), d, way.here + plane + x);
    };
    if (begin >= end) {
      pass(0, work.width);
      continue;
    }
    pass(0, begin);
    for (int x = begin; x < end; x += lanes) {
      const float* moments = work.moments + first + x;
      float* sums = work.sums + first + x;
      RowFloats own0 = hn::Zero(d), own1 = own0, own2 = own0, own3 = own0;
      for (int m = 0; m != kMoments; ++m) {
        const RowFloats moment = hn::LoadU(d, moments + std::size_t(m) * work.momentStride);
        own0 = hn::MulAdd(hn::Set(d, work.source[m][0]), moment, own0);
        own1 = hn::MulAdd(hn::Set(d, work.source[m][1]), moment, own1);
        own2 = hn::MulAdd(hn::Set(d, work.source[m][2]), moment, own2);
        own3 = hn::MulAdd(hn::Set(d, work.source[m][3]), moment, own3);
      }
      const RowFloats taken = hn::LoadU(d, work.taken + first + x),
                      mean = hn::LoadU(d, work.mean + first + x),
                      takenSlope = hn::LoadU(d, work.takenSlope + first + x),
                      meanSlope = hn::LoadU(d, work.meanSlope + first + x),
                      slope0 = hn::LoadU(d, work.slopes[0] + first + x),
                      slope1 = hn::LoadU(d, work.slopes[1] + first + x),
                      slope2 = hn::LoadU(d, work.slopes[2] + first + x);
      const auto carried = [&](int k, RowFloats own) HWY_ATTR {
        const detail::SliceWork::Way& way = work.ways[k];
        const RowFloats in = comesIn(way, plane + std::size_t(x), work.planeStride),
                        excess = hn::Sub(in, own);
        RowFloats grows = hn::MulAdd(
            hn::Set(d, way.slopes[0]), slope0,
            hn::MulAdd(hn::Set(d, way.slopes[1]), slope1, hn::Mul(hn::Set(d, way.slopes[2]), slope2)));
        // Nowhere does it change its sign.
        const RowFloats most = hn::Abs(hn::Add(own, own));
        grows = hn::Min(hn::Max(grows, hn::Neg(most)), most);
        hn::StoreU(hn::MulAdd(grows, takenSlope, hn::NegMulAdd(excess, taken, in)), d, way.here + plane + x);
        return hn::NegMulAdd(grows, meanSlope, hn::MulAdd(excess, mean, own));
      };
      const RowFloats mean0 = carried(0, own0), mean1 = carried(1, own1), mean2 = carried(2, own2),
                      mean3 = carried(3, own3);
      for (int m = 0; m != kMoments; ++m) {
        float* sum = sums + std::size_t(m) * work.momentStride;
        const RowFloats low = hn::Add(hn::Mul(hn::Set(d, work.sum[m][0]), mean0),
                                      hn::Mul(hn::Set(d, work.sum[m][1]), mean1)),
                        high = hn::Add(hn::Mul(hn::Set(d, work.sum[m][2]), mean2),
                                       hn::Mul(hn::Set(d, work.sum[m][3]), mean3));
        hn::StoreU(hn::Add(hn::LoadU(d, sum), hn::Add(low, high)), d, sum);
      }
    }
    pass(end, work.width);
  }
}

void carrySliceOf(const detail::SliceWork& work) {
  switch (work.momentCount) {
    case 1:
      return carryRows<1>(work);
    case 4:
      return carryRows<4>(work);
    case 9:
      return carryRows<9>(work);
    case 16:
      return carryRows<16>(work);
    case 25:
      return carryRows<25>(work);
    default:
      return carryRows<36>(work);
  }
}

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace nephele {

HWY_EXPORT(carrySliceOf);

void detail::carrySlice(const SliceWork& work) {
  HWY_DYNAMIC_DISPATCH(carrySliceOf)(work);
}

}  // namespace nephele

#endif  // HWY_ONCE

// The inner loop of LightSweep: eight cells of a row in four directions at a time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nephele/render/light/detail/slice_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "nephele/render/light/detail/light_sweep.h"
#include "nephele/render/light/exp_of_minus_lanes.h"

HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using RowLanes = hn::CappedTag<float, detail::CellRows::kVector>;
using RowFloats = hn::Vec<RowLanes>;

// Of four places that are `apart`. Mirrored light has the same bits.
HWY_INLINE RowFloats mixed(const std::array<float, 4>& shares, const float* from, std::size_t apart) {
  const RowLanes d;
  const auto share = [&](std::size_t n)
                         HWY_ATTR { return hn::Mul(hn::Set(d, shares[n]), hn::LoadU(d, from + n * apart)); };
  return hn::Add(hn::Add(share(0), share(3)), hn::Add(share(1), share(2)));
}

// What a cell takes of the light that comes in, and holds on average of it; the same of what its own light
// grows by on the way through it.
struct Shares {
  RowFloats taken, mean, takenSlope, meanSlope;
};

// By their series where differences would lose their digits.
HWY_INLINE Shares sharesOf(RowFloats depth) {
  const RowLanes d;
  const auto line = [&](float at0, float slope)
                        HWY_ATTR { return hn::MulAdd(depth, hn::Set(d, slope), hn::Set(d, at0)); };
  const RowFloats one = hn::Set(d, 1.0f), thin = hn::NegMulAdd(depth, line(0.5f, -1.0f / 6), one),
                  per = hn::Div(one, hn::Max(depth, hn::Set(d, 0.03f)));
  const RowFloats mean = hn::IfThenElse(hn::Lt(depth, hn::Set(d, 0.03f)), thin,
                                        hn::Mul(hn::Sub(one, expOfMinus(d, depth)), per));
  const RowFloats taken = hn::Mul(depth, mean), thinSlope = hn::Mul(depth, line(1.0f / 12, -1.0f / 24));
  const auto isThin = hn::Lt(depth, hn::Set(d, 0.1f));
  const RowFloats slope = hn::NegMulAdd(hn::Set(d, 0.5f), taken, hn::Sub(one, mean));
  return {taken, mean, hn::IfThenElse(isThin, hn::Mul(depth, thinSlope), slope),
          hn::IfThenElse(isThin, thinSlope, hn::Mul(slope, per))};
}

void carrySliceOf(const detail::SliceWork& work) {
  const RowLanes d;
  const int lanes = int(hn::Lanes(d));
  for (int row = work.rowBegin; row != work.rowEnd; ++row) {
    const std::size_t plane = std::size_t(row) * work.planeStride;
    const auto [first, begin, end] = work.rows[std::size_t(row) * work.rowStride];
    const auto comesIn = [&](const detail::SliceWork::Way& way, int x)
                             HWY_ATTR { return mixed(way.across, way.before + plane + x, work.planeStride); };
    const auto pass = [&](int from, int to) HWY_ATTR {
      for (const detail::SliceWork::Way& way : work.ways)
        for (int x = from; x < to; x += lanes)
          hn::StoreU(comesIn(way, x), d, way.row + detail::SliceWork::kRim + x);
    };
    const bool holdsNone = begin >= end;
    pass(0, holdsNone ? work.width : begin);
    for (int x = begin; x < end; x += lanes) {
      const std::size_t at = std::size_t(first + x);
      const std::size_t momentsAt = detail::CellRows::momentsAt(at, work.momentCount);
      const float* HWY_RESTRICT moments = work.moments + momentsAt;
      float* HWY_RESTRICT sums = work.sums + momentsAt;
      RowFloats parts[4];
      for (int kind = 0, n = 0; kind != 4; ++kind) {
        RowFloats sum = hn::Zero(d);
        for (; n != work.ends[std::size_t(kind)]; ++n) {
          const detail::SliceWork::Part& part = work.parts[std::size_t(n)];
          sum = hn::MulAdd(hn::Set(d, part.source), hn::LoadU(d, moments + part.offset), sum);
        }
        parts[kind] = sum;
      }
      // Of all four directions, and back: mirrored light has the same bits.
      const auto together = [&](const RowFloats(&from)[4], RowFloats(&to)[4]) HWY_ATTR {
        const RowFloats a = hn::Add(from[0], from[1]), b = hn::Sub(from[0], from[1]),
                        c = hn::Add(from[2], from[3]), e = hn::Sub(from[2], from[3]);
        to[0] = hn::Add(a, c);
        to[1] = hn::Add(b, e);
        to[2] = hn::Sub(a, c);
        to[3] = hn::Sub(b, e);
      };
      RowFloats own[4];
      together(parts, own);
      const RowFloats depth = hn::Min(
          hn::Mul(hn::Set(d, work.depthPerDensity), hn::LoadU(d, work.density + at)), hn::Set(d, 80.0f));
      const Shares cell = sharesOf(depth);
      const RowFloats slope0 = hn::LoadU(d, work.slopes[0] + at), slope1 = hn::LoadU(d, work.slopes[1] + at),
                      slope2 = hn::LoadU(d, work.slopes[2] + at);
      const auto carried = [&](int k, RowFloats its) HWY_ATTR {
        const detail::SliceWork::Way& way = work.ways[k];
        const RowFloats in = comesIn(way, x), excess = hn::Sub(in, its);
        RowFloats grows = hn::MulAdd(
            hn::Set(d, way.slopes[0]), slope0,
            hn::MulAdd(hn::Set(d, way.slopes[1]), slope1, hn::Mul(hn::Set(d, way.slopes[2]), slope2)));
        // Nowhere does it change its sign.
        const RowFloats most = hn::Abs(hn::Add(its, its));
        grows = hn::Min(hn::Max(grows, hn::Neg(most)), most);
        hn::StoreU(hn::MulAdd(grows, cell.takenSlope, hn::NegMulAdd(excess, cell.taken, in)), d,
                   way.row + detail::SliceWork::kRim + x);
        return hn::NegMulAdd(grows, cell.meanSlope, hn::MulAdd(excess, cell.mean, its));
      };
      const RowFloats means[4] = {carried(0, own[0]), carried(1, own[1]), carried(2, own[2]),
                                  carried(3, own[3])};
      together(means, parts);
      for (int kind = 0, n = 0; kind != 4; ++kind)
        for (; n != work.ends[std::size_t(kind)]; ++n) {
          const detail::SliceWork::Part& part = work.parts[std::size_t(n)];
          float* sum = sums + part.offset;
          hn::StoreU(hn::MulAdd(hn::Set(d, part.sum), parts[kind], hn::LoadU(d, sum)), d, sum);
        }
    }
    if (!holdsNone) pass(end, work.width);
    for (const detail::SliceWork::Way& way : work.ways)
      for (int x = 0; x < work.width; x += lanes)
        hn::StoreU(mixed(way.along, way.row + detail::SliceWork::kRim + way.first + x, 1), d,
                   way.here + plane + x);
  }
}

void turnSquareOf(const float* const* from, float* const* to, bool adds) {
#if HWY_TARGET == HWY_SCALAR
  for (int x = 0; x != detail::CellRows::kVector; ++x)
    for (int y = 0; to[x] && y != detail::CellRows::kVector; ++y)
      to[x][y] = (adds ? to[x][y] : 0.0f) + (from[y] ? from[y][x] : 0.0f);
#else
  // In squares of four.
  const hn::CappedTag<float, 4> d;
  const hn::RepartitionToWide<decltype(d)> wide;
  constexpr int n = detail::CellRows::kVector;
  const auto row = [&](const float* at, int first)
                       HWY_ATTR { return at ? hn::LoadU(d, at + first) : hn::Zero(d); };
  for (int y = 0; y != n; y += 4)
    for (int x = 0; x != n; x += 4) {
      const auto a = row(from[y], x), b = row(from[y + 1], x), c = row(from[y + 2], x),
                 e = row(from[y + 3], x);
      const auto low = hn::BitCast(wide, hn::InterleaveLower(d, a, b)),
                 high = hn::BitCast(wide, hn::InterleaveUpper(d, a, b)),
                 nextLow = hn::BitCast(wide, hn::InterleaveLower(d, c, e)),
                 nextHigh = hn::BitCast(wide, hn::InterleaveUpper(d, c, e));
      const auto store = [&](float* at, hn::Vec<decltype(wide)> values) HWY_ATTR {
        if (!at) return;
        const auto added = hn::BitCast(d, values);
        hn::StoreU(adds ? hn::Add(hn::LoadU(d, at + y), added) : added, d, at + y);
      };
      store(to[x], hn::InterleaveLower(wide, low, nextLow));
      store(to[x + 1], hn::InterleaveUpper(wide, low, nextLow));
      store(to[x + 2], hn::InterleaveLower(wide, high, nextHigh));
      store(to[x + 3], hn::InterleaveUpper(wide, high, nextHigh));
    }
#endif
}

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace nephele {

HWY_EXPORT(carrySliceOf);
HWY_EXPORT(turnSquareOf);

void detail::carrySlice(const SliceWork& work) {
  HWY_DYNAMIC_DISPATCH(carrySliceOf)(work);
}

void detail::turnSquare(const float* const (&from)[CellRows::kVector], float* const (&to)[CellRows::kVector],
                        bool adds) {
  HWY_DYNAMIC_DISPATCH(turnSquareOf)(from, to, adds);
}

}  // namespace nephele

#endif  // HWY_ONCE

// The inner loops of LightVolume's sweep, in the widest vectors that the machine has. Nothing is summed
// across lanes and nothing is contracted, so that every width gives the same bits.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nephele/render/light/detail/light_slices.cpp"
#include "nephele/render/light/detail/light_slices.h"

#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>

HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using SliceLanes = hn::CappedTag<float, detail::kSliceRow>;
using SliceFloats = hn::Vec<SliceLanes>;
constexpr int kSliceLanes = int(hn::MaxLanes(SliceLanes()));

// What is `apart` floats from another, mixed.
HWY_INLINE SliceFloats mixOfFour(const float* HWY_RESTRICT at, int apart,
                                 const std::array<float, 4>& weights) {
  const SliceLanes d;
  const auto term = [&](int n) HWY_ATTR {
    return hn::Mul(hn::Set(d, weights[std::size_t(n)]), hn::LoadU(d, at + n * apart));
  };
  return hn::Add(hn::Add(term(0), term(1)), hn::Add(term(2), term(3)));
}

void mixSliceOf(const float* HWY_RESTRICT samples, const detail::SliceWeights& weights, float most,
                float* HWY_RESTRICT out) {
  using namespace detail;
  const SliceLanes d;
  alignas(64) float dense[(kSliceNodes + 4) * kSliceRow], rows[(kSliceNodes + 3) * kSliceRow];
  for (int i = 0; i != (kSliceNodes + 3) * kSliceRow; i += kSliceLanes) {
    const float* from = samples + i / kSliceRow * kSampleRow + i % kSliceRow;
    hn::Store(hn::Min(hn::Max(hn::LoadU(d, from), hn::Zero(d)), hn::Set(d, most)), d, dense + i);
  }
  // Only lanes that do not matter look behind the last row.
  std::fill_n(dense + (kSliceNodes + 3) * kSliceRow, kSliceRow, 0.0f);
  for (int i = 0; i != (kSliceNodes + 3) * kSliceRow; i += kSliceLanes)
    hn::Store(mixOfFour(dense + i, 1, weights.u), d, rows + i);
  for (int i = 0; i != kSliceArea; i += kSliceLanes)
    hn::Store(mixOfFour(rows + i, kSliceRow, weights.v), d, out + i);
}

void addSlicesOf(float end, const float* HWY_RESTRICT a, const float* HWY_RESTRICT b, float middle,
                 const float* HWY_RESTRICT c, const float* HWY_RESTRICT e, float* HWY_RESTRICT out) {
  const SliceLanes d;
  for (int i = 0; i != detail::kSliceArea; i += kSliceLanes) {
    const SliceFloats ends = hn::Mul(hn::Set(d, end), hn::Add(hn::Load(d, a + i), hn::Load(d, b + i)));
    const SliceFloats middles = hn::Mul(hn::Set(d, middle), hn::Add(hn::Load(d, c + i), hn::Load(d, e + i)));
    hn::Store(hn::Add(ends, middles), d, out + i);
  }
}

void addSliceOf(const float* HWY_RESTRICT after, float* HWY_RESTRICT sum) {
  const SliceLanes d;
  for (int i = 0; i != detail::kSliceArea; i += kSliceLanes)
    hn::Store(hn::Add(hn::Load(d, sum + i), hn::Load(d, after + i)), d, sum + i);
}

void storeSliceOf(const float* HWY_RESTRICT sum, float bend, float* HWY_RESTRICT out) {
  using namespace detail;
  const SliceLanes d;
  alignas(64) float nodes[kSliceArea];
  for (int i = 0; i != kSliceArea; i += kSliceLanes) {
    const SliceFloats column = hn::Max(hn::Load(d, sum + i), hn::Zero(d));
    hn::Store(hn::Sqrt(hn::Mul(column, hn::Add(column, hn::Set(d, 2 * bend)))), d, nodes + i);
  }
  for (int j = 0; j != kSliceNodes; ++j)
    std::copy_n(nodes + j * kSliceRow, kSliceNodes, out + j * kSliceNodes);
}

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace nephele {

HWY_EXPORT(mixSliceOf);
HWY_EXPORT(addSlicesOf);
HWY_EXPORT(addSliceOf);
HWY_EXPORT(storeSliceOf);

void detail::mixSlice(const float* samples, const SliceWeights& weights, float most, SliceNodes& out) {
  HWY_DYNAMIC_DISPATCH(mixSliceOf)(samples, weights, most, out.data());
}

void detail::addSlices(float end, const SliceNodes& a, const SliceNodes& b, float middle, const SliceNodes& c,
                       const SliceNodes& d, SliceNodes& out) {
  HWY_DYNAMIC_DISPATCH(addSlicesOf)(end, a.data(), b.data(), middle, c.data(), d.data(), out.data());
}

void detail::addSlice(const SliceNodes& after, SliceNodes& sum) {
  HWY_DYNAMIC_DISPATCH(addSliceOf)(after.data(), sum.data());
}

void detail::storeSlice(const SliceNodes& sum, float bend, float* out) {
  HWY_DYNAMIC_DISPATCH(storeSliceOf)(sum.data(), bend, out);
}

}  // namespace nephele

#endif  // HWY_ONCE

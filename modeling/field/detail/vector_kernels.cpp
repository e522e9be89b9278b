// Lane kernels of products, lengths and affine maps, for every instruction set that the machine may have.
// Sums and products are never fused, so that all machines give the same bits.
#include <cstddef>

#include "nephele/modeling/field/detail/field_kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nephele/modeling/field/detail/vector_kernels.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as it decides what they define.
#include <hwy/highway.h>

#include "nephele/modeling/base/float_lanes.h"

HWY_BEFORE_NAMESPACE();
namespace nephele::detail::HWY_NAMESPACE {

void productLanes(const float* a, const float* b, float sign, bool accumulate, float* out, int count) {
  const D d;
  const V s = constant(sign);
  for (int i = 0; i < count; i += int(hn::Lanes(d))) {
    const V p = hn::Mul(hn::Mul(hn::Load(d, a + i), s), hn::Load(d, b + i));
    hn::Store(accumulate ? hn::Add(hn::Load(d, out + i), p) : p, d, out + i);
  }
}

void length3Lanes(const float* const v[3], float* out, int count) {
  const D d;
  for (int i = 0; i < count; i += int(hn::Lanes(d))) {
    const V x = hn::Load(d, v[0] + i), y = hn::Load(d, v[1] + i), z = hn::Load(d, v[2] + i);
    hn::Store(hn::Sqrt(hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z))), d, out + i);
  }
}

void normalize3Lanes(const float* const v[3], const float* length, float* const out[3], int count) {
  const D d;
  for (int i = 0; i < count; i += int(hn::Lanes(d))) {
    const V l = hn::Load(d, length + i);
    const auto zero = hn::Eq(l, hn::Zero(d));
    for (int k = 0; k < 3; ++k)
      hn::Store(hn::IfThenZeroElse(zero, hn::Div(hn::Load(d, v[k] + i), l)), d, out[k] + i);
  }
}

void affine3Lanes(const float m[9], const float t[3], const float* const v[3], float* const out[3],
                  int count) {
  const D d;
  for (int i = 0; i < count; i += int(hn::Lanes(d))) {
    const V x = hn::Load(d, v[0] + i), y = hn::Load(d, v[1] + i), z = hn::Load(d, v[2] + i);
    for (int r = 0; r < 3; ++r) {
      const V xy = hn::Add(hn::Mul(constant(m[3 * r]), x), hn::Mul(constant(m[3 * r + 1]), y));
      hn::Store(hn::Add(hn::Add(xy, hn::Mul(constant(m[3 * r + 2]), z)), constant(t[r])), d, out[r] + i);
    }
  }
}

}  // namespace nephele::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace nephele::detail {

HWY_EXPORT(productLanes);
HWY_EXPORT(length3Lanes);
HWY_EXPORT(normalize3Lanes);
HWY_EXPORT(affine3Lanes);

void product(const float* a, const float* b, float sign, bool accumulate, float* out, int count) {
  HWY_DYNAMIC_DISPATCH(productLanes)(a, b, sign, accumulate, out, count);
}
void length3(const float* const v[3], float* out, int count) {
  HWY_DYNAMIC_DISPATCH(length3Lanes)(v, out, count);
}
void normalize3(const float* const v[3], const float* length, float* const out[3], int count) {
  HWY_DYNAMIC_DISPATCH(normalize3Lanes)(v, length, out, count);
}
void affine3(const float m[9], const float t[3], const float* const v[3], float* const out[3], int count) {
  HWY_DYNAMIC_DISPATCH(affine3Lanes)(m, t, v, out, count);
}

}  // namespace nephele::detail
#endif  // HWY_ONCE

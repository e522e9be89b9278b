// No #pragma once: read once for every instruction set, by files that use <hwy/foreach_target.h>.
#if defined(NEPHELE_EXP_OF_MINUS_LANES) == defined(HWY_TARGET_TOGGLE)
#ifdef NEPHELE_EXP_OF_MINUS_LANES
#undef NEPHELE_EXP_OF_MINUS_LANES
#else
#define NEPHELE_EXP_OF_MINUS_LANES
#endif

#include <hwy/highway.h>

#include "nephele/render/light/exp_of_minus.h"

/// detail::expOfMinus for vectors.
HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

template <class D>
HWY_INLINE hwy::HWY_NAMESPACE::Vec<D> expOfMinus(D d, hwy::HWY_NAMESPACE::Vec<D> x) {
  namespace hn = hwy::HWY_NAMESPACE;
  using Floats = hn::Vec<D>;
  const hn::RebindToSigned<D> i;
  constexpr auto& kPower = detail::kPowerOfTwo;
  const Floats y = hn::Mul(x, hn::Set(d, detail::kPerMinusLog2)), middle = hn::Set(d, detail::kRounding);
  const Floats whole = hn::Add(y, middle), f = hn::Sub(y, hn::Sub(whole, middle)), f2 = hn::Mul(f, f);
  const auto line = [&](float slope, float at0)
                        HWY_ATTR { return hn::MulAdd(f, hn::Set(d, slope), hn::Set(d, at0)); };
  const Floats high = hn::MulAdd(hn::MulAdd(f2, hn::Set(d, kPower[5]), line(kPower[4], kPower[3])), f2,
                                 line(kPower[2], kPower[1]));
  const Floats power = hn::MulAdd(high, f2, line(kPower[0], 1.0f));
  return hn::BitCast(d, hn::Add(hn::BitCast(i, power), hn::ShiftLeft<23>(hn::BitCast(i, whole))));
}

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif

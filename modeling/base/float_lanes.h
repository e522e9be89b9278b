// No #pragma once: read once for every instruction set, by files that use <hwy/foreach_target.h>.
#if defined(NEPHELE_FLOAT_LANES) == defined(HWY_TARGET_TOGGLE)
#ifdef NEPHELE_FLOAT_LANES
#undef NEPHELE_FLOAT_LANES
#else
#define NEPHELE_FLOAT_LANES
#endif

#include <hwy/highway.h>

/// The lanes that kernels of fields and noises work on. For their implementation.
HWY_BEFORE_NAMESPACE();
namespace nephele::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// At most 16 floats, so that a multiple of 16 needs no tail.
using D = hn::CappedTag<float, 16>;
using V = hn::Vec<D>;

HWY_INLINE V constant(float v) {
  return hn::Set(D(), v);
}

}  // namespace nephele::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif

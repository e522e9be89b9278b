// Loops over lanes, compiled from the formulas for one point once for each instruction set, of which Highway
// chooses one when the program runs.
#include "nephele/modeling/shape/detail/shape_kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nephele/modeling/shape/detail/shape_kernels.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as it decides what it defines.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace nephele::detail::HWY_NAMESPACE {

template <class Shape>
void valueLoop(const Shape shape, const float* __restrict x, const float* __restrict y,
               const float* __restrict z, float* __restrict values, int count) {
  for (int i = 0; i < count; ++i) {
    float unused[3];
    values[i] = shape.template at<false>(x[i], y[i], z[i], unused[0], unused[1], unused[2]);
  }
}

template <class Shape>
void gradLoop(const Shape shape, const float* __restrict x, const float* __restrict y,
              const float* __restrict z, float* __restrict values, float* __restrict gx, float* __restrict gy,
              float* __restrict gz, int count) {
  for (int i = 0; i < count; ++i) values[i] = shape.template at<true>(x[i], y[i], z[i], gx[i], gy[i], gz[i]);
}

void valueLanes(const ShapeKind& kind, const PointBlock& p, float* values) {
  std::visit([&](const auto& shape) HWY_ATTR { valueLoop(shape, p.x, p.y, p.z, values, p.paddedCount()); },
             kind);
}

void gradLanes(const ShapeKind& kind, const PointBlock& p, float* values, const BlockLanes<3>& g) {
  std::visit([&](const auto& shape)
                 HWY_ATTR { gradLoop(shape, p.x, p.y, p.z, values, g[0], g[1], g[2], p.paddedCount()); },
             kind);
}

}  // namespace nephele::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace nephele::detail {

HWY_EXPORT(valueLanes);
HWY_EXPORT(gradLanes);

void shapeLanes(const ShapeKind& kind, const PointBlock& points, float* values) {
  HWY_DYNAMIC_DISPATCH(valueLanes)(kind, points, values);
}

void shapeGradLanes(const ShapeKind& kind, const PointBlock& points, float* values,
                    const BlockLanes<3>& grads) {
  HWY_DYNAMIC_DISPATCH(gradLanes)(kind, points, values, grads);
}

}  // namespace nephele::detail
#endif  // HWY_ONCE

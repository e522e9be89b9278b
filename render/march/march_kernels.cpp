// The inner loop of the renderer: density, light and opacity along a ray.
//
// Per step:  dT = exp(-sigma ds);  C += T (1 - dT) (sum of lights);  T *= dT,  written as T (1 - dT) =
// T_before - T_after with T = exp(-optical depth so far), so that the weights of a ray add up to its opacity
// exactly, whatever the steps are.
//
// As many rays as a vector has lanes find the bricks on their way together; then one after the other is
// marched. Steps are gathered into blocks of 64 that run across bricks. Densities of a block are looked up as
// vectors: brick table, then the eight corners. So is the light, in every sun's column densities and in the
// scattered light, of those steps alone that add to the picture, once they fill a vector. Densities and
// columns are CodedBricks, about half as many bytes to wait for.
//
// Limits: pool bricks are indexed by 32 bits (RenderVolume refuses more).
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nephele/render/march/march_kernels.cpp"
#include "nephele/render/march/march_kernels.h"

#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <limits>

#include "nephele/render/march/detail/march_runs.h"
#include "nephele/render/march/detail/march_walk.h"
#include "nephele/render/march/detail/marcher_light.h"
#include "nephele/render/march/detail/marcher_record.h"
#include "nephele/render/march/detail/marcher_steps.h"
#include "nephele/render/march/detail/marcher_take.h"

HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

template <class March>
HWY_INLINE void marchEach(const MarchScene& scene, const MarchRay* rays, float opaque, MarchResult* results,
                          MarchRecord* records, std::size_t count, March&& march) {
  for (std::size_t i = 0; i != count; ++i) {
    results[i] = {};
    results[i].distance = std::numeric_limits<float>::infinity();
    if (records) records[i].clear();
    const auto one = [&]<int kColours>() HWY_ATTR {
      Marcher<kColours> marcher(scene, rays[i], opaque, results[i], records ? records + i : nullptr);
      march(marcher, i);
      marcher.finish();
    };
    if (scene.isColoured())
      one.template operator()<3>();
    else
      one.template operator()<1>();
  }
}

void marchBatch(const MarchScene& scene, const MarchRay* rays, MarchResult* results, MarchRecord* records,
                std::size_t count) {
  const detail::StepGrowth law(scene);
  BrickRows rows;
  marchEach(scene, rays, law.opaque, results, records, count, [&](auto& marcher, std::size_t i) HWY_ATTR {
    const int lane = int(i % kLanes);
    if (lane == 0)
      findBricks(scene, rays + i, int(std::min<std::size_t>(kLanes, count - i)), 0.0f, law.opaque, rows);
    detail::forEachRun(
        scene, rays[i], law,
        [&](auto&& visit) HWY_ATTR { forEachBrick(scene, rays[i], law.opaque, rows, lane, visit); },
        [&](const auto&... steps) { return marcher.take(steps...); });
  });
}

void marchStepsBatch(const MarchScene& scene, const MarchRay* rays, const std::span<const MarchStep>* steps,
                     MarchResult* results, MarchRecord* records, std::size_t count) {
  const float opaque = detail::StepGrowth(scene).opaque;
  marchEach(scene, rays, opaque, results, records, count, [&](auto& marcher, std::size_t i) HWY_ATTR {
    for (const MarchStep& step : steps[i])
      if (!marcher.take(step)) break;
  });
}

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "nephele/modeling/base/error.h"

namespace nephele {

HWY_EXPORT(marchBatch);
HWY_EXPORT(marchStepsBatch);

void marchRays(const MarchScene& scene, std::span<const MarchRay> rays, std::span<MarchResult> results,
               std::span<MarchRecord> records) {
  require(rays.size() == results.size(), "march: as many results as rays are needed");
  require(records.empty() || records.size() == rays.size(), "march: as many records as rays are needed");
  HWY_DYNAMIC_DISPATCH(marchBatch)
  (scene, rays.data(), results.data(), records.empty() ? nullptr : records.data(), rays.size());
}

void marchSteps(const MarchScene& scene, std::span<const MarchRay> rays,
                std::span<const std::span<const MarchStep>> steps, std::span<MarchResult> results,
                std::span<MarchRecord> records) {
  require(rays.size() == results.size(), "march: as many results as rays are needed");
  require(rays.size() == steps.size(), "march: as many lists of steps as rays are needed");
  require(records.empty() || records.size() == rays.size(), "march: as many records as rays are needed");
  HWY_DYNAMIC_DISPATCH(marchStepsBatch)
  (scene, rays.data(), steps.data(), results.data(), records.empty() ? nullptr : records.data(), rays.size());
}

}  // namespace nephele

#endif  // HWY_ONCE

// The inner loop of the renderer: density, light and opacity along a ray.
//
// Per step:  dT = exp(-sigma ds);  C += T (1 - dT) (sum of lights);  T *= dT,  written as T (1 - dT) =
// T_before - T_after with T = exp(-optical depth so far), so that the weights of a ray add up to its opacity
// exactly, whatever the steps are.
//
// Steps are gathered into blocks of 32 that run across bricks. A block is looked up as vectors: brick table,
// then the eight corners, in the density, in every sun's column densities and in the scattered light. The
// first two are CodedBricks, half as many bytes to wait for. Whatever does not have to wait for the densities
// stands beside what does.
//
// Limits: pool bricks are indexed by 32 bits (RenderVolume refuses more).
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nephele/render/march/march_kernels.cpp"
#include "nephele/render/march/march_kernels.h"

#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <limits>

#include "nephele/render/march/detail/march_runs.h"
#include "nephele/render/march/detail/marcher.h"

HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

void marchBatch(const MarchScene& scene, const MarchRay* rays, MarchResult* results, MarchRecord* records,
                std::size_t count) {
  for (std::size_t i = 0; i != count; ++i) {
    results[i] = {};
    results[i].distance = std::numeric_limits<float>::infinity();
    if (records) records[i].clear();
    Marcher marcher(scene, rays[i], results[i], records ? records + i : nullptr);
    detail::forEachRun(scene, rays[i], [&](float s, float ds, int n, float density) {
      return marcher.take(s, ds, n, density);
    });
    marcher.finish();
  }
}

void marchStepsBatch(const MarchScene& scene, const MarchRay* rays, const std::span<const MarchStep>* steps,
                     MarchResult* results, MarchRecord* records, std::size_t count) {
  for (std::size_t i = 0; i != count; ++i) {
    results[i] = {};
    results[i].distance = std::numeric_limits<float>::infinity();
    if (records) records[i].clear();
    Marcher marcher(scene, rays[i], results[i], records ? records + i : nullptr);
    for (const MarchStep& step : steps[i])
      if (!marcher.take(step)) break;
    marcher.finish();
  }
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

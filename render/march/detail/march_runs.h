#pragma once

#include <algorithm>
#include <cmath>

#include "nephele/render/volume/brick_walk.h"

namespace nephele::detail {

/// How much longer steps may be behind an optical depth for the same error in the picture: that of a step is
/// as its transmittance and the cube of its length. The start of the exponential's series is near enough.
inline float stepGrowth(const MarchScene& scene, float depth) {
  const float x = depth * scene.leastColour() * (1.0f / 3);
  return std::min(1 + x + 0.5f * x * x, scene.mostGrowth);
}

/// Cuts the occupied part of a ray into runs of equal steps: calls take(s, ds, count, density), where steps
/// start at s, s + ds ..., and stops when it returns false. `density` is negative where it has to be looked
/// up.
///
/// Runs go on from brick to brick where bricks touch, so that their borders leave no trace, and start anew
/// behind a gap. Steps grow with the optical depth that the ranges of the bricks in front promise.
template <class Take>
[[gnu::always_inline]] inline void forEachRun(const MarchScene& scene, const MarchRay& ray, Take&& take) {
  // Enough steps to be worth a call.
  constexpr int kMany = 64;
  struct Run {
    float start = 0.0f, ds = 0.0f, perStep = 0.0f, density = -1.0f, end = 0.0f;
    int count = 0;
  } run;
  float cursor = 0.0f, depth = 0.0f, growth = 1.0f;
  bool goesOn = true;
  walkBricks(
      scene, ray.density,
      ray.length, [&](float s0, float s1, std::int32_t pool) __attribute__((always_inline)) {
        cursor = std::max(cursor, s0);
        if (!(cursor < s1)) return true;
        const Interval& range = scene.ranges[pool];
        const bool uniform = range.max - range.min < 0.01f * range.max;
        const float usual = uniform ? scene.uniformStep : scene.step;
        const float wide = std::max(usual, std::min(4.0f * scene.step, scene.pixelAngle * (ray.start + s0)));
        const float thickest = scene.extinction * range.max,
                    thinnest = scene.extinction * std::max(range.min, 0.0f);
        const float least =
            std::max(thickest * wide > scene.stepDepth ? scene.stepDepth / thickest : wide, scene.leastStep);
        while (cursor < s1) {
          // Where the density varies it must still be met at every voxel.
          float ds = uniform ? least * growth : std::min(least * growth, std::max(least, scene.step));
          // As far as the growth is about the same.
          const float end =
              thinnest * (s1 - cursor) > 1 ? std::min(s1, cursor + std::max(1.0f / thinnest, ds)) : s1;
          const float perStep = ds == run.ds ? run.perStep : 1.0f / ds;
          const int count = int(std::ceil((end - cursor) * perStep));
          // The last of steps longer than a voxel must not reach into a brick that differs.
          if (end == s1 && (uniform || (ray.isCut && s1 >= ray.length))) ds = (s1 - cursor) / float(count);
          const float start = cursor, density = range.isPoint() ? range.max : -1.0f;
          cursor += float(count) * ds;
          if (thinnest > 0) {
            depth += thinnest * (std::min(cursor, s1) - start);
            growth = stepGrowth(scene, depth);
          }
          if (run.count > 0 && run.count < kMany && start == run.end && ds == run.ds &&
              density == run.density) {
            run.count += count;
          } else {
            if (run.count > 0 && !take(run.start, run.ds, run.count, run.density)) return goesOn = false;
            run = {start, ds, perStep, density, cursor, count};
            continue;
          }
          run.end = cursor;
        }
        return true;
      });
  if (goesOn && run.count > 0) take(run.start, run.ds, run.count, run.density);
}

}  // namespace nephele::detail

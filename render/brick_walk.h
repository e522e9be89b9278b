#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "render/march_kernels.h"

namespace nephele::detail {

/// Optical depth at which the opacity is 0.5 %, from where on a ray counts as having met something.
inline constexpr float kVisibleDepth = 0.0050125418f;
inline constexpr float kVisibleOpacity = 0.005f;

/// Calls visit(s0, s1, pool brick) for every brick with density that a ray passes, near to far, until it
/// returns false; once for several bricks in a row where these are the same constant.
///
/// A DDA over bricks; where a brick is `emptiness` bricks away from any density, or `uniformity` bricks away
/// from any other density, the box of that radius is left in one step.
template <class Visit>
inline void walkBricks(const MarchScene& scene, const LatticeRay& ray, float length, Visit&& visit) {
  constexpr float size = 8.0f;
  constexpr float infinite = std::numeric_limits<float>::infinity();
  const Vec3i count = scene.density.count;
  Vec3i brick, forward;
  // The ray meets plane n of an axis at n perPlane + zeroth: never, where it runs along it.
  Vec3f perPlane, zeroth, exits;
  const auto exitOf = [&](int axis, int plane) { return float(plane) * perPlane[axis] + zeroth[axis]; };
  for (int axis = 0; axis != 3; ++axis) {
    brick[axis] = std::clamp(int(std::floor(ray.origin[axis] / size)), 0, count[axis] - 1);
    forward[axis] = ray.direction[axis] > 0 ? 1 : 0;
    const float inverse = 1.0f / ray.direction[axis];
    const bool crosses = std::abs(ray.direction[axis]) > 1e-30f;
    perPlane[axis] = crosses ? size * inverse : 0.0f;
    zeroth[axis] = crosses ? -ray.origin[axis] * inverse : infinite;
    exits[axis] = exitOf(axis, brick[axis] + forward[axis]);
  }
  float s = 0.0f;
  for (;;) {
    const std::size_t entry =
        (std::size_t(brick.z) * std::size_t(count.y) + std::size_t(brick.y)) * std::size_t(count.x) +
        std::size_t(brick.x);
    const int away = scene.emptiness[entry],
              alike = away == 0 && scene.uniformity ? scene.uniformity[entry] : away;
    if (alike <= 1) {
      // Rounding must not turn the ray back.
      const float nearest = std::min({exits.x, exits.y, exits.z}), out = std::max(nearest, s);
      if (away == 0 && !visit(s, std::min(out, length), scene.density.table[entry])) return;
      if (!(out < length)) return;
      s = out;
      // Without branches, which could not be foreseen; through an edge on both axes at once.
      bool isInside = true;
      for (int axis = 0; axis != 3; ++axis) {
        const bool crossed = exits[axis] == nearest;
        brick[axis] += crossed ? 2 * forward[axis] - 1 : 0;
        exits[axis] = exitOf(axis, brick[axis] + forward[axis]);
        isInside &= unsigned(brick[axis]) < unsigned(count[axis]);
      }
      if (!isInside) return;
      continue;
    }
    const int radius = alike - 1;
    int exit = 0;
    float out = infinite;
    for (int axis = 0; axis != 3; ++axis) {
      const float at = exitOf(axis, forward[axis] ? brick[axis] + radius + 1 : brick[axis] - radius);
      if (at < out) out = at, exit = axis;
    }
    out = std::max(out, s);
    if (away == 0 && !visit(s, std::min(out, length), scene.density.table[entry])) return;
    if (!(out < length)) return;

    s = out;
    const int low = brick[exit] - radius, high = brick[exit] + radius;
    for (int axis = 0; axis != 3; ++axis) {
      const int at = int(std::floor((ray.origin[axis] + s * ray.direction[axis]) / size));
      brick[axis] =
          std::clamp(std::clamp(at, brick[axis] - radius, brick[axis] + radius), 0, count[axis] - 1);
    }
    brick[exit] = forward[exit] ? high + 1 : low - 1;
    if (brick[exit] < 0 || brick[exit] >= count[exit]) return;
    for (int axis = 0; axis != 3; ++axis) exits[axis] = exitOf(axis, brick[axis] + forward[axis]);
  }
}

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
inline void forEachRun(const MarchScene& scene, const MarchRay& ray, Take&& take) {
  // Enough steps to be worth a call.
  constexpr int kMany = 64;
  struct Run {
    float start = 0.0f, ds = 0.0f, perStep = 0.0f, density = -1.0f, end = 0.0f;
    int count = 0;
  } run;
  float cursor = 0.0f, depth = 0.0f, growth = 1.0f;
  bool goesOn = true;
  walkBricks(scene, ray.density, ray.length, [&](float s0, float s1, std::int32_t pool) {
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
      if (run.count > 0 && run.count < kMany && start == run.end && ds == run.ds && density == run.density) {
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

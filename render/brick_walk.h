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
  const Vec3i count = scene.density.count;
  Vec3i brick, side;
  Vec3f inverse;
  for (int axis = 0; axis != 3; ++axis) {
    brick[axis] = std::clamp(int(std::floor(ray.origin[axis] / size)), 0, count[axis] - 1);
    side[axis] = ray.direction[axis] > 0 ? 1 : 0;
    inverse[axis] = 1.0f / ray.direction[axis];
  }
  float s = 0.0f;
  for (;;) {
    const std::size_t entry =
        (std::size_t(brick.z) * std::size_t(count.y) + std::size_t(brick.y)) * std::size_t(count.x) +
        std::size_t(brick.x);
    const int away = scene.emptiness[entry],
              alike = away == 0 && scene.uniformity ? scene.uniformity[entry] : away;
    const int radius = alike > 1 ? alike - 1 : 0;

    int exit = 0;
    float out = std::numeric_limits<float>::infinity();
    for (int axis = 0; axis != 3; ++axis) {
      if (ray.direction[axis] == 0) continue;
      const int plane = side[axis] ? brick[axis] + radius + 1 : brick[axis] - radius;
      const float at = (float(plane) * size - ray.origin[axis]) * inverse[axis];
      if (at < out) out = at, exit = axis;
    }
    // Rounding must not turn the ray back.
    out = std::max(out, s);
    if (away == 0 && !visit(s, std::min(out, length), scene.density.table[entry])) return;
    if (!(out < length)) return;

    s = out;
    const int low = brick[exit] - radius, high = brick[exit] + radius;
    if (radius > 0)
      for (int axis = 0; axis != 3; ++axis) {
        const int at = int(std::floor((ray.origin[axis] + s * ray.direction[axis]) / size));
        brick[axis] =
            std::clamp(std::clamp(at, brick[axis] - radius, brick[axis] + radius), 0, count[axis] - 1);
      }
    brick[exit] = side[exit] ? high + 1 : low - 1;
    if (brick[exit] < 0 || brick[exit] >= count[exit]) return;
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
  float cursor = 0.0f, depth = 0.0f, growth = 1.0f;
  walkBricks(scene, ray.density, ray.length, [&](float s0, float s1, std::int32_t pool) {
    cursor = std::max(cursor, s0);
    if (!(cursor < s1)) return true;
    const Interval& range = scene.ranges[pool];
    const bool uniform = range.max - range.min < 0.01f * range.max;
    const float usual = uniform ? scene.uniformStep : scene.step;
    const float wide = std::max(usual, std::min(4.0f * scene.step, scene.pixelAngle * (ray.start + s0)));
    const float thickest = scene.extinction * range.max,
                thinnest = scene.extinction * std::max(range.min, 0.0f);
    const float least = std::max(std::min(wide, scene.stepDepth / thickest), scene.leastStep);
    while (cursor < s1) {
      // Where the density varies it must still be met at every voxel.
      float ds = uniform ? least * growth : std::min(least * growth, std::max(least, scene.step));
      // As far as the growth is about the same.
      const float end = std::min(s1, cursor + std::max(1.0f / thinnest, ds));
      const int count = int(std::ceil((end - cursor) / ds));
      // The last of steps longer than a voxel must not reach into a brick that differs.
      if (end == s1 && (uniform || (ray.isCut && s1 >= ray.length))) ds = (s1 - cursor) / float(count);
      const float start = cursor;
      cursor += float(count) * ds;
      if (thinnest > 0) {
        depth += thinnest * (std::min(cursor, s1) - start);
        growth = stepGrowth(scene, depth);
      }
      if (!take(start, ds, count, range.isPoint() ? range.max : -1.0f)) return false;
    }
    return true;
  });
}

}  // namespace nephele::detail

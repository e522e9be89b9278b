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
/// returns false.
///
/// A DDA over bricks; where a brick is `emptiness` bricks away from any density, the box of that radius is
/// left in one step.
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
    const int away = scene.emptiness[entry], radius = away > 1 ? away - 1 : 0;

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

/// Cuts the occupied part of a ray into runs of equal steps: calls take(s, ds, count), where steps start at
/// s, s + ds ..., and stops when it returns false.
///
/// Runs go on from brick to brick where bricks touch, so that their borders leave no trace, and start anew
/// behind a gap.
template <class Take>
inline void forEachRun(const MarchScene& scene, const MarchRay& ray, Take&& take) {
  float cursor = 0.0f;
  walkBricks(scene, ray.density, ray.length, [&](float s0, float s1, std::int32_t pool) {
    const Interval& range = scene.ranges[pool];
    const bool uniform = range.max - range.min < 0.01f * range.max;
    const float usual = uniform ? scene.uniformStep : scene.step;
    const float wide = std::max(usual, std::min(4.0f * scene.step, scene.pixelAngle * (ray.start + s0)));
    float ds = std::max(std::min(wide, scene.stepDepth / (scene.extinction * range.max)), scene.leastStep);
    cursor = std::max(cursor, s0);
    if (!(cursor < s1)) return true;
    const int count = int(std::ceil((s1 - cursor) / ds));
    // The last of steps longer than a voxel must not reach into a brick that differs.
    if (uniform || (ray.isCut && s1 >= ray.length)) ds = (s1 - cursor) / float(count);
    const float start = cursor;
    cursor += float(count) * ds;
    return take(start, ds, count);
  });
}

}  // namespace nephele::detail

#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "nephele/render/volume/lattice_ray.h"
#include "nephele/render/volume/march_scene.h"

namespace nephele::detail {

/// Optical depth at which the opacity is 0.5 %, from where on a ray counts as having met something.
inline constexpr float kVisibleDepth = 0.0050125418f;
inline constexpr float kVisibleOpacity = 0.005f;

/// Along the axes; the fourth is of no use.
using Axes [[gnu::vector_size(16)]] = float;
using AxesInts [[gnu::vector_size(16)]] = std::int32_t;

/// The least of the four, in all four places.
[[gnu::always_inline]] inline Axes leastOf(Axes x) {
  const Axes halves = __builtin_shufflevector(x, x, 2, 3, 0, 1);
  x = x < halves ? x : halves;
  const Axes others = __builtin_shufflevector(x, x, 1, 0, 3, 2);
  return x < others ? x : others;
}

/// Calls visit(s0, s1, pool brick) for every brick with density that a ray passes, near to far, until it
/// returns false; once for several bricks in a row where these are the same constant.
///
/// A DDA over bricks, all axes at once and without branches that could not be foreseen; where a brick is
/// `emptiness` bricks away from any density, or `uniformity` bricks away from any other density, the box of
/// that radius is left in one step. The kernels of the march walk vectors of rays in the same way.
template <class Visit>
[[gnu::always_inline]] inline void walkBricks(const MarchScene& scene, const LatticeRay& ray, float length,
                                              Visit&& visit) {
  constexpr float size = 8.0f;
  constexpr float infinite = std::numeric_limits<float>::infinity();
  const AxesInts count{scene.density.count.x, scene.density.count.y, scene.density.count.z, 1};
  const AxesInts strides{1, count[0], count[0] * count[1], 0};
  const Axes origin{ray.origin.x, ray.origin.y, ray.origin.z, 0.0f},
      direction{ray.direction.x, ray.direction.y, ray.direction.z, 0.0f}, inverse = 1.0f / direction;
  const AxesInts isForward = direction > 0.0f, forward = -isForward;
  const AxesInts crosses = (direction < 0.0f ? -direction : direction) > 1e-30f;
  // The ray meets plane n of an axis at n perPlane + zeroth: never, where it runs along it. `step` is that of
  // the planes, `stride` that of the table's entries.
  const Axes perPlane = crosses ? size * inverse : Axes{},
             zeroth = crosses ? -origin * inverse : Axes{} + infinite,
             step = isForward ? Axes{} + 1.0f : Axes{} - 1.0f;
  const AxesInts stride = isForward ? strides : -strides;
  const auto planesOf = [](AxesInts planes) { return __builtin_convertvector(planes, Axes); };
  const auto within = [](AxesInts x, AxesInts low, AxesInts high) {
    x = x < low ? low : x;
    return x > high ? high : x;
  };
  // Where it leaves the table.
  const float end = std::min(length, leastOf(planesOf(isForward & count) * perPlane + zeroth)[0]);

  Axes plane, exits;
  std::int64_t entry = 0;
  const auto stand = [&](AxesInts brick) {
    plane = planesOf(brick + forward);
    exits = plane * perPlane + zeroth;
    entry = brick[0] + brick[1] * std::int64_t(strides[1]) + brick[2] * std::int64_t(strides[2]);
  };
  const auto bricksAt = [&](float s) {
    return within(__builtin_convertvector((origin + s * direction) * (1 / size), AxesInts), AxesInts{},
                  count - 1);
  };
  float s = 0.0f;
  stand(bricksAt(s));
  for (;;) {
    const int away = scene.emptiness[entry],
              radius = (scene.uniformity ? away | scene.uniformity[entry] : away) - 1;
    const bool isAlone = radius < 1;
    const Axes ahead = isAlone ? exits : (plane + step * float(radius)) * perPlane + zeroth;
    const Axes nearest = leastOf(ahead);
    // Rounding must not turn the ray back.
    const float out = std::max(nearest[0], s);
    if (away == 0 && !visit(s, std::min(out, end), scene.density.table[entry])) return;
    if (!(out < end)) return;
    s = out;
    // Through an edge on both axes at once.
    const AxesInts crossed = ahead <= nearest;
    if (isAlone) {
      plane += Axes(AxesInts(step) & crossed);
      exits = plane * perPlane + zeroth;
      const AxesInts passed = stride & crossed;
      entry += std::int64_t(passed[0]) + passed[1] + passed[2];
    } else {
      const AxesInts brick = __builtin_convertvector(plane, AxesInts) - forward, low = brick - radius,
                     high = brick + radius, beyond = isForward ? high + 1 : low - 1;
      stand(crossed ? beyond : within(bricksAt(s), low, high));
    }
  }
}

}  // namespace nephele::detail

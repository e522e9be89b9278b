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

/// Calls visit(s0, s1, pool brick) for every brick with density that a ray passes, near to far, until it
/// returns false; once for several bricks in a row where these are the same constant.
///
/// A DDA over bricks; where a brick is `emptiness` bricks away from any density, or `uniformity` bricks away
/// from any other density, the box of that radius is left in one step. Inlined, so that it is compiled for
/// the instructions of the kernel around it.
template <class Visit>
[[gnu::always_inline]] inline void walkBricks(const MarchScene& scene, const LatticeRay& ray, float length,
                                              Visit&& visit) {
  constexpr float size = 8.0f;
  constexpr float infinite = std::numeric_limits<float>::infinity();
  const Vec3i count = scene.density.count;
  const std::int64_t strides[3] = {1, count.x, std::int64_t(count.x) * count.y};
  // The ray meets plane n of an axis at n perPlane + zeroth: never, where it runs along it. `left` are the
  // bricks ahead, `step` is that of the planes, `stride` that of the table's entries.
  Vec3f perPlane, zeroth, plane, step, exits;
  Vec3i brick, forward, left;
  std::int64_t stride[3], entry = 0;
  const auto stand = [&](int axis) {
    plane[axis] = float(brick[axis] + forward[axis]);
    exits[axis] = plane[axis] * perPlane[axis] + zeroth[axis];
    left[axis] = forward[axis] ? count[axis] - 1 - brick[axis] : brick[axis];
    entry += brick[axis] * strides[axis];
  };
  for (int axis = 0; axis != 3; ++axis) {
    brick[axis] = std::clamp(int(std::floor(ray.origin[axis] / size)), 0, count[axis] - 1);
    forward[axis] = ray.direction[axis] > 0 ? 1 : 0;
    step[axis] = forward[axis] ? 1.0f : -1.0f;
    stride[axis] = forward[axis] ? strides[axis] : -strides[axis];
    const float inverse = 1.0f / ray.direction[axis];
    const bool crosses = std::abs(ray.direction[axis]) > 1e-30f;
    perPlane[axis] = crosses ? size * inverse : 0.0f;
    zeroth[axis] = crosses ? -ray.origin[axis] * inverse : infinite;
    stand(axis);
  }
  float s = 0.0f;
  for (;;) {
    const int away = scene.emptiness[entry],
              alike = away == 0 && scene.uniformity ? scene.uniformity[entry] : away;
    if (alike <= 1) {
      // Rounding must not turn the ray back.
      const float nearest = std::min({exits.x, exits.y, exits.z}), out = std::max(nearest, s);
      if (away == 0 && !visit(s, std::min(out, length), scene.density.table[entry])) return;
      if (!(out < length)) return;
      s = out;
      // Without branches, which could not be foreseen; through an edge on both axes at once.
      int least = 0;
      for (int axis = 0; axis != 3; ++axis) {
        const int crossed = exits[axis] <= nearest ? 1 : 0;
        plane[axis] += crossed ? step[axis] : 0.0f;
        exits[axis] = plane[axis] * perPlane[axis] + zeroth[axis];
        entry += crossed ? stride[axis] : 0;
        left[axis] -= crossed;
        least |= left[axis];
      }
      if (least < 0) return;
      continue;
    }
    const int radius = alike - 1;
    int exit = 0;
    float out = infinite;
    for (int axis = 0; axis != 3; ++axis) {
      const float at = (plane[axis] + step[axis] * float(radius)) * perPlane[axis] + zeroth[axis];
      if (at < out) out = at, exit = axis;
    }
    out = std::max(out, s);
    if (away == 0 && !visit(s, std::min(out, length), scene.density.table[entry])) return;
    if (!(out < length)) return;

    s = out;
    entry = 0;
    for (int axis = 0; axis != 3; ++axis) {
      brick[axis] = forward[axis] ? count[axis] - 1 - left[axis] : left[axis];
      const int low = brick[axis] - radius, high = brick[axis] + radius;
      // Rounded to 0, as what is below it is at the rim anyway.
      const int at = int((ray.origin[axis] + s * ray.direction[axis]) / size);
      brick[axis] = axis == exit ? (forward[axis] ? high + 1 : low - 1)
                                 : std::clamp(std::clamp(at, low, high), 0, count[axis] - 1);
      if (brick[axis] < 0 || brick[axis] >= count[axis]) return;
      stand(axis);
    }
  }
}

}  // namespace nephele::detail

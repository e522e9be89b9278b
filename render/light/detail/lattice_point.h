#pragma once

#include <algorithm>
#include <cstddef>

#include "nephele/modeling/base/math.h"

namespace nephele::detail {

/// A place between the nodes of a dense lattice, clamped to it.
struct LatticePoint {
  std::size_t first, steps[3];
  Vec3f share;

  LatticePoint(const Vec3i& size, const Vec3f& p) : first(0) {
    const std::size_t strides[3] = {1, std::size_t(size.x), std::size_t(size.x) * std::size_t(size.y)};
    for (int axis = 0; axis != 3; ++axis) {
      const float x = std::clamp(p[axis], 0.0f, float(size[axis] - 1));
      const int low = std::min(int(x), std::max(size[axis] - 2, 0));
      share[axis] = x - float(low);
      steps[axis] = size[axis] > 1 ? strides[axis] : 0;
      first += std::size_t(low) * strides[axis];
    }
  }
  /// Between the values of the nodes.
  template <class Value>
  [[gnu::always_inline]] Value of(const Value* values) const {
    const Value* at = values + first;
    const auto edge = [&](std::size_t n) { return at[n] + (at[n + steps[0]] - at[n]) * share.x; };
    const auto face = [&](std::size_t n) { return edge(n) + (edge(n + steps[1]) - edge(n)) * share.y; };
    return face(0) + (face(steps[2]) - face(0)) * share.z;
  }
};

}  // namespace nephele::detail

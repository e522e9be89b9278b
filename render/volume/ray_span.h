#pragma once

#include <algorithm>
#include <limits>

#include "nephele/modeling/base/box.h"
#include "nephele/modeling/base/math.h"

namespace nephele {

/// A part of a ray, as distances from its origin; empty if far <= near.
struct RaySpan {
  double near = 0, far = std::numeric_limits<double>::infinity();

  bool isEmpty() const { return !(far > near); }
};

/// The part of `span` that lies in a box.
inline RaySpan clipped(RaySpan span, const Vec3d& origin, const Vec3d& direction, const Box& box) {
  for (int axis = 0; axis != 3; ++axis) {
    if (direction[axis] == 0) {
      if (origin[axis] < box.min[axis] || origin[axis] > box.max[axis]) return {0, 0};
      continue;
    }
    const double inverse = 1 / direction[axis], a = (box.min[axis] - origin[axis]) * inverse,
                 b = (box.max[axis] - origin[axis]) * inverse;
    span.near = std::max(span.near, std::min(a, b));
    span.far = std::min(span.far, std::max(a, b));
  }
  return span;
}

}  // namespace nephele

#pragma once

#include "nephele/modeling/base/math.h"

namespace nephele {

/// Between the eight samples of a cell: the first one is at `first`, the next along y `row` samples behind
/// it, along z `plane`; `share` of the cell lies in front of the point, [0, 1] along each axis. The marching
/// kernels do the same with vectors.
inline float trilinear(const float* first, const Vec3f& share, int row, int plane) {
  const auto edge = [&](int at) { return first[at] + share.x * (first[at + 1] - first[at]); };
  const auto face = [&](int at) { return edge(at) + share.y * (edge(at + row) - edge(at)); };
  return face(0) + share.z * (face(plane) - face(0));
}

}  // namespace nephele

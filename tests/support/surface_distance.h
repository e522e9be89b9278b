#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "nephele/levelset/mesh/nearest_on_mesh.h"
#include "nephele/modeling/base/mesh.h"

namespace nephele::test {

/// The largest distance of the triangles of `mesh` from those of `other`, looked for on a lattice of at most
/// `spacing` on each.
inline double largestDistance(const Mesh& mesh, const Mesh& other, double spacing) {
  const NearestOnMesh nearest(other);
  double largest = 0;
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
    const auto face = mesh.face(f);
    const Vec3d &a = mesh.positions[face[0]], &b = mesh.positions[face[1]], &c = mesh.positions[face[2]];
    const int steps = int(std::ceil(std::max({length(a - b), length(b - c), length(c - a)}) / spacing));
    for (int i = 0; i <= steps; ++i)
      for (int j = 0; i + j <= steps; ++j) {
        const Vec3d p = (a * i + b * j + c * (steps - i - j)) / double(std::max(steps, 1));
        const auto hit = nearest.nearest(Vec3f(p), std::numeric_limits<float>::infinity());
        largest = std::max(largest, hit ? double(hit->distance) : largest);
      }
  }
  return largest;
}

/// The Hausdorff distance of two surfaces of triangles, as far as such lattices see it.
inline double surfaceDistance(const Mesh& a, const Mesh& b, double spacing) {
  return std::max(largestDistance(a, b, spacing), largestDistance(b, a, spacing));
}

}  // namespace nephele::test

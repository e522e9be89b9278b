#pragma once

#include <array>

#include "nephele/modeling/base/mesh.h"

namespace nephele {

/// What a closed mesh would weigh if it were solid, of density 1.
struct MassProperties {
  /// World units cubed; negative if the mesh is inside out.
  double volume = 0.0;
  double area = 0.0;
  /// Centre of mass. Of a mesh without volume: the middle of its positions.
  Vec3d centroid{};
  /// About the centroid, row-major and symmetric: I = integral of |r|^2 1 - r r^T.
  std::array<double, 9> inertia{};
};

/// Integrals over the solid by the divergence theorem, exact for flat faces up to rounding. Polygons count as
/// fans from their first corner. Cost: one pass.
MassProperties massProperties(const Mesh& mesh);

}  // namespace nephele

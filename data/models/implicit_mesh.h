#pragma once

#include <functional>

#include "nephele/modeling/base/mesh.h"

namespace nephele {

/// A signed distance, or nearly one, positive inside. Plain double arithmetic, so that every machine makes
/// the same mesh of it.
using Shape = std::function<double(const Vec3d&)>;

/// The larger of both, with a fillet of about `radius`.
double blended(double a, double b, double radius);

/// `p` with coordinates that are multiples of 1 / perUnit.
Vec3d rounded(const Vec3d& p, double perUnit);

/// The surface of `shape` between `low` and `high` by marching cubes, its vertices spread evenly by steps of
/// smoothing, each of which puts them back on the exact surface. Coordinates are rounded to 1e-4.
Mesh meshOf(const Shape& shape, const Vec3d& low, const Vec3d& high, double voxelSize, int smoothingSteps);

}  // namespace nephele

#pragma once

#include <functional>

#include "nephele/modeling/base/mesh.h"

namespace nephele {

/// A closed mesh of quads, with triangles at two poles, whose vertices are `pointAt(u, v)`: u from 0 to 1
/// once around, v from 0 at one pole to 1 at the other. They are its texture coordinates, with a seam at u =
/// 0; corners at a pole have the u of the middle of their face. Faces look outward where u turns about +y as
/// v rises along it.
Mesh sphereGrid(int columns, int rows, const std::function<Vec3d(double u, double v)>& pointAt);

}  // namespace nephele

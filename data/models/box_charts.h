#pragma once

#include "nephele/modeling/base/mesh.h"

namespace nephele {

/// Gives a mesh of triangles texture coordinates: faces that look the same way along an axis, and hang
/// together, are a chart; charts are laid side by side in the unit square, all on one scale.
void addBoxCharts(Mesh& mesh);

}  // namespace nephele

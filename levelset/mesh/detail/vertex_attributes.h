#pragma once

#include "nephele/modeling/base/mesh.h"

namespace nephele::detail {

/// `target` with the vertex attributes of `source`, a triangle mesh: those of the vertex at the same position
/// (the first, if there are several), elsewhere what the closest point of the surface has, linear over its
/// triangle. Attributes that `target` had are gone. @throws Error if `source` has no faces.
Mesh withVertexAttributesOf(const Mesh& source, Mesh target);

}  // namespace nephele::detail

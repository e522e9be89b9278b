#pragma once

#include "nephele/modeling/base/mesh.h"

namespace nephele::detail {

/// A closed, manifold surface around any triangle soup that lies `offset` off it and enters only openings
/// wider than about `alpha` (both world units). @throws Error if the wrap fails.
Mesh wrapped(const Mesh& triangles, double alpha, double offset);

}  // namespace nephele::detail

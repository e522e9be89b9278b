#pragma once

#include "nephele/modeling/base/mesh.h"
#include "nephele/modeling/base/progress.h"

namespace nephele::detail {

/// A closed, manifold surface around any triangle soup that lies `offset` off it and enters only openings
/// wider than about `alpha` (both world units). Cost: some 30 us for each square of that size on the surface;
/// on one thread. @throws Error if the wrap fails; Cancelled.
Mesh wrapped(const Mesh& triangles, double alpha, double offset, const Progress& progress);

}  // namespace nephele::detail

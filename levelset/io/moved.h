#pragma once

#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/similarity.h"

namespace nephele {

/// The grid elsewhere; no value is resampled. Distances of level sets are scaled, velocities (staggered, of
/// that kind of vector, or called so) turn and are scaled, normals turn; all other values are as they were,
/// densities too: they are per world unit.
/// @throws Error naming the grid if the scale is not > 0 and finite, if it has a frustum transform, or is
/// staggered and would be turned.
VdbGrid moved(const VdbGrid& grid, const Similarity& by);

}  // namespace nephele

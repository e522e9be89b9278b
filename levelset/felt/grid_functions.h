#pragma once

#include "nephele/modeling/felt/registry.h"

namespace nephele::felt {

/// Adds what needs grids, meshes and files: caches, surfaces and level sets of shapes, reading and writing,
/// clouds on grids, cuts, flows. To be added after `addModelingFunctions`, whose operators scripts need.
void addLevelsetFunctions(Registry& registry);

}  // namespace nephele::felt

#pragma once

#include "nephele/levelset/cut/cut.h"

namespace nephele::detail {

/// `cutIntoMeshes` of a level set of which `whole` is the mesh by `marchingTetrahedra`.
Pieces cutLevelSet(const BrickGrid& level, const Mesh& whole, const Knives& knives, const CutOptions& options,
                   const Progress& progress);

}  // namespace nephele::detail

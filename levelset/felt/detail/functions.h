#pragma once

#include "nephele/modeling/felt/argument.h"
#include "nephele/modeling/felt/registry.h"

/// The built-in functions of levelset, by the headings of the reference.
namespace nephele::felt {

void addCacheFunctions(Registry& registry);
void addMeshFunctions(Registry& registry);
void addFileFunctions(Registry& registry);
void addGriddedCloudFunctions(Registry& registry);

/// The closed mesh of triangles that a shape stands for, repaired as far as that goes; what was done is told
/// as notes. @throws Error as `repairMesh`; Cancelled.
Mesh solidOf(const Shape& shape, const Context& context);
/// `level` cut off by a box that holds all of its inside, so that its ranges show where that ends: beyond the
/// box it falls by at least `slope` per world unit.
ScalarField endingAt(const ScalarField& level, const Box& box, float slope);

}  // namespace nephele::felt

#pragma once

#include <span>

#include "nephele/modeling/cloud/cumulo.h"

/// The fields that the bakes of a layer sample.
namespace nephele::detail {

/// l_i to be baked at the voxels of the layer's own grid: l_{i-1} where the layer was not evaluated, read
/// from its cheap form, and the full sum elsewhere.
ScalarField grownLevel(const ScalarField& before, const ScalarField& level, const ScalarField& displacement);

/// The displacement of a layer for a bake that leaves out what cannot matter: its range is 0 where amplitudes
/// near by are too small for this layer and those after it to bring the sum to the surface. The displacement
/// itself where amplitudes do not vary, as nothing can be left out then. `asked` are the layers whose
/// amplitudes count, from that of the step on; those after them reach `further`. `voxelSize` is that of the
/// result.
ScalarField neededDisplacement(const CumuloStep& step, std::span<const CumuloLayer> asked, float further,
                               float voxelSize);

}  // namespace nephele::detail

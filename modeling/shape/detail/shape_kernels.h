#pragma once

#include "nephele/modeling/field/scratch.h"
#include "nephele/modeling/shape/detail/shape_kinds.h"

namespace nephele::detail {

/// Values at the points of a block, by the best instruction set of the machine; lanes up to the padded count.
void shapeLanes(const ShapeKind& kind, const PointBlock& points, float* values);
/// The same values bit for bit, with gradients.
void shapeGradLanes(const ShapeKind& kind, const PointBlock& points, float* values,
                    const BlockLanes<3>& grads);

}  // namespace nephele::detail

#pragma once

#include "nephele/levelset/grid/packed_grid.h"
#include "nephele/modeling/field/field_node.h"

/// Interpolation of a grid, packed or not, at a block of points: what `gridField` and everything else that
/// samples runs on.
///
/// All functions read up to `points.count` points and may write up to the padded count. Outside the table,
/// and at coordinates that are infinite or NaN, the value is that of pool brick 0, the background, and the
/// gradient is 0. Gradients are with respect to world coordinates, for rotated and sheared maps too. Shared
/// constants need no care. No allocation, but for the first packed grid of a thread, no locks, no exceptions.
/// Every function has a plain loop beside it that gives the same bits.
namespace nephele {

/// Trilinear values: 8 samples per point.
void sampleTrilinear(const GridView& grid, const PointBlock& points, float* values);

/// Trilinear values, and central differences of the trilinear field over one voxel to either side along the
/// grid's axes. These are the trilinear blends of the differences at the cell's corners: 32 samples of the
/// 4^3 around the point, all stored with its brick; one pass. Continuous.
void sampleTrilinearGrad(const GridView& grid, const PointBlock& points, float* values,
                         const BlockLanes<3>& grads);

/// Tricubic values (Catmull-Rom): 64 samples per point. Passes through the samples, reproduces quadratics,
/// has continuous first derivatives, and can overshoot the samples by up to 48 % of their spread.
void sampleTricubic(const GridView& grid, const PointBlock& points, float* values);

/// Tricubic values and their exact derivative from the same 64 samples: continuous, and at voxels equal to
/// the central difference over one voxel to either side.
void sampleTricubicGrad(const GridView& grid, const PointBlock& points, float* values,
                        const BlockLanes<3>& grads);

/// The value of the nearest sample: what tells cheaply about how large an interpolated value is. The
/// background where the nearest voxel lies outside the table.
void sampleNearest(const GridView& grid, const PointBlock& points, float* values);

/// The same as plain loops: the truth that the vector code is tested against, bit for bit.
void sampleTrilinearScalar(const GridView& grid, const PointBlock& points, float* values);
void sampleTrilinearGradScalar(const GridView& grid, const PointBlock& points, float* values,
                               const BlockLanes<3>& grads);
void sampleTricubicScalar(const GridView& grid, const PointBlock& points, float* values);
void sampleTricubicGradScalar(const GridView& grid, const PointBlock& points, float* values,
                              const BlockLanes<3>& grads);
void sampleNearestScalar(const GridView& grid, const PointBlock& points, float* values);

}  // namespace nephele

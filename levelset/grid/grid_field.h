#pragma once

#include <array>
#include <memory>
#include <optional>

#include "nephele/levelset/grid/packed_grid.h"
#include "nephele/modeling/base/progress.h"
#include "nephele/modeling/field/field.h"

namespace nephele {

enum class Interpolation { trilinear, tricubic };

/// A grid as a field: interpolated inside, `grid.background` outside.
///
/// Gradients are continuous: for trilinear values central differences of the interpolated field over one
/// voxel, for tricubic values the exact derivative. They are with respect to the world, whatever the map of
/// the grid. The range of a box comes from the bricks it touches; over boxes of more than 4 bricks per side
/// it is wider, at a bounded cost. Values per point: 8 samples (trilinear) or 64 (tricubic, Catmull-Rom).
/// @throws Error if the grid is null.
ScalarField gridField(std::shared_ptr<const BrickGrid> grid,
                      Interpolation interpolation = Interpolation::trilinear);
/// The same of a packed grid.
ScalarField gridField(std::shared_ptr<const PackedGrid> grid,
                      Interpolation interpolation = Interpolation::trilinear);

/// `field`, with ranges taken from the bricks of `grid` instead of its own: for a field whose values the grid
/// holds, near enough for what the ranges are used for. Keeps a copy of the grid's table and ranges, not of
/// its samples.
ScalarField withRangesOf(const BrickLayout& grid, const ScalarField& field);

using VectorGrids = std::array<std::shared_ptr<const BrickGrid>, 3>;

/// The same for vectors: one grid per component.
VectorField gridField(VectorGrids grids, Interpolation interpolation = Interpolation::trilinear);

/// The grid behind a field made by `gridField` or `bake`, or null for any other field, packed grids
/// among them.
std::shared_ptr<const BrickGrid> gridOf(const ScalarField& field);
/// The grids of the components, or three nulls.
VectorGrids gridsOf(const VectorField& field);

}  // namespace nephele

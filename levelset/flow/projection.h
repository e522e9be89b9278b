#pragma once

#include "nephele/levelset/grid/lattice.h"
#include "nephele/modeling/base/progress.h"
#include "nephele/modeling/field/field.h"

/// Making flows incompressible.
namespace nephele {

/// What a flow meets at the faces of a box.
enum class Walls {
  /// What leaves through a face enters through the one opposite.
  periodic,
  /// Nothing flows through the faces; along them it flows freely.
  closed,
};

/// A box of cells and the samples at their corners.
struct ProjectionBox {
  /// Sample (i, j, k) lies at indexToWorld(i, j, k), the first at (0, 0, 0). The box may be turned and its
  /// cells oblong, but their edges must be perpendicular to each other.
  Lattice lattice;
  /// Cells along each axis, 1 or more.
  Vec3i cells{1, 1, 1};
  Walls walls = Walls::periodic;
};

/// `velocity` without its divergent part: the flow without divergence that is nearest to it in the mean
/// square over the samples of the box.
///
///     u - s (s . u) / |s|^2   for each wave of the box,  s = sin(k h) / h along each axis
///
/// s being what central differences over one cell h see of a wave k, these are 0 at every sample but for
/// rounding, below 1e-5 of speed / cell; so is `div` of the result there, which takes the same differences.
/// Between samples it is of second order in the cell. The mean stays (closed boxes have none); waves of two
/// cells, which those differences cannot see, are dropped.
///
/// The result is trilinear on one grid per component (see gridsOf), which go one sample beyond the box so
/// that differences are right up to its faces; from there on it is 0.
/// Cost: the velocity once per sample, six transforms and three grids, on all cores; memory beside the result
/// is 12 bytes per sample and up to 192 per row. The same bits at any thread count.
/// @throws Error if the box has no cells or more than 2^31, its edges are not perpendicular, or the
/// velocity is not finite at a sample; Cancelled.
/// Source: Tessendorf, Resolution Independent Volumes, chapter 6 (tdivfree).
VectorField withoutDivergence(const VectorField& velocity, const ProjectionBox& box,
                              const Progress& progress = silent());

}  // namespace nephele

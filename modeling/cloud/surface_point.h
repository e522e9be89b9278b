#pragma once

#include <optional>

#include "nephele/modeling/field/field.h"

namespace nephele {

struct SurfacePointOptions {
  /// Most Newton steps per point, at least 0.
  int steps = 5;
  /// Edge of a voxel in world units, the unit of the tolerance. Default: the field's differenceStep().
  std::optional<float> voxel{};
  /// A point is done once |l| is below this share of a voxel.
  float toleranceVoxels = 0.005f;
  /// What to return where the gradient vanishes (|grad l|^2 < 1e-4) before the tolerance is met, such as the
  /// closest point of a mesh. Default: the best point found.
  std::optional<VectorField> fallback{};
};

/// The point of the zero surface of `l` that belongs to x, x itself where l(x) = 0.
///
/// Guarded Newton steps along the gradient g of l: s = -l g / max(|g|^2, 0.25), shortened to |s| <= 2 |l|.
/// Stops at |l| < tolerance and where |g|^2 < 1e-4; returns the visited point with the smallest |l|. For a
/// distance this is the closest point of the surface. Range: everything. Gradient: differences. Cost per
/// point: 1 to steps + 1 gradients of `l`; points that are done cost nothing.
/// @throws Error if steps < 0, voxel <= 0 or toleranceVoxels < 0.
/// Source: Tessendorf, Resolution Independent Volumes, equation 3.3; the guards replace its unit-length
/// assumption.
VectorField surfacePoint(const ScalarField& l, const SurfacePointOptions& options = {});

namespace detail {

/// l and its gradient at the points that a projection starts from, where they are known.
struct KnownStart {
  const float* values;
  BlockLanes<3> grads;
};

/// The block form of `surfacePoint`: writes the points to `y` and l there, signed, to `residual`. All four
/// lanes are results and must not overlap the points or `start`.
void projectToSurface(const FieldNode<float>& l, const PointBlock& points, const BlockLanes<3>& y,
                      float* residual, const SurfacePointOptions& options, Scratch& scratch,
                      const KnownStart* start = nullptr);

}  // namespace detail
}  // namespace nephele

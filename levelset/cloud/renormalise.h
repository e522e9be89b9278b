#pragma once

#include "nephele/levelset/grid/bake.h"
namespace nephele {

/// How far a distance must hold outside and inside the surface, world units.
struct DistanceBand {
  float exterior = 0.0f;
  float interior = 0.0f;
};

/// Distance to the zero surface of `level`, by fast sweeping on the grid `spec`: first order, fast.
/// @throws Error as `bake`; Cancelled.
ScalarField sweptDistance(const ScalarField& level, const BakeOptions& spec, const DistanceBand& band,
                          const Progress& progress = silent());

/// Distance to the mesh of the zero surface of `level` that marching cubes finds on the grid `spec`.
/// @throws Error as `bake`; Cancelled.
ScalarField rebuiltDistance(const ScalarField& level, const BakeOptions& spec, const DistanceBand& band,
                            const Progress& progress = silent());

}  // namespace nephele

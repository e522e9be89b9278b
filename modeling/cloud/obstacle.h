#pragma once

#include "nephele/modeling/field/field.h"

namespace nephele {

struct ObstacleOptions {
  /// Share of the speed into the obstacle that is turned back, 0 to 1: with 1 the flow is thrown back, with 0
  /// it sticks, and what is left of it runs along the surface.
  float retained = 1.0f;
};

/// `velocity` turned back where it flows into an obstacle.
///
///     u - (1 + retained) (u . n) n,  n = grad object / |grad object|,  where object > 0 and u . n > 0
///
/// `object` is positive inside, so that n points into it; it need not be a distance. Elsewhere, and where
/// `object` has no gradient, the velocity stays as it is. A projection afterwards lets the flow in again,
/// since what leaves an obstacle must have entered it: of a wind into a ball 82 % after the first, 62 % after
/// twenty in turn. So let a reflection be the last. Cost per point: the velocity, and `object` with its
/// gradient.
/// @throws Error unless `retained` is from 0 to 1.
/// Source: Tessendorf, Resolution Independent Volumes, equations 6.6 and 6.7.
VectorField reflected(const VectorField& velocity, const ScalarField& object,
                      const ObstacleOptions& options = {});

}  // namespace nephele

#pragma once

#include "nephele/modeling/noise/perlin_lattice.h"

/// Perlin noise on lanes of points. See noise.h for what it computes.
namespace nephele::detail {

/// The truth: the noise at one point, with its gradient by x, y, z if `gradient` is not null.
float perlinScalar(const PerlinLattice& lattice, const Vec3f& point, Vec3f* gradient);

/// The same for lanes, bit for bit; 64-byte aligned, `count` a multiple of 16.
void perlinLanes(const PerlinLattice& lattice, const float* const points[3], float* values, int count);
void perlinGradLanes(const PerlinLattice& lattice, const float* const points[3], float* values,
                     float* const grads[3], int count);

}  // namespace nephele::detail

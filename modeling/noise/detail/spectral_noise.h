#pragma once

#include <vector>

#include "nephele/modeling/noise/detail/noise_kernels.h"

/// Gaussian random fields with a given spectrum, synthesised on a periodic grid. See noise.h.
namespace nephele::detail {

struct Spectrum {
  float exponent;         ///< Density of the variance falls as wave number^-exponent.
  float lowest, highest;  ///< Wave numbers, cycles per lattice unit.
  float tile;             ///< Period, lattice units.
  int resolution;         ///< Nodes per period, a power of two.
};

/// Coefficients of a cubic B-spline that repeats in all axes.
struct SpectralTile {
  int resolution = 0;
  float nodesPerUnit = 0;
  /// x fastest; each row goes on with its first 3 numbers, so that 4 in a row can be read anywhere.
  std::vector<float> coefficients;
  float low = 0, high = 0;  ///< Bounds of the spline: those of its coefficients.
  float steepest = 0;       ///< No gradient is longer, lattice units.
  float gradientRms = 0;    ///< Of one component, lattice units.

  int rowLength() const { return resolution + 3; }
};

/// The tile of a seed and time (`period` 0: does not repeat in time): mean 0 and rms 1, as a spline. The same
/// numbers at any thread count; across machines equal to rounding. Cost: one FFT; 9 bytes per node for a
/// moment.
SpectralTile synthesise(const Spectrum& spectrum, std::uint32_t seed, float time, float period);

/// The truth: the spline at one point, with its gradient by x, y, z if `gradient` is not null.
float spectralScalar(const SpectralTile& tile, const PerlinLattice& lattice, const Vec3f& point,
                     Vec3f* gradient);

/// The same for lanes, bit for bit; 64-byte aligned, `count` a multiple of 16. `grads` may be null.
void spectralLanes(const SpectralTile& tile, const PerlinLattice& lattice, const float* const points[3],
                   float* values, float* const* grads, int count);

}  // namespace nephele::detail

#pragma once

#include <cstdint>
#include <optional>

#include "nephele/modeling/field/field.h"

/// Noise: random smooth scalar fields of mean 0 and root mean square 1.
namespace nephele {

/// No value of |perlin| is above this: the largest raw value that any choice of gradients allows, over the
/// rms.
inline constexpr float kPerlinBound = 3.8385f;

struct PerlinOptions {
  /// Lattice cells per world unit, > 0. Features are about 1 / frequency wide.
  float frequency = 1.0f;
  /// Another seed is another noise; also draws the default offset and rotation of the lattice.
  std::uint32_t seed = 0;
  /// Added to lattice coordinates. Default: drawn from the seed, within [0, 1) per axis.
  std::optional<Vec3f> offset{};
  /// Turns the lattice. Default: drawn from the seed, so that no two noises share their zeros.
  std::optional<Mat3f> rotation{};
};

/// Improved Perlin noise at q = rotation (x frequency) + offset, divided by its rms.
///
/// Twice continuously differentiable, exactly 0 on the lattice, with an exact gradient. Lattice coordinates
/// hold up to 2^24 cells from the origin; where x is not finite the value is 0. Ranges of boxes smaller than
/// a cell are tight. Cost: a few nanoseconds per point in blocks.
/// @throws Error unless frequency > 0 and finite, offset is finite and rotation is orthogonal within 1e-3.
/// Source: K. Perlin, Improving Noise (2002).
ScalarField perlin(const PerlinOptions& options = {});

struct FractalSumOptions {
  /// Number of terms, 1 to 32.
  int octaves = 4;
  /// Frequency of the first term, cells per world unit, > 0.
  float frequency = 1.0f;
  /// Ratio of frequencies of successive terms, > 0.
  float lacunarity = 2.0f;
  /// Ratio of amplitudes of successive terms, >= 0.
  float roughness = 0.5f;
  std::uint32_t seed = 0;
};

/// sum_i roughness^i P_i(x frequency lacunarity^i) / sqrt(sum_i roughness^(2 i)) of Perlin noises with one
/// seed each. Independent terms add their squares, hence unit rms. @throws Error for options outside their
/// range. Source: Tessendorf, Resolution Independent Volumes, equation 3.6.
ScalarField fractalSum(const FractalSumOptions& options = {});

/// The same of any noise of frequency 1. Each term reads it turned and moved by the seed, so that the terms
/// are uncorrelated; the sum has unit rms if `noise` has.
ScalarField fractalSum(const ScalarField& noise, const FractalSumOptions& options);

}  // namespace nephele

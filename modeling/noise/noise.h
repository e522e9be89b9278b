#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "nephele/modeling/field/field.h"

/// Noises: random fields of every kind, still or moving.
///
/// Rules for all kinds: mean 0 and root mean square 1 over space, at every time; bounds that every value
/// keeps; exact gradients; coordinates that are not finite read as 0. docs/noises.md shows and compares them.
namespace nephele {

/// Kinds of noise, in the order of `noiseKinds`. Bounds in brackets, of the still and of the moving noise
/// where they differ.
enum class NoiseKind {
  /// Gradients on a cubic lattice; soft bumps of one size. Still, it is `perlin`. [3.84; 5.43]
  perlin,
  /// Gradients on a lattice of tetrahedra; like Perlin's with smaller bumps and less of the lattice to see.
  /// [2.55; 3.61]
  simplex,
  /// Distance F1 to the nearest of randomly spread points, one per cell, less its mean: cells with creases
  /// between them, lowest in the middle. Its gradient jumps at creases. [-3.02 to 5.69]
  worley,
  /// Distance to the second nearest point less that to the nearest, F2 - F1, less its mean: walls between
  /// cells, lowest on the wall. Its gradient jumps. [-1.25 to 8.25]
  worleyDifference,
  /// Numbers on a cubic lattice, blended; blobs of uneven size. [2.5; 3.54]
  value,
  /// Sparse convolution: randomly spread short waves of one cycle per cell in all directions; ripples of one
  /// size. Values beyond 6, about 8 of 10^7, are cut to 6. [6]
  gabor,
  /// A Gaussian random field with a power spectrum, from an FFT, periodic; see SpectrumOptions. Its bound is
  /// that of the tile, about 5.
  spectral,
};

/// Every kind.
std::span<const NoiseKind> noiseKinds();
/// The name in options and files: "perlin", "simplex", "worley", "worley_difference", "value", "gabor",
/// "fft".
std::string_view noiseName(NoiseKind kind);
/// All names, separated by commas, for messages.
std::string noiseNames();
/// The kind called `name`. @throws Error with all names if there is none.
NoiseKind noiseKindOf(std::string_view name);

/// The spectrum of NoiseKind::spectral: the density of the variance over wave vectors k is |k|^-exponent for
/// lowest <= |k| <= highest, and 0 elsewhere. Wave numbers are multiples of the noise's frequency.
struct SpectrumOptions {
  /// 11/3 is that of turbulence (Kolmogorov); 0 is white within its limits. From -16 to 16.
  float exponent = 11.0f / 3;
  float lowest = 0.5f;
  float highest = 4.0f;
  /// Length after which the field repeats, in 1 / frequency. At least one wave within the limits must fit.
  float tile = 8.0f;
  /// Nodes along the tile, a power of two from 16 to 512, at least four per shortest wave:
  /// resolution >= 4 highest tile. Memory: 4 bytes for each of its cube.
  int resolution = 128;
};

/// Where the lattice of a noise stands; the options of `perlin`.
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

/// What noises of every kind have in common; members as in PerlinOptions.
struct NoiseOptions {
  NoiseKind kind = NoiseKind::perlin;
  float frequency = 1.0f;
  std::uint32_t seed = 0;
  std::optional<Vec3f> offset{};
  std::optional<Mat3f> rotation{};
  /// The noise at this time: continuous in time, different after about one unit of it. Default: the noise
  /// that stands still, which is that of time 0 and costs less.
  std::optional<float> time{};
  /// The noise is the same again after this time, > 0; much below 4 makes it faster. Default: it never is.
  std::optional<float> period{};
  /// Of NoiseKind::spectral only.
  SpectrumOptions spectrum{};
};

/// No value of |perlin| is above this: the largest raw value that any choice of gradients allows, over the
/// rms.
inline constexpr float kPerlinBound = 3.8385f;

/// Improved Perlin noise at q = rotation (x frequency) + offset, divided by its rms.
///
/// Twice continuously differentiable, exactly 0 on the lattice, with an exact gradient. Lattice coordinates
/// hold up to 2^24 cells from the origin. Ranges of boxes smaller than a cell are tight. Cost: a few
/// nanoseconds per point in blocks.
/// @throws Error unless frequency > 0 and finite, offset is finite and rotation is orthogonal within 1e-3.
/// Source: K. Perlin, Improving Noise (2002).
ScalarField perlin(const PerlinOptions& options = {});

/// The noise of any kind at q = rotation (x frequency) + offset. Ranges of boxes much smaller than a cell are
/// tight. Cost per point, in blocks: nanoseconds for perlin, simplex and value, tens of them for the others.
/// The spectral noise is synthesised by this call, some 0.1 s at 128^3.
/// @throws Error as `perlin`, and for other options outside their range or a kind that does not exist.
ScalarField noise(const NoiseOptions& options = {});

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
/// The same of any kind: terms of `options.frequency` lacunarity^i, with seeds that follow from
/// `octaves.seed` and `options.seed`; `octaves.frequency` multiplies the frequency. Offset and rotation hold
/// for each term, if given; so does the time. Terms of Perlin noise at rest are those of
/// `fractalSum(octaves)`.
ScalarField fractalSum(const NoiseOptions& options, const FractalSumOptions& octaves);

/// Three independent noises as the components of a vector.
/// Source: Tessendorf, Resolution Independent Volumes, equation 3.9, with seeds in place of shifts.
VectorField vectorNoise(const NoiseOptions& options = {});

/// A velocity without divergence: the curl of a vector of three independent noises, made of their exact
/// gradients, divided so that each component has rms 1 (a few percent off for `spectral`, whose tile is one
/// sample). Derivatives of the velocity itself are differences. Worley noises are refused: their gradients
/// jump. Source: R. Bridson and others, Curl-Noise for Procedural Fluid Flow (2007).
VectorField curlNoise(const NoiseOptions& options = {});

}  // namespace nephele

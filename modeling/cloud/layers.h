#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "nephele/modeling/noise/varying_noise.h"

/// The layers of cumulo: see modeling/cloud/cumulo.h for what they do.
namespace nephele {

/// One layer of displacement.
struct CumuloLayer {
  /// Already in its frequency, unit rms, with a finite range. Its absolute value displaces.
  ScalarField noise{0.0f};
  /// Rms of the displacement, world units, >= 0.
  ScalarField amplitude{0.0f};
  /// Exponent of the clearing of valleys, >= 0; 0 clears nothing. Without effect in the first layer.
  ScalarField billow{0.0f};
  /// The layer is full where the layer before displaces by at least this many of its amplitudes; > 0.
  ScalarField billowScale{1.0f};
  /// Highest frequency of `noise`, cycles per world unit, > 0. Tells a bake how finely to sample.
  float frequency = 1.0f;
  /// How many times finer than Perlin noise of that frequency `noise` must be sampled, > 0.
  float detail = 1.0f;
  /// The largest slope of `noise`, per world unit; steeper places are taken for jumps and smoothed. Empty:
  /// 3.2 times bound times frequency, which is that of Perlin noise.
  std::optional<float> steepest{};
};

/// What a layer displaces by.
struct CumuloNoise {
  /// Kind, seed, spectrum, time and period; its frequency is without effect.
  NoiseOptions noise{};
  /// Cycles per world unit, > 0.
  ScalarField frequency{4.4f};
  /// Terms of a fractal sum, 1 to 32: each `octaveLacunarity` times as fine and `octaveRoughness` times as
  /// high as the one before, of unit rms in all.
  int octaves = 1;
  float octaveLacunarity = 2.0f;
  float octaveRoughness = 0.5f;
};

/// A layer of any noise, all but its heights: the caller sets amplitude, billow and billowScale.
///
/// Where the frequency varies, `noiseOfFrequency` follows it. A layer displaces by |noise|, of unit rms:
/// valleys where a noise of mean 0 changes its sign. Of Worley noises it displaces by what is never negative:
/// `worleyDifference` plus its mean, 0 on the walls between cells; and for `worley` by
/// max(0, 1 - (F1 / 0.75)^2), F1 the distance to the nearest point in cells: round bumps over the points with
/// creases between them, 0 on a tenth of space. Sums and blends of Worley noises are put into the same
/// formula.
/// @throws Error as `noise`, `noiseOfFrequency` and `fractalSum`.
CumuloLayer cumuloLayer(const CumuloNoise& noise);

/// Layers in fractal form: amplitude a_i = amplitude roughness^i, frequency f_i = frequency lacunarity^i.
struct CumuloFractal {
  int layers = 4;
  /// What all layers share: kind, spectrum, time and period. Each layer has its own frequency and seed.
  NoiseOptions noise{};
  ScalarField amplitude{0.025f};  ///< World units, rms, of the first layer.
  ScalarField frequency{4.4f};    ///< Cycles per world unit of the first layer.
  ScalarField lacunarity{2.1f};
  ScalarField roughness{0.55f};
  ScalarField billow{1.0f};
  ScalarField billowScale{1.0f};
  std::uint32_t seed = 0;
};

inline constexpr int kMaxCumuloLayers = 16;

/// The seed of the noise of layer `index` (from 0) where that of the whole is `seed`: so that a layer keeps
/// its noise when others change.
std::uint32_t cumuloLayerSeed(std::uint32_t seed, int index);

/// Layers for `cumulo`, of one kind of noise; see `cumuloLayer`. Each layer's noise has its own seed, turn
/// and offset: Perlin noise is 0 on its integer lattice, and layers that shared those zeros would all be
/// still at the same places. Parameters that vary are read at the surface point, as the noise is.
/// @throws Error if layers is outside 1 .. kMaxCumuloLayers, if frequency, lacunarity or billowScale is not >
/// 0, if amplitude, roughness or billow can be negative, or if one of these has no finite range.
std::vector<CumuloLayer> cumuloLayers(const CumuloFractal& fractal);

/// Largest displacement that `layers[first]` and those after it can add, world units: the sum of amplitude
/// times bound of the noise. The band in which the base must be a distance follows from it.
/// @throws Error if an amplitude or a noise has no finite range.
float displacementBound(const std::vector<CumuloLayer>& layers, std::size_t first = 0);

namespace detail {

/// Largest displacement of `layers[index]`. @throws Error as above.
float layerBound(const std::vector<CumuloLayer>& layers, std::size_t index);

/// @throws Error if a number or field of a layer is outside its range, naming both.
void requireSane(const std::vector<CumuloLayer>& layers);

}  // namespace detail

}  // namespace nephele

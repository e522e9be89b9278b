// What a layer displaces by, and layers in fractal form.
//
// Noises differ in how finely they must be sampled and in how steep they are, which tells a jump over the
// medial axis from a slope. Perlin noise is the measure for both. Worley noises are put into a form that is
// never negative, since valleys belong between their cells and not where they cross their mean.
//
// Source: Tessendorf, Resolution Independent Volumes, 3.2 and equation 3.7.
#include "nephele/modeling/cloud/layers.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <utility>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/noise/lattice_noise.h"
#include "nephele/modeling/noise/noise_draw.h"

namespace nephele {

namespace {

float largest(const ScalarField& field, const char* what, std::size_t layer) {
  const float bound = field.range(Box::everywhere()).magnitude();
  require(std::isfinite(bound), "cumulo: the " + std::string(what) + " of layer " +
                                    std::to_string(layer + 1) + " has no finite range");
  return bound;
}

/// @throws Error unless `range` is finite and not negative. Ranges are rounded outward, so that one that
/// begins at 0 may begin just below.
void requireNotNegative(const Interval& range, const std::string& name) {
  constexpr float kRounding = 1e-5f;
  require(std::isfinite(range.max) && range.min >= -kRounding * range.max,
          name + " must be >= 0, got " + numberText(std::isfinite(range.max) ? range.min : range.max));
}

void requireSaneLayer(const std::vector<CumuloLayer>& layers, std::size_t index) {
  const CumuloLayer& layer = layers[index];
  static_cast<void>(detail::layerBound(layers, index));
  const std::string name = "cumulo: layer " + std::to_string(index + 1) + ": ";
  const Interval scale = layer.billowScale.range(Box::everywhere());
  require(scale.min > 0 && std::isfinite(scale.max),
          name + "billowScale must be > 0, got " + numberText(scale.min > 0 ? scale.max : scale.min));
  require(layer.frequency > 0 && std::isfinite(layer.frequency),
          name + "frequency must be > 0, got " + numberText(layer.frequency));
  require(layer.detail > 0 && std::isfinite(layer.detail),
          name + "detail must be > 0, got " + numberText(layer.detail));
  require(!layer.steepest || (*layer.steepest > 0 && std::isfinite(*layer.steepest)),
          name + "steepest must be > 0, got " + numberText(layer.steepest.value_or(0)));
  requireNotNegative(layer.amplitude.range(Box::everywhere()), name + "amplitude");
  requireNotNegative(layer.billow.range(Box::everywhere()), name + "billow");
}

/// Of kinds of noise, in rms and lattice units.
struct KindFacts {
  /// Slopes are no larger, or only at places that are as rare as jumps are.
  float steepest;
  /// Samples per cell that the noise needs, in those that Perlin noise needs.
  float detail;
};

/// F1 at which bumps of Worley noise end, cells, and the rms of the bumps over space, measured.
constexpr float kWorleyBumpRadius = 0.75f;
constexpr float kWorleyBumpRms = 0.5612f;
/// Slopes along an axis that are as rare as jumps, in their rms.
constexpr float kRareSlope = 6.0f;

/// Rms slope along an axis: 2 pi / sqrt(3) times the rms wave number of the spectrum.
float spectralSlope(const SpectrumOptions& spectrum) {
  constexpr int kSteps = 256;
  double weight = 0, squares = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double k =
        spectrum.lowest * std::pow(double(spectrum.highest) / spectrum.lowest, (i + 0.5) / kSteps);
    const double share = std::pow(k, 3 - double(spectrum.exponent));
    weight += share;
    squares += share * k * k;
  }
  return float(2 * 3.14159265358979 / std::sqrt(3.0) * std::sqrt(squares / weight));
}

KindFacts factsOf(const NoiseOptions& noise) {
  const auto facts = [&](detail::LatticeKind kind) {
    return detail::latticeFacts(kind, noise.time.has_value());
  };
  switch (noise.kind) {
    case NoiseKind::simplex:
      return {facts(detail::LatticeKind::simplex).steepest, 1.5f};
    case NoiseKind::worley:
      // The slope of the bump where it ends: 2 F1 / R^2 at F1 = R.
      return {2 / (kWorleyBumpRadius * kWorleyBumpRms), 1.5f};
    case NoiseKind::worleyDifference:
      return {2 / std::hypot(detail::kWorleyDifferenceMean, detail::kWorleyDifferenceRms), 1.5f};
    case NoiseKind::value:
      return {facts(detail::LatticeKind::value).steepest, 1};
    case NoiseKind::gabor:
      return {kRareSlope * facts(detail::LatticeKind::gabor).gradientRms, 1.5f};
    case NoiseKind::spectral: {
      // Eight samples per shortest wave, where Perlin noise has sixteen per cell.
      const float detail = std::max(1.0f, noise.spectrum.highest / 2);
      return {kRareSlope * spectralSlope(noise.spectrum), detail};
    }
    case NoiseKind::perlin:
      break;
  }
  return {facts(detail::LatticeKind::perlin).steepest, 1};
}

/// What stands in a layer for a noise of mean 0, so that its absolute value displaces.
ScalarField displacing(NoiseKind kind, const ScalarField& noise) {
  if (kind == NoiseKind::worley) {
    const ScalarField f1 = (noise * detail::kWorleyRms + detail::kWorleyMean) / kWorleyBumpRadius;
    return max(1.0f - square(f1), 0.0f) / kWorleyBumpRms;
  }
  if (kind == NoiseKind::worleyDifference) {
    const float mean = detail::kWorleyDifferenceMean, rms = detail::kWorleyDifferenceRms;
    return (noise * rms + mean) / std::hypot(mean, rms);
  }
  return noise;
}

/// `field`, as a constant where its range says that it is one: products of constants then stay constants,
/// while products of ranges are rounded outward. Others are evaluated once for all places that they take in
/// layers.
ScalarField settled(const ScalarField& field) {
  const Interval range = field.range(Box::everywhere());
  return range.isPoint() ? ScalarField(range.min) : memo(field);
}

void requirePositive(const ScalarField& field, const char* what) {
  const Interval range = field.range(Box::everywhere());
  require(range.min > 0 && std::isfinite(range.max), "cumuloLayers: " + std::string(what) +
                                                         " must be > 0, got " +
                                                         numberText(range.min > 0 ? range.max : range.min));
}

}  // namespace

CumuloLayer cumuloLayer(const CumuloNoise& options) {
  requirePositive(options.frequency, "frequency");
  const ScalarField frequency = settled(options.frequency);
  NoiseOptions term = options.noise;
  const KindFacts facts = factsOf(term);
  CumuloLayer layer{.frequency = frequency.range(Box::everywhere()).max, .detail = facts.detail};
  float slope = 1;
  if (options.octaves == 1) {
    layer.noise = noiseOfFrequency(term, frequency);
  } else {
    detail::Draw draw(options.noise.seed);
    const FractalSumOptions octaves{.octaves = options.octaves,
                                    .frequency = 1,
                                    .lacunarity = options.octaveLacunarity,
                                    .roughness = options.octaveRoughness};
    layer.noise = detail::sumOctaves(octaves, [&](float rate) {
      term.seed = draw.bits();
      return noiseOfFrequency(term, frequency * rate);
    });
    double squares = 0, slopes = 0;
    for (int i = 0; i < options.octaves; ++i) {
      const double height = std::pow(double(options.octaveRoughness), i);
      const double rate = std::pow(double(options.octaveLacunarity), i);
      squares += height * height;
      slopes += height * height * rate * rate;
      // The error of interpolation falls with the third power of the rate of samples.
      layer.detail = std::max(layer.detail, facts.detail * float(rate * std::cbrt(height)));
    }
    slope = float(std::sqrt(slopes / squares));
  }
  layer.noise = displacing(term.kind, layer.noise);
  if (term.kind != NoiseKind::perlin || options.octaves != 1)
    layer.steepest = facts.steepest * layer.frequency * slope;
  return layer;
}

std::uint32_t cumuloLayerSeed(std::uint32_t seed, int index) {
  std::mt19937 seeds(seed);
  seeds.discard(static_cast<unsigned long long>(index));
  return static_cast<std::uint32_t>(seeds());
}

std::vector<CumuloLayer> cumuloLayers(const CumuloFractal& fractal) {
  require(fractal.layers >= 1 && fractal.layers <= kMaxCumuloLayers,
          "cumuloLayers: layers must be 1 to " + std::to_string(kMaxCumuloLayers) + ", got " +
              std::to_string(fractal.layers));
  requirePositive(fractal.frequency, "frequency");
  requirePositive(fractal.lacunarity, "lacunarity");
  std::vector<CumuloLayer> layers;
  CumuloNoise noise{.noise = fractal.noise, .frequency = settled(fractal.frequency)};
  ScalarField amplitude = settled(fractal.amplitude);
  const ScalarField roughness = settled(fractal.roughness), lacunarity = settled(fractal.lacunarity);
  const ScalarField billow = settled(fractal.billow), billowScale = settled(fractal.billowScale);
  for (int i = 0; i < fractal.layers; ++i) {
    noise.noise.seed = cumuloLayerSeed(fractal.seed, i);
    CumuloLayer layer = cumuloLayer(noise);
    layer.amplitude = amplitude;
    layer.billow = billow;
    layer.billowScale = billowScale;
    layers.push_back(std::move(layer));
    amplitude = settled(amplitude * roughness);
    noise.frequency = noise.frequency * lacunarity;
  }
  detail::requireSane(layers);
  return layers;
}

float displacementBound(const std::vector<CumuloLayer>& layers, std::size_t first) {
  float sum = 0;
  for (std::size_t i = first; i < layers.size(); ++i) sum += detail::layerBound(layers, i);
  return sum;
}

namespace detail {

float layerBound(const std::vector<CumuloLayer>& layers, std::size_t index) {
  return largest(layers[index].amplitude, "amplitude", index) * largest(layers[index].noise, "noise", index);
}

void requireSane(const std::vector<CumuloLayer>& layers) {
  for (std::size_t i = 0; i < layers.size(); ++i) requireSaneLayer(layers, i);
}

}  // namespace detail

}  // namespace nephele

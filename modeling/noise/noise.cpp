// Noises of all kinds as fields. The kernels are in lattice_noise.cpp, cell_noise.cpp and
// spectral_noise_kernels.cpp; Perlin noise at rest is that of perlin.cpp.
//
// Range of a box: the bound of the noise, or for small boxes the value in the middle plus or minus the
// steepest gradient times the distance to a corner, whichever is tighter. A spline also lies between the
// least and the largest of the coefficients around the box.
#include "nephele/modeling/noise/noise.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <memory>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/noise/detail/spectral_noise.h"
#include "nephele/modeling/noise/lattice_noise.h"
#include "nephele/modeling/noise/noise_draw.h"

namespace nephele {
namespace {

using detail::LatticeKind;

/// A kind, its name, and the noise of a lattice that makes it; spectral noise is made otherwise.
struct KindRow {
  NoiseKind kind;
  std::string_view name;
  LatticeKind lattice = LatticeKind::perlin;
};

constexpr std::array<KindRow, 7> kKindRows{
    {{NoiseKind::perlin, "perlin", LatticeKind::perlin},
     {NoiseKind::simplex, "simplex", LatticeKind::simplex},
     {NoiseKind::worley, "worley", LatticeKind::worley},
     {NoiseKind::worleyDifference, "worley_difference", LatticeKind::worleyDifference},
     {NoiseKind::value, "value", LatticeKind::value},
     {NoiseKind::gabor, "gabor", LatticeKind::gabor},
     {NoiseKind::spectral, "fft"}}};

constexpr auto kKinds = [] {
  std::array<NoiseKind, kKindRows.size()> kinds{};
  for (std::size_t i = 0; i < kinds.size(); ++i) kinds[i] = kKindRows[i].kind;
  return kinds;
}();

const KindRow& rowOf(NoiseKind kind) {
  for (const KindRow& row : kKindRows)
    if (row.kind == kind) return row;
  throw Error("noise: unknown kind, number " + std::to_string(int(kind)));
}

/// How far a point within `box` may be from its middle in lattice coordinates, rounding included: lattice
/// coordinates far from the origin are coarse.
float latticeRadius(const Box& box, float frequency, const Vec3f& offset) {
  const float stretch = frequency * (1 + detail::kNotOrthogonal);
  const float reach = stretch * (length(box.center()) + length(box.size())) + length(offset);
  return stretch * 0.5f * length(box.size()) + 1e-6f * reach;
}

/// What lies within `steepest` times `radius` of a value, and within the bounds.
Interval around(float value, float change, const Interval& bounds) {
  return {std::max(value - change, bounds.min), std::min(value + change, bounds.max)};
}

class LatticeNode final : public FieldNode<float> {
 public:
  LatticeNode(const detail::LatticeNoise& noise, float frequency)
      : noise_(noise), facts_(detail::latticeFacts(noise.kind, noise.moves)), frequency_(frequency) {}

  void eval(const PointBlock& points, const BlockLanes<1>& values, Scratch&) const override {
    const float* const xyz[3] = {points.x, points.y, points.z};
    detail::latticeNoiseLanes(noise_, xyz, values[0], nullptr, points.paddedCount());
  }
  void evalGrad(const PointBlock& points, const BlockLanes<1>& values, const BlockLanes<3>& grads,
                Scratch&) const override {
    const float* const xyz[3] = {points.x, points.y, points.z};
    detail::latticeNoiseLanes(noise_, xyz, values[0], grads.data(), points.paddedCount());
  }
  Interval range(const Box& box, RangeMemo&) const override {
    const Interval bounds{facts_.low, facts_.high};
    const float radius = latticeRadius(box, frequency_, noise_.lattice.offset);
    const float change = facts_.steepest * radius * 1.0001f + 1e-4f;
    if (!(change < bounds.max - bounds.min)) return bounds;
    return around(detail::latticeNoiseScalar(noise_, box.center(), nullptr), change, bounds);
  }
  float differenceStep() const override { return 1e-2f / frequency_; }

 private:
  detail::LatticeNoise noise_;
  detail::LatticeFacts facts_;
  float frequency_;
};

class SpectralNode final : public FieldNode<float> {
 public:
  SpectralNode(detail::SpectralTile tile, const detail::PerlinLattice& lattice, float frequency)
      : tile_(std::move(tile)), lattice_(lattice), frequency_(frequency) {}

  void eval(const PointBlock& points, const BlockLanes<1>& values, Scratch&) const override {
    const float* const xyz[3] = {points.x, points.y, points.z};
    detail::spectralLanes(tile_, lattice_, xyz, values[0], nullptr, points.paddedCount());
  }
  void evalGrad(const PointBlock& points, const BlockLanes<1>& values, const BlockLanes<3>& grads,
                Scratch&) const override {
    const float* const xyz[3] = {points.x, points.y, points.z};
    detail::spectralLanes(tile_, lattice_, xyz, values[0], grads.data(), points.paddedCount());
  }
  Interval range(const Box& box, RangeMemo&) const override {
    const Interval bounds{tile_.low, tile_.high};
    const float radius = latticeRadius(box, frequency_, lattice_.offset);
    const float change = tile_.steepest * radius * 1.0001f + 1e-4f;
    if (!(change < bounds.max - bounds.min)) return bounds;
    const Interval near =
        around(detail::spectralScalar(tile_, lattice_, box.center(), nullptr), change, bounds);
    const float nodes = radius * tile_.nodesPerUnit;
    if (!(nodes < kMostNodes)) return near;
    const Interval hull = coefficientsNear(box.center(), nodes);
    return {std::max(near.min, hull.min), std::min(near.max, hull.max)};
  }
  float differenceStep() const override { return 0.05f / (tile_.nodesPerUnit * frequency_); }

 private:
  /// Boxes that reach farther from their middle would cost more than they save.
  static constexpr float kMostNodes = 4;

  /// The range of all coefficients that points within `nodes` of `center` read.
  Interval coefficientsNear(const Vec3f& center, float nodes) const {
    const Vec3f q = (lattice_.toLattice * center + lattice_.offset) * tile_.nodesPerUnit;
    if (!(length(q) < 1e6f)) return {tile_.low, tile_.high};
    int first[3], last[3];
    for (int a = 0; a < 3; ++a) {
      first[a] = int(std::floor(q[a] - nodes)) - 1;
      last[a] = int(std::floor(q[a] + nodes)) + 2;
    }
    const int mask = tile_.resolution - 1;
    float low = tile_.high, high = tile_.low;
    for (int z = first[2]; z <= last[2]; ++z)
      for (int y = first[1]; y <= last[1]; ++y) {
        const std::size_t row = std::size_t(z & mask) * std::size_t(tile_.resolution) + std::size_t(y & mask);
        const float* const c = tile_.coefficients.data() + row * std::size_t(tile_.rowLength());
        for (int x = first[0]; x <= last[0]; ++x) {
          low = std::min(low, c[x & mask]);
          high = std::max(high, c[x & mask]);
        }
      }
    return {low - 1e-5f, high + 1e-5f};
  }

  detail::SpectralTile tile_;
  detail::PerlinLattice lattice_;
  float frequency_;
};

/// A noise and what curl noise must know of it, per world unit.
struct Made {
  NodePtr<float> node;
  float steepest = 0, gradientRms = 0;
};

/// Each potential times its scale: v = curl(s_0 n_0, s_1 n_1, s_2 n_2).
class CurlNode final : public FieldNode<Vec3f> {
 public:
  explicit CurlNode(std::array<Made, 3> potentials) : potentials_(std::move(potentials)) {
    // Two independent slopes add in each component.
    for (int i = 0; i < 3; ++i) scales_[i] = 1 / (std::sqrt(2.0f) * potentials_[i].gradientRms);
  }

  void eval(const PointBlock& points, const BlockLanes<3>& values, Scratch& scratch) const override {
    Scratch::Frame frame(scratch);
    const BlockLanes<1> unused = frame.lanes<1>();
    BlockLanes<3> g[3];
    for (int i = 0; i < 3; ++i) {
      g[i] = frame.lanes<3>();
      potentials_[i].node->evalGrad(points, unused, g[i], scratch);
    }
    for (int c = 0; c < 3; ++c) {
      const int a = (c + 1) % 3, b = (c + 2) % 3;
      const float *const rise = g[b][a], *const fall = g[a][b];
      for (int i = 0; i < points.paddedCount(); ++i)
        values[c][i] = scales_[b] * rise[i] - scales_[a] * fall[i];
    }
  }
  RangeOf<Vec3f> range(const Box&, RangeMemo&) const override {
    RangeOf<Vec3f> result;
    for (int c = 0; c < 3; ++c) {
      float most = 0;
      for (const int i : {(c + 1) % 3, (c + 2) % 3}) most += scales_[i] * potentials_[i].steepest * 1.0001f;
      result[c] = {-most, most};
    }
    return result;
  }
  float differenceStep() const override { return potentials_[0].node->differenceStep(); }

 private:
  std::array<Made, 3> potentials_;
  float scales_[3];
};

void requireSpectrum(const SpectrumOptions& o) {
  require(o.exponent >= -16 && o.exponent <= 16,
          "noise: spectrum exponent must be from -16 to 16, got " + numberText(o.exponent));
  require(o.tile > 0 && std::isfinite(o.tile),
          "noise: spectrum tile must be > 0 and finite, got " + numberText(o.tile));
  require(o.lowest > 0 && std::isfinite(o.lowest),
          "noise: spectrum lowest must be > 0 and finite, got " + numberText(o.lowest));
  require(o.highest >= o.lowest && std::isfinite(o.highest),
          "noise: spectrum highest must be at least lowest, " + numberText(o.lowest) + ", and finite, got " +
              numberText(o.highest));
  require(o.resolution >= 16 && o.resolution <= 512 && std::has_single_bit(unsigned(o.resolution)),
          "noise: spectrum resolution must be a power of two from 16 to 512, got " +
              std::to_string(o.resolution));
  require(4 * double(o.highest) * o.tile <= o.resolution,
          "noise: spectrum resolution must be at least 4 highest tile, " +
              numberText(4 * o.highest * o.tile) + ", got " + std::to_string(o.resolution));
  require(std::floor(double(o.highest) * o.tile * (1 + 1e-6)) >=
              std::max(1.0, double(o.lowest) * o.tile * (1 - 1e-6)),
          "noise: no wave between spectrum lowest, " + numberText(o.lowest) + ", and highest, " +
              numberText(o.highest) + ", fits the tile of " + numberText(o.tile));
}

Made make(const NoiseOptions& o) {
  const LatticeKind latticeKind = rowOf(o.kind).lattice;
  const float time = o.time.value_or(0.0f), period = o.period.value_or(0.0f);
  require(std::isfinite(time), "noise: time must be finite, got " + numberText(time));
  require(!o.period || (period > 0 && std::isfinite(period)),
          "noise: period must be > 0 and finite, got " + numberText(period));
  const PerlinOptions placing{
      .frequency = o.frequency, .seed = o.seed, .offset = o.offset, .rotation = o.rotation};
  const detail::PerlinLattice lattice = detail::drawnLattice(placing, "noise");
  const float stretch = o.frequency * (1 + detail::kNotOrthogonal);
  if (o.kind == NoiseKind::spectral) {
    requireSpectrum(o.spectrum);
    const SpectrumOptions& s = o.spectrum;
    detail::SpectralTile tile = detail::synthesise({s.exponent, s.lowest, s.highest, s.tile, s.resolution},
                                                   lattice.seed, time, period);
    const float steepest = tile.steepest * stretch, gradientRms = tile.gradientRms * o.frequency;
    return {std::make_shared<SpectralNode>(std::move(tile), lattice, o.frequency), steepest, gradientRms};
  }
  detail::LatticeNoise noise{.kind = latticeKind, .lattice = lattice, .moves = o.time.has_value()};
  if (noise.moves) noise.clock = detail::noiseClock(time, period);
  const detail::LatticeFacts facts = detail::latticeFacts(noise.kind, noise.moves);
  Made made{nullptr, facts.steepest * stretch, facts.gradientRms * o.frequency};
  if (o.kind == NoiseKind::perlin && !noise.moves) {
    made.node = perlin(placing).node();
  } else {
    made.node = std::make_shared<LatticeNode>(noise, o.frequency);
  }
  return made;
}

/// The noise of component `index` of a vector.
Made makeComponent(NoiseOptions options, std::uint32_t index) {
  detail::Draw draw(options.seed + 0x632be5abu);
  for (std::uint32_t i = 0; i <= index; ++i) options.seed = draw.bits();
  return make(options);
}

}  // namespace

std::span<const NoiseKind> noiseKinds() {
  return kKinds;
}

std::string_view noiseName(NoiseKind kind) {
  return rowOf(kind).name;
}

std::string noiseNames() {
  std::string names;
  for (const KindRow& row : kKindRows) names += (names.empty() ? "" : ", ") + std::string(row.name);
  return names;
}

NoiseKind noiseKindOf(std::string_view name) {
  for (const KindRow& row : kKindRows)
    if (row.name == name) return row.kind;
  throw Error("noise: unknown kind '" + std::string(name) + "', must be one of " + noiseNames());
}

ScalarField noise(const NoiseOptions& options) {
  return ScalarField(make(options).node);
}

ScalarField fractalSum(const NoiseOptions& options, const FractalSumOptions& octaves) {
  detail::Draw draw(octaves.seed);
  return detail::sumOctaves(octaves, [&](float frequency) {
    NoiseOptions term = options;
    term.frequency *= frequency;
    term.seed += draw.bits();
    return noise(term);
  });
}

VectorField vectorNoise(const NoiseOptions& options) {
  return vectorField(ScalarField(makeComponent(options, 0).node), ScalarField(makeComponent(options, 1).node),
                     ScalarField(makeComponent(options, 2).node));
}

VectorField curlNoise(const NoiseOptions& options) {
  require(options.kind != NoiseKind::worley && options.kind != NoiseKind::worleyDifference,
          "curlNoise: kind must have a continuous gradient, got " + std::string(noiseName(options.kind)));
  return VectorField(std::make_shared<CurlNode>(
      std::array<Made, 3>{makeComponent(options, 0), makeComponent(options, 1), makeComponent(options, 2)}));
}

}  // namespace nephele

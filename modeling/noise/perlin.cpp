// Perlin noise as a field, and fractal sums of noises.
//
// Each seed reads its own turned and shifted lattice: noises of one frequency, or of frequencies whose ratio
// is a whole number, would else share the zeros that Perlin noise has on every lattice point.
//
// Range of a box: the global bound, or for small boxes the value in the middle plus or minus the steepest
// gradient times the distance to a corner, whichever is tighter.
#include <algorithm>
#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"
#include "nephele/modeling/noise/detail/noise_kernels.h"
#include "nephele/modeling/noise/noise.h"
#include "nephele/modeling/noise/noise_draw.h"

namespace nephele {
namespace {

using detail::Draw;
using detail::kNotOrthogonal;

/// A rotation, all equally likely: a random unit quaternion (Shoemake).
Mat3f randomRotation(Draw& draw) {
  const float a = draw.uniform(), b = 2 * kPi * draw.uniform(), c = 2 * kPi * draw.uniform();
  const float r = std::sqrt(1 - a), s = std::sqrt(a);
  const float w = s * std::cos(c);
  const Vec3f v{r * std::sin(b), r * std::cos(b), s * std::sin(c)};
  const float sine = length(v);
  return sine > 0 ? Mat3f::rotation(v, 2 * std::atan2(sine, w)) : Mat3f::identity();
}

/// Small numbers keep the precision of coordinates near the origin.
Vec3f randomOffset(Draw& draw, float size) {
  const float x = draw.uniform(), y = draw.uniform(), z = draw.uniform();
  return Vec3f{x, y, z} * size;
}

class PerlinNode final : public FieldNode<float> {
 public:
  PerlinNode(const detail::PerlinLattice& lattice, float frequency)
      : lattice_(lattice), frequency_(frequency) {}

  void eval(const PointBlock& points, const BlockLanes<1>& values, Scratch&) const override {
    const float* const xyz[3] = {points.x, points.y, points.z};
    detail::perlinLanes(lattice_, xyz, values[0], points.paddedCount());
  }
  void evalGrad(const PointBlock& points, const BlockLanes<1>& values, const BlockLanes<3>& grads,
                Scratch&) const override {
    const float* const xyz[3] = {points.x, points.y, points.z};
    detail::perlinGradLanes(lattice_, xyz, values[0], grads.data(), points.paddedCount());
  }
  Interval range(const Box& box, RangeMemo&) const override {
    const Vec3f c = box.center();
    // Rounding of lattice coordinates moves the point that is read, far from the origin by more.
    const float stretch = frequency_ * (1 + kNotOrthogonal);
    const float reach = stretch * (length(c) + length(box.size())) + length(lattice_.offset);
    const float radius = stretch * 0.5f * length(box.size()) + 1e-6f * reach;
    const float change = detail::kPerlinSteepest * radius * 1.0001f + 1e-5f;
    if (!(change < 2 * kPerlinBound)) return {-kPerlinBound, kPerlinBound};
    const float v = detail::perlinScalar(lattice_, c, nullptr);
    return {std::max(v - change, -kPerlinBound), std::min(v + change, kPerlinBound)};
  }
  float differenceStep() const override { return 1e-2f / frequency_; }

 private:
  detail::PerlinLattice lattice_;
  float frequency_;
};

void requireFractal(const FractalSumOptions& o) {
  require(o.octaves >= 1 && o.octaves <= 32,
          "fractalSum: octaves must be from 1 to 32, got " + std::to_string(o.octaves));
  require(o.frequency > 0 && std::isfinite(o.frequency),
          "fractalSum: frequency must be > 0 and finite, got " + numberText(o.frequency));
  require(o.lacunarity > 0 && std::isfinite(o.lacunarity),
          "fractalSum: lacunarity must be > 0 and finite, got " + numberText(o.lacunarity));
  require(o.roughness >= 0 && std::isfinite(o.roughness),
          "fractalSum: roughness must be >= 0 and finite, got " + numberText(o.roughness));
  require(std::isfinite(o.frequency * std::pow(o.lacunarity, float(o.octaves - 1))),
          "fractalSum: frequency times lacunarity^(octaves - 1) must be finite");
}

}  // namespace

namespace detail {

PerlinLattice drawnLattice(const PerlinOptions& options, const std::string& caller) {
  require(options.frequency > 0 && std::isfinite(options.frequency),
          caller + ": frequency must be > 0 and finite, got " + numberText(options.frequency));
  Draw draw(options.seed);
  // Always drawn, so that giving one of the two does not change the other.
  const Mat3f drawnRotation = randomRotation(draw);
  // The hash differs by seed already; the offset moves the zeros, for which one cell is enough.
  const Vec3f drawnOffset = randomOffset(draw, 1);
  const Vec3f offset = options.offset.value_or(drawnOffset);
  Mat3f toLattice = options.rotation.value_or(drawnRotation);
  const Mat3f square = toLattice * transpose(toLattice);
  for (int i = 0; i < 9; ++i)
    require(std::abs(square.m[i] - Mat3f::identity().m[i]) <= kNotOrthogonal,
            caller + ": rotation must be orthogonal");
  for (float& m : toLattice.m) m *= options.frequency;
  require(isFinite(offset), caller + ": offset must be finite");
  return {toLattice, offset, draw.bits()};
}

ScalarField sumOctaves(const FractalSumOptions& o, const std::function<ScalarField(float)>& octave) {
  requireFractal(o);
  double squares = 0;
  for (int i = 0; i < o.octaves; ++i) squares += std::pow(double(o.roughness), 2 * i);
  std::optional<ScalarField> sum;
  for (int i = 0; i < o.octaves; ++i) {
    const float amplitude = float(std::pow(double(o.roughness), i) / std::sqrt(squares));
    const ScalarField term = octave(float(o.frequency * std::pow(double(o.lacunarity), i))) * amplitude;
    sum = sum ? *sum + term : term;
  }
  return *sum;
}

}  // namespace detail

ScalarField perlin(const PerlinOptions& options) {
  return ScalarField(
      std::make_shared<PerlinNode>(detail::drawnLattice(options, "perlin"), options.frequency));
}

ScalarField fractalSum(const FractalSumOptions& options) {
  Draw draw(options.seed);
  return detail::sumOctaves(
      options, [&](float frequency) { return perlin({.frequency = frequency, .seed = draw.bits()}); });
}

ScalarField fractalSum(const ScalarField& noise, const FractalSumOptions& options) {
  Draw draw(options.seed);
  return detail::sumOctaves(options, [&](float frequency) {
    Mat3f toNoise = randomRotation(draw);
    for (float& m : toNoise.m) m *= frequency;
    // The same noise is read again: far enough away not to be correlated.
    const Vec3f offset = randomOffset(draw, 64);
    return transformed(noise, inverse(Affine{toNoise, offset}));
  });
}

}  // namespace nephele

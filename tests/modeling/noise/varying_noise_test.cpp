#include "nephele/modeling/noise/varying_noise.h"

#include <gtest/gtest.h>

#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/cloud/density_profile.h"
#include "nephele/modeling/field/function_field.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/shape/shapes.h"
#include "tests/support/check_field.h"

namespace nephele {
namespace {

const Box kWide{{-200, -200, -200}, {200, 200, 200}};

NoiseOptions optionsOf(NoiseKind kind) {
  return {.kind = kind, .seed = 7, .spectrum = {.lowest = 0.5f, .highest = 2, .tile = 8, .resolution = 64}};
}

/// `frequency` wherever it is evaluated, with a range that does not give that away.
ScalarField within(float frequency, float low, float high) {
  return functionField([=](const Vec3f&) { return frequency; }, {.range = [=](const Box&) {
                         return Interval{low, high};
                       }});
}

struct Measured {
  double mean, rms, slope;
};

/// Mean, rms, and rms length of the gradient.
Measured measured(const ScalarField& field, std::size_t count) {
  std::mt19937 random(5);
  const test::Points points = test::randomPoints(kWide, count, random);
  test::Values<float> values(count);
  test::Gradients<float> grads(count);
  field.evalGrad(points.spans(), values.spans(), grads.spans());
  Measured m{};
  for (std::size_t i = 0; i < count; ++i) {
    const double v = values.data[0][i];
    m.mean += v;
    m.rms += v * v;
    for (const auto& lane : grads.data) m.slope += double(lane[i]) * lane[i];
  }
  return {m.mean / double(count), std::sqrt(m.rms / double(count)), std::sqrt(m.slope / double(count))};
}

TEST(VaryingNoise, OfOneFrequencyIsTheNoiseItself) {
  std::mt19937 random(1);
  const test::Points points = test::randomPoints(kWide, 1000, random);
  for (const NoiseKind kind : noiseKinds()) {
    NoiseOptions options = optionsOf(kind);
    options.frequency = 3.7f;
    const ScalarField plain = noise(options);
    options.frequency = 99;
    for (const ScalarField& same :
         {noiseOfFrequency(options, 3.7f), noiseOfFrequency(options, clamp(sphere({}, 1), 3.7f, 3.7f))})
      EXPECT_EQ(test::evaluate(same, points).data[0], test::evaluate(plain, points).data[0])
          << noiseName(kind);
  }
}

TEST(VaryingNoise, HasUnitRmsAndTheSlopeOfTheFrequencyThere) {
  // Frequencies on a noise of the ladder, just beside one, and between two.
  for (const NoiseKind kind : noiseKinds()) {
    NoiseOptions options = optionsOf(kind);
    for (const float frequency : {2.0f, 2.2f, 2.36f, 2.57f, 5.0f}) {
      options.frequency = frequency;
      const Measured plain = measured(noise(options), 100000);
      const Measured varying = measured(noiseOfFrequency(options, within(frequency, 2, 5)), 100000);
      // 10^5 points, of which neighbours within a feature are few: standard error of a mean 0.003, of an rms
      // of noise with heavy tails 0.004; tiles of the spectral noise differ by a few percent.
      const double tile = kind == NoiseKind::spectral ? 0.03 : 0;
      EXPECT_NEAR(varying.mean, 0, 0.02 + tile) << noiseName(kind) << " " << frequency;
      EXPECT_NEAR(varying.rms, 1, 0.02 + tile) << noiseName(kind) << " " << frequency;
      EXPECT_NEAR(varying.slope / plain.slope, 1, 0.08 + tile) << noiseName(kind) << " " << frequency;
    }
  }
}

TEST(VaryingNoise, DoesNotShearFarFromTheOrigin) {
  // Slopes of N(x f(x)) would grow with the distance from the origin: 100 times those here.
  const ScalarField across = ramp(plane({}, {1, 0, 0}), {{900, 1}, {1100, 4}});
  const ScalarField varying = noiseOfFrequency({.seed = 3}, across);
  const Box far{{999, -100, -100}, {1001, 100, 100}};
  std::mt19937 random(2);
  const test::Points points = test::randomPoints(far, 20000, random);
  test::Values<float> values(points.size());
  test::Gradients<float> grads(points.size());
  varying.evalGrad(points.spans(), values.spans(), grads.spans());
  double along = 0, aside = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    along += double(grads.data[0][i]) * grads.data[0][i];
    aside += double(grads.data[1][i]) * grads.data[1][i];
  }
  // Noise has no direction: a change of frequency by 1.5 % per feature does not give it one.
  EXPECT_NEAR(std::sqrt(along / aside), 1, 0.05);
}

TEST(VaryingNoise, IsAFieldLikeAnyOther) {
  const ScalarField frequency = ramp(plane({}, {0, 1, 0}), {{-1.5f, 0.1f}, {1.5f, 0.4f}});
  for (const NoiseKind kind : noiseKinds()) {
    SCOPED_TRACE(noiseName(kind));
    test::checkField(noiseOfFrequency(optionsOf(kind), frequency), {{-1, -1, -1}, {1, 1, 1}},
                     {.gradient = kind != NoiseKind::worley && kind != NoiseKind::worleyDifference &&
                                  kind != NoiseKind::gabor});
  }
}

TEST(VaryingNoise, RangesOfSmallBoxesAreTight) {
  const ScalarField frequency = ramp(plane({}, {0, 1, 0}), {{-1.5f, 0.1f}, {1.5f, 0.4f}});
  const ScalarField varying = noiseOfFrequency({.seed = 4}, frequency);
  const Interval all = varying.range(Box::everywhere());
  EXPECT_EQ(all, (Interval{-kPerlinBound, kPerlinBound}));
  std::mt19937 random(3);
  const test::Points corners = test::randomPoints({{-1, -1, -1}, {1, 1, 1}}, 200, random);
  double width = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Interval range = varying.range({corners[i], corners[i] + Vec3f{0.01f, 0.01f, 0.01f}});
    width += double(range.max) - range.min;
  }
  // The steepest slope of Perlin noise, about 12 per cell, at 0.4 cells per unit, over a diagonal of 0.017:
  // 0.09; and as much again for two noises.
  EXPECT_LT(width / double(corners.size()), 0.2);
}

TEST(VaryingNoise, CutsFewValues) {
  // Between two noises, where blends reach farthest. Cut values are exactly at a bound.
  for (const NoiseKind kind : noiseKinds()) {
    const ScalarField varying = noiseOfFrequency(optionsOf(kind), within(2.36f, 2, 5));
    const Interval bounds = varying.range(Box::everywhere());
    std::mt19937 random(6);
    const test::Points points = test::randomPoints(kWide, 200000, random);
    int cut = 0;
    const auto values = test::evaluate(varying, points);
    for (const float v : values.data[0]) {
      EXPECT_TRUE(bounds.contains(v));
      cut += v == bounds.min || v == bounds.max;
    }
    EXPECT_LE(cut, 20) << noiseName(kind);
  }
}

TEST(VaryingNoise, RefusesFrequenciesItCannotFollow) {
  EXPECT_THROW(noiseOfFrequency({}, 0.0f), Error);
  EXPECT_THROW(noiseOfFrequency({}, -1.0f), Error);
  EXPECT_THROW(noiseOfFrequency({}, INFINITY), Error);
  EXPECT_THROW(noiseOfFrequency({}, sphere({}, 1)), Error);
  EXPECT_THROW(noiseOfFrequency({}, clamp(sphere({}, 1), 0.0f, 1.0f)), Error);
  EXPECT_THROW(noiseOfFrequency({}, clamp(sphere({}, 1000), 1.0f, 257.0f)), Error);
}

}  // namespace
}  // namespace nephele

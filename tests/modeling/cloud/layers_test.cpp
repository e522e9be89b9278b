#include "nephele/modeling/cloud/layers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/cloud/cumulo.h"
#include "nephele/modeling/cloud/density_profile.h"
#include "nephele/modeling/field/function_field.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/shape/shapes.h"
#include "tests/support/check_field.h"

namespace nephele {
namespace {

const Box kAroundUnitSphere{{-1.4f, -1.4f, -1.4f}, {1.4f, 1.4f, 1.4f}};

test::Points pointsIn(const Box& box, std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  return test::randomPoints(box, count, random);
}

std::vector<float> valuesAt(const ScalarField& field, const test::Points& points) {
  return test::evaluate(field, points).data[0];
}

/// The same value everywhere, as a field that knows so.
ScalarField field(float value) {
  return functionField([=](const Vec3f&) { return value; },
                       {.range = [=](const Box&) { return Interval::of(value); }});
}

NoiseOptions noiseOf(NoiseKind kind) {
  return {.kind = kind, .seed = 5, .spectrum = {.lowest = 0.5f, .highest = 2, .tile = 8, .resolution = 64}};
}

TEST(CumuloLayers, OfPerlinNoiseAreThoseOfTheirSeeds) {
  // The seeds are those that std::mt19937 draws, whose first number for seed 0 the standard library fixes.
  const auto layers = cumuloLayers({.layers = 2, .frequency = 3, .lacunarity = 2});
  std::mt19937 seeds(0);
  const test::Points points = pointsIn(kAroundUnitSphere, 1000, 1);
  for (const float frequency : {3.0f, 6.0f}) {
    const ScalarField noise = perlin({.frequency = frequency, .seed = std::uint32_t(seeds())});
    EXPECT_EQ(valuesAt(layers[frequency > 3].noise, points), valuesAt(noise, points));
    EXPECT_EQ(layers[frequency > 3].frequency, frequency);
  }
}

TEST(CumuloLayers, DisplaceByUnitRmsWhateverTheNoise) {
  const test::Points points = pointsIn({{-150, -150, -150}, {150, 150, 150}}, 200000, 2);
  for (const NoiseKind kind : noiseKinds()) {
    const bool isWorley = kind == NoiseKind::worley || kind == NoiseKind::worleyDifference;
    for (const ScalarField& frequency :
         {ScalarField(2.0f), ramp(plane({}, {0, 1, 0}), {{-150, 1}, {150, 2.5f}})}) {
      const CumuloLayer layer = cumuloLayer({.noise = noiseOf(kind), .frequency = frequency});
      const Interval bounds = layer.noise.range(Box::everywhere());
      double squares = 0;
      float least = 1e9f;
      for (const float v : valuesAt(layer.noise, points)) {
        ASSERT_TRUE(bounds.contains(v));
        squares += double(v) * v;
        least = std::min(least, v);
      }
      const bool varies = frequency.range(Box::everywhere()) != Interval::of(2.0f);
      // A blend of two noises of positive mean is a noise of mean 0 in their formula: a little off.
      const double tolerance = kind == NoiseKind::spectral || (varies && isWorley) ? 0.05 : 0.02;
      EXPECT_NEAR(std::sqrt(squares / double(points.size())), 1, tolerance) << noiseName(kind);
      if (isWorley && !varies) {
        EXPECT_GE(least, 0) << noiseName(kind);
        EXPECT_LT(least, 0.01f) << noiseName(kind);
      }
    }
  }
}

TEST(CumuloLayers, OctavesAddFinerNoiseOfUnitRms) {
  const CumuloLayer one = cumuloLayer({.frequency = 2.0f}),
                    four = cumuloLayer({.frequency = 2.0f, .octaves = 4});
  const test::Points points = pointsIn({{-100, -100, -100}, {100, 100, 100}}, 100000, 3);
  double squares = 0;
  for (const float v : valuesAt(four.noise, points)) squares += double(v) * v;
  EXPECT_NEAR(std::sqrt(squares / double(points.size())), 1, 0.02);
  EXPECT_EQ(one.detail, 1);
  // 2^3 times as fine, 1 / 8 as high: cube root of 1/8 times 8.
  EXPECT_FLOAT_EQ(four.detail, 4);
}

TEST(CumuloLayers, KnowHowSteepTheirNoiseIs) {
  const test::Points points = pointsIn({{-50, -50, -50}, {50, 50, 50}}, 50000, 4);
  for (const NoiseKind kind : noiseKinds()) {
    if (kind == NoiseKind::perlin) continue;
    const CumuloLayer layer = cumuloLayer({.noise = noiseOf(kind), .frequency = 2.0f});
    ASSERT_TRUE(layer.steepest) << noiseName(kind);
    test::Values<float> values(points.size());
    test::Gradients<float> grads(points.size());
    layer.noise.evalGrad(points.spans(), values.spans(), grads.spans());
    float largest = 0;
    for (const auto& lane : grads.data)
      for (const float g : lane) largest = std::max(largest, std::abs(g));
    // No sample is steeper along an axis but for rare ones, and it is no idle bound.
    EXPECT_LE(largest, 1.1f * *layer.steepest) << noiseName(kind);
    EXPECT_GE(largest, 0.5f * *layer.steepest) << noiseName(kind);
  }
}

TEST(CumuloLayers, ConstantsAsFieldsGiveTheSameBits) {
  const test::Points points = pointsIn(kAroundUnitSphere, 2000, 5);
  for (const NoiseKind kind : noiseKinds()) {
    const CumuloFractal constants{.layers = 2,
                                  .noise = noiseOf(kind),
                                  .amplitude = 0.03f,
                                  .frequency = 2.3f,
                                  .lacunarity = 2.2f,
                                  .roughness = 0.45f,
                                  .billow = 0.7f,
                                  .billowScale = 1.2f};
    CumuloFractal fields = constants;
    fields.amplitude = field(0.03f);
    fields.frequency = field(2.3f);
    fields.lacunarity = field(2.2f);
    fields.roughness = field(0.45f);
    fields.billow = field(0.7f);
    fields.billowScale = field(1.2f);
    const ScalarField a = cumulo(sphere({}, 1), cumuloLayers(constants), {.voxelSize = 0.02f});
    const ScalarField b = cumulo(sphere({}, 1), cumuloLayers(fields), {.voxelSize = 0.02f});
    EXPECT_EQ(valuesAt(a, points), valuesAt(b, points)) << noiseName(kind);
  }
}

TEST(CumuloLayers, AmplitudeThatVariesIsReadAtTheSurfacePoint) {
  // On a sphere the surface point is x / |x|: l = 1 - |x| + a(x / |x|) |N(x / |x|)|.
  const ScalarField amplitude = ramp(plane({}, {0, 1, 0}), {{-0.7f, 0}, {0.7f, 0.06f}});
  CumuloLayer layer = cumuloLayer({.noise = {.seed = 8}, .frequency = 3.0f});
  layer.amplitude = amplitude;
  const ScalarField cloud = cumulo(sphere({}, 1), {layer}, {.voxelSize = 0.01f});
  const test::Points points = pointsIn(kAroundUnitSphere, 3000, 6);
  const std::vector<float> values = valuesAt(cloud, points);
  int raised = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3f p = points[i], y = normalize(p);
    const float base = 1 - length(p);
    if (base < -0.06f * kPerlinBound || base > 0.03f) continue;
    // Surface points are found to 0.005 voxels; steepest noise 14 cells: 0.06 * 14 * 3 * 5e-5.
    ASSERT_NEAR(values[i], base + amplitude(y) * std::abs(layer.noise(y)), 2e-4f);
    raised += values[i] > base;
  }
  EXPECT_GT(raised, 300);
}

TEST(CumuloLayers, BillowScaleThatVariesFillsLayersEarlierOrLater) {
  // Flat ground, first layer 0.02 high everywhere, which is half of its amplitude: the second layer is
  // full where billowScale <= 1/2, and half as high where it is 1.
  const ScalarField ground = plane({}, {0, -1, 0});
  const ScalarField scale = ramp(plane({}, {1, 0, 0}), {{-1, 0.5f}, {1, 1}});
  const std::vector<CumuloLayer> layers{
      {.noise = 0.5f, .amplitude = 0.04f, .frequency = 1},
      {.noise = 1.0f, .amplitude = 0.02f, .billow = 1.0f, .billowScale = scale, .frequency = 2}};
  const ScalarField cloud = cumulo(ground, layers, {.voxelSize = 0.01f});
  EXPECT_NEAR(cloud({-2, 0.03f, 0}), -0.03f + 0.02f + 0.02f, 1e-5f);
  EXPECT_NEAR(cloud({2, 0.03f, 0}), -0.03f + 0.02f + 0.01f, 1e-5f);
  EXPECT_NEAR(cloud({0, 0.03f, 0}), -0.03f + 0.02f + 0.02f * 0.5f / 0.75f, 1e-5f);
}

TEST(CumuloLayers, WithVaryingParametersAreFieldsLikeAnyOther) {
  const ScalarField across = ramp(plane({}, {1, 0, 0}), {{-0.3f, 0}, {0.4f, 1}});
  const auto layers = cumuloLayers({.layers = 2,
                                    .amplitude = 0.03f * across,
                                    .frequency = 2.0f + across,
                                    .lacunarity = 2.0f + 0.5f * across,
                                    .roughness = 0.5f * across,
                                    .billow = across,
                                    .billowScale = 0.5f + across});
  test::checkField(cumulo(sphere({}, 1), layers, {.voxelSize = 0.02f}), kAroundUnitSphere,
                   {.gradient = false});
}

TEST(CumuloLayers, RangesFollowTheAmplitudeNearby) {
  const ScalarField amplitude = ramp(plane({}, {1, 0, 0}), {{-0.1f, 0}, {0.1f, 0.05f}});
  CumuloLayer layer = cumuloLayer({.frequency = 3.0f});
  layer.amplitude = amplitude;
  const ScalarField base = sphere({}, 1), cloud = cumulo(base, {layer}, {.voxelSize = 0.01f});
  const Box left{{-1.02f, -0.05f, -0.05f}, {-0.98f, 0.05f, 0.05f}};
  EXPECT_EQ(cloud.range(left), base.range(left));
  const Box right{{0.98f, -0.05f, -0.05f}, {1.02f, 0.05f, 0.05f}};
  EXPECT_GT(cloud.range(right).max, base.range(right).max);
}

TEST(CumuloLayers, RefuseFieldsOutsideTheirRange) {
  const ScalarField unbounded = plane({}, {0, 1, 0});
  const ScalarField around0 = clamp(unbounded, -1, 1);
  EXPECT_THROW(cumuloLayers({.amplitude = around0}), Error);
  EXPECT_THROW(cumuloLayers({.amplitude = abs(unbounded)}), Error);
  EXPECT_THROW(cumuloLayers({.frequency = around0}), Error);
  EXPECT_THROW(cumuloLayers({.lacunarity = abs(around0)}), Error);
  EXPECT_THROW(cumuloLayers({.roughness = around0}), Error);
  EXPECT_THROW(cumuloLayers({.billow = around0}), Error);
  EXPECT_THROW(cumuloLayers({.billowScale = abs(around0)}), Error);
  EXPECT_THROW(cumuloLayers({.billowScale = abs(unbounded) + 1.0f}), Error);
  EXPECT_THROW(cumuloLayer({.octaves = 0}), Error);
  EXPECT_THROW(cumuloLayer({.frequency = abs(around0)}), Error);
  // The frequency of the last layer would spread over more than a noise can.
  EXPECT_THROW(cumuloLayers({.layers = 9, .lacunarity = clamp(unbounded, 1, 4)}), Error);
}

}  // namespace
}  // namespace nephele

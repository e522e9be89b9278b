#include <gtest/gtest.h>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/noise/noise.h"
#include "tests/modeling/noise/noise_statistics.h"
#include "tests/support/check_field.h"

namespace nephele {
namespace {

using test::kWide;
using test::optionsOf;
using test::Points;
using test::Statistics;
using test::statistics;

/// The divergence of v at p by differences of order 8, exact for polynomials up to degree 8.
double divergence(const VectorField& v, const Vec3f& p, float h) {
  constexpr double kWeights[4] = {4.0 / 5, -1.0 / 5, 4.0 / 105, -1.0 / 280};
  double sum = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 1; i <= 4; ++i) {
      Vec3f up = p, down = p;
      up[axis] += float(i) * h;
      down[axis] -= float(i) * h;
      sum += kWeights[i - 1] * (double(v(up)[axis]) - v(down)[axis]) / h;
    }
  return sum;
}

TEST(CurlNoise, IsFreeOfDivergenceToRounding) {
  // Within a cell Perlin and value noise are polynomials of degree 6 at most along each axis, and the spline
  // of degree 3: differences of order 8 are exact. What is left is rounding: coordinates are off by up
  // to 2.4e-7 at derivatives of about 10, values of size 3 by 1e-6, both times 6.2, the sum of the weights,
  // over the step.
  for (const NoiseKind kind : {NoiseKind::perlin, NoiseKind::value, NoiseKind::spectral})
    for (const bool moves : {false, true}) {
      NoiseOptions o = optionsOf(kind, moves);
      o.rotation = Mat3f::identity();
      o.offset = Vec3f{};
      const VectorField v = curlNoise(o);
      const float cell = kind == NoiseKind::spectral ? 1.0f / 8 : 1.0f, h = 0.1f * cell;
      std::mt19937 random(12);
      const Points cells = test::randomPoints({{-4, -4, -4}, {4, 4, 4}}, 200, random);
      for (std::size_t i = 0; i < cells.size(); ++i) {
        const auto middle = [&](float x) {
          return (std::floor(x) + 0.5f + 0.08f * (x - std::floor(x))) * cell;
        };
        const Vec3f p{middle(cells.x[i]), middle(cells.y[i]), middle(cells.z[i])};
        EXPECT_NEAR(divergence(v, p, h), 0, 2e-4 / cell) << noiseName(kind);
      }
    }
}

TEST(CurlNoise, OfOtherKindsIsFreeOfDivergenceBetweenTheirSeams) {
  // Simplex and Gabor noise are sums of bumps of finite size; most steps of 0.008 cross the edge of none, and
  // there differences of order 8 are exact (simplex) or off by less than rounding.
  for (const NoiseKind kind : {NoiseKind::simplex, NoiseKind::gabor}) {
    const VectorField v = curlNoise(optionsOf(kind, false));
    std::mt19937 random(12);
    const Points points = test::randomPoints({{-5, -5, -5}, {5, 5, 5}}, 201, random);
    std::vector<double> sizes;
    for (std::size_t i = 0; i < points.size(); ++i)
      sizes.push_back(std::abs(divergence(v, points[i], 0.008f)));
    std::nth_element(sizes.begin(), sizes.begin() + 100, sizes.end());
    EXPECT_LT(sizes[100], 1e-3) << noiseName(kind);
  }
}

TEST(CurlNoise, HasUnitRmsAndKeepsWhatFieldsPromise) {
  for (const NoiseKind kind :
       {NoiseKind::perlin, NoiseKind::simplex, NoiseKind::value, NoiseKind::gabor, NoiseKind::spectral}) {
    NoiseOptions o = optionsOf(kind, true);
    o.frequency = 2;
    const VectorField v = curlNoise(o);
    for (int c = 0; c < 3; ++c) {
      // Standard error 0.002; a tile is one sample of few long waves.
      const Statistics s = statistics(component(v, c), 200000);
      EXPECT_NEAR(s.rms, 1, kind == NoiseKind::spectral ? 0.15 : 0.012) << noiseName(kind);
      EXPECT_NEAR(s.mean, 0, 0.012) << noiseName(kind);
    }
    test::CheckOptions check;
    check.gradient = false;  // differences themselves
    test::checkField(v, {{-2, -2, -2}, {2, 2, 2}}, check);
  }
}

TEST(VectorNoise, HasIndependentComponentsOfUnitRms) {
  const VectorField v = vectorNoise({.kind = NoiseKind::simplex, .seed = 4, .time = 0.3f});
  std::mt19937 random(4);
  const Points points = test::randomPoints(kWide, 200000, random);
  const auto values = test::evaluate(v, points);
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b <= a; ++b) {
      double sum = 0;
      for (std::size_t i = 0; i < points.size(); ++i) sum += double(values.data[a][i]) * values.data[b][i];
      // Standard error 0.0022 to 0.003.
      EXPECT_NEAR(sum / double(points.size()), a == b, 0.015);
    }
}

}  // namespace
}  // namespace nephele

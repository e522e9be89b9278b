#include <gtest/gtest.h>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"
#include "nephele/modeling/noise/detail/noise_kernels.h"
#include "nephele/modeling/noise/noise.h"
#include "tests/support/check_field.h"
#include "tests/support/each_target.h"

namespace nephele {
namespace {

using test::Points;

const Box kBox{{-3, -3, -3}, {3, 3, 3}};
/// Many cells, so that samples are nearly independent.
const Box kWide{{-500, -500, -500}, {500, 500, 500}};

struct Statistics {
  double mean = 0, rms = 0, largest = 0;
};

Statistics statistics(const ScalarField& field, std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  const Points points = test::randomPoints(kWide, count, random);
  const auto values = test::evaluate(field, points);
  Statistics s;
  for (const float v : values.data[0]) {
    s.mean += v;
    s.rms += double(v) * v;
    s.largest = std::max(s.largest, std::abs(double(v)));
  }
  s.mean /= double(count);
  s.rms = std::sqrt(s.rms / double(count));
  return s;
}

TEST(Perlin, HasMeanZeroAndUnitRms) {
  // 500 000 nearly independent samples of unit variance: standard error 0.0014 of the mean, about 0.001 of
  // the rms.
  for (const unsigned seed : {0u, 1u, 77u}) {
    const Statistics s = statistics(perlin({.seed = seed}), 500000, seed + 10);
    EXPECT_NEAR(s.mean, 0, 0.006);
    EXPECT_NEAR(s.rms, 1, 0.005);
    EXPECT_LT(s.largest, kPerlinBound);
    EXPECT_GT(s.largest, 2.9);  // the bound is not far from what occurs
  }
}

TEST(Perlin, RmsFollowsFromTheFadeCurve) {
  // Independent gradients with E[g g^T] = 2/3 I at 8 corners: variance = 8 * 2/3 * 3 A B^2.
  double a = 0, b = 0;
  constexpr int kSteps = 100000;
  for (int i = 0; i < kSteps; ++i) {
    const double t = (i + 0.5) / kSteps, w = 1 - t * t * t * (t * (t * 6 - 15) + 10);
    a += w * w * t * t / kSteps;
    b += w * w / kSteps;
  }
  EXPECT_NEAR(detail::kPerlinRms, std::sqrt(16 * a * b * b), 1e-8);
}

TEST(Perlin, BoundHoldsForEveryChoiceOfGradients) {
  // At a point, the largest raw value over all gradients is the sum over corners of weight times the two
  // largest distances; that function is even about the middle of the cell and changes by less than 2 per unit
  // length.
  double largest = 0;
  constexpr int kSteps = 128;
  const auto fade = [](double t) { return t * t * t * (t * (t * 6 - 15) + 10); };
  for (int i = 0; i <= kSteps; ++i)
    for (int j = i; j <= kSteps; ++j)
      for (int k = j; k <= kSteps; ++k) {
        const double p[3] = {0.5 * i / kSteps, 0.5 * j / kSteps, 0.5 * k / kSteps};
        double sum = 0;
        for (int corner = 0; corner < 8; ++corner) {
          double weight = 1, d[3];
          for (int a = 0; a < 3; ++a) {
            const bool far = corner >> a & 1;
            weight *= far ? fade(p[a]) : 1 - fade(p[a]);
            d[a] = far ? 1 - p[a] : p[a];
          }
          sum += weight * (d[0] + d[1] + d[2] - std::min({d[0], d[1], d[2]}));
        }
        largest = std::max(largest, sum);
      }
  EXPECT_LE(largest / detail::kPerlinRms, kPerlinBound);
  EXPECT_GE(largest / detail::kPerlinRms, kPerlinBound - 0.002);
}

TEST(Perlin, GradientIsNeverSteeperThanStated) {
  std::mt19937 random(3);
  const Points points = test::randomPoints(kWide, 300000, random);
  std::vector<float> values(points.size());
  test::Gradients<float> g(points.size());
  perlin({.seed = 5}).evalGrad(points.spans(), values, g.spans());
  float steepest = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    steepest = std::max(steepest, length(Vec3f{g.data[0][i], g.data[1][i], g.data[2][i]}));
  EXPECT_LT(steepest, detail::kPerlinSteepest);
  EXPECT_GT(steepest, 0.5f * detail::kPerlinSteepest);
}

TEST(Perlin, LanesEqualTheScalarTruthBitForBit) {
  std::mt19937 random(9);
  const float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
  for (const float reach : {2.0f, 300.0f, 1e6f, 1e12f}) {
    const detail::PerlinLattice lattice{Mat3f::rotation({1, 2, 3}, 0.7f), {3.25f, -17.5f, 99}, 12345u};
    Points points = test::randomPoints({{-reach, -reach, -reach}, {reach, reach, reach}}, kBlockSize, random);
    points.set(10, {nan, 1, 2});
    points.set(11, {inf, -inf, 0});
    points.set(12, {-0.0f, 0, 1e-40f});
    alignas(64) float x[3][kBlockSize], v[kBlockSize], w[kBlockSize], g[3][kBlockSize];
    for (int i = 0; i < kBlockSize; ++i) x[0][i] = points.x[i], x[1][i] = points.y[i], x[2][i] = points.z[i];
    const float* const in[3] = {x[0], x[1], x[2]};
    float* const out[3] = {g[0], g[1], g[2]};
    test::forEachTarget([&] {
      detail::perlinLanes(lattice, in, v, kBlockSize);
      detail::perlinGradLanes(lattice, in, w, out, kBlockSize);
      for (int i = 0; i < kBlockSize; ++i) {
        Vec3f gradient;
        const float truth = detail::perlinScalar(lattice, points[i], &gradient);
        ASSERT_TRUE(test::sameValue(v[i], truth)) << reach << " " << i << " " << v[i] << " " << truth;
        ASSERT_TRUE(test::sameValue(w[i], truth)) << reach << " " << i;
        for (int k = 0; k < 3; ++k) ASSERT_TRUE(test::sameValue(g[k][i], gradient[k])) << reach << " " << i;
      }
    });
  }
}

TEST(Perlin, VanishesOnItsLattice) {
  const ScalarField p = perlin({.offset = Vec3f{}, .rotation = Mat3f::identity()});
  for (int i = -5; i < 5; ++i) EXPECT_EQ(p({float(i), float(3 * i), float(-i)}), 0);
  EXPECT_NE(p({0.5f, 0.25f, 0.125f}), 0);
}

TEST(Perlin, SeedsAreIndependent) {
  // Correlation of two independent unit noises over 200 000 points: standard error 0.0022.
  std::mt19937 random(4);
  const Points points = test::randomPoints(kWide, 200000, random);
  const auto a = test::evaluate(perlin({.seed = 1}), points), b = test::evaluate(perlin({.seed = 2}), points);
  double sum = 0;
  for (std::size_t i = 0; i < points.size(); ++i) sum += double(a.data[0][i]) * b.data[0][i];
  EXPECT_NEAR(sum / double(points.size()), 0, 0.01);
}

TEST(Perlin, HashPrefersNoGradientAndNoNeighbour) {
  // On one lattice, with offset and rotation fixed: all 12 gradients equally often, and those of neighbouring
  // corners (read just beside the corners, where value = g . d) uncorrelated. Standard errors 0.0035 and
  // 0.005.
  const detail::PerlinLattice lattice{Mat3f::identity(), {}, 7u};
  int count[27] = {};
  double neighbours[3] = {};
  constexpr int kSide = 30;
  const auto gradient = [&](int i, int j, int k) {
    Vec3f g;
    detail::perlinScalar(lattice, {float(i), float(j), float(k)}, &g);
    return g * detail::kPerlinRms;
  };
  for (int i = 0; i < kSide; ++i)
    for (int j = 0; j < kSide; ++j)
      for (int k = 0; k < kSide; ++k) {
        const Vec3f g = gradient(i, j, k);
        ++count[int(std::lround(g.x) + 1 + 3 * (std::lround(g.y) + 1) + 9 * (std::lround(g.z) + 1))];
        neighbours[0] += dot(g, gradient(i + 1, j, k));
        neighbours[1] += dot(g, gradient(i, j + 1, k));
        neighbours[2] += dot(g, gradient(i, j, k + 1));
      }
  constexpr double kCorners = double(kSide) * kSide * kSide;
  int kinds = 0;
  for (const int c : count) {
    if (c == 0) continue;
    ++kinds;
    EXPECT_NEAR(c / kCorners, 1.0 / 12, 0.009);
  }
  EXPECT_EQ(kinds, 12);
  // Each dot product has variance 4/3.
  for (const double n : neighbours) EXPECT_NEAR(n / kCorners, 0, 0.03);
}

TEST(Perlin, DoesNotRepeatAfter256Cells) {
  const ScalarField p = perlin({.offset = Vec3f{}, .rotation = Mat3f::identity()});
  const Vec3f q{0.3f, 0.6f, 0.2f};
  EXPECT_NE(p(q), p(q + Vec3f{256, 0, 0}));
  EXPECT_NE(p(q), p(q + Vec3f{0, 256, 0}));
  EXPECT_NE(p(q), p(q + Vec3f{0, 0, 256}));
}

TEST(Perlin, FrequencyIsCellsPerWorldUnit) {
  const PerlinOptions one{.offset = Vec3f{1, 2, 3}}, four{.frequency = 4, .offset = Vec3f{1, 2, 3}};
  EXPECT_EQ(perlin(one)({0.5f, 1, 2}), perlin(four)({0.125f, 0.25f, 0.5f}));
}

TEST(Perlin, KeepsWhatEveryFieldPromises) {
  test::CheckOptions options;
  options.tolerance = 2e-2f;
  test::checkField(perlin(), kBox, options);
  test::checkField(perlin({.frequency = 0.3f, .seed = 9}), kBox, options);
  options.gradient = false;
  test::checkField(perlin({.frequency = 40, .seed = 3}), kBox, options);
}

TEST(Perlin, KeepsItsPromisesAMillionCellsAway) {
  test::CheckOptions options;
  options.gradient = false;  // coordinates are too coarse for differences
  test::checkField(perlin({.seed = 2}), {{1e6f, -1e6f, 1e6f}, {1e6f + 8, -1e6f + 8, 1e6f + 8}}, options);
  std::mt19937 random(8);
  const Points points = test::randomPoints({{-1e6f, -1e6f, -1e6f}, {1e6f, 1e6f, 1e6f}}, 100000, random);
  const auto values = test::evaluate(perlin(), points);
  double sum = 0;
  for (const float v : values.data[0]) sum += double(v) * v;
  // Coordinates are multiples of 1/16 there, an even sampling of the cell; standard error 0.002 as above.
  EXPECT_NEAR(std::sqrt(sum / double(points.size())), 1, 0.02);
}

TEST(Perlin, RangesOfSmallBoxesAreTight) {
  const Interval r = perlin().range({{1, 1, 1}, {1.01f, 1.01f, 1.01f}});
  EXPECT_LT(r.max - r.min, 0.3f);  // 2 * 14.03 * 0.0087
  const Interval all = perlin().range(Box::everywhere());
  EXPECT_EQ(all.max, kPerlinBound);
  EXPECT_EQ(all.min, -kPerlinBound);
}

TEST(FractalSum, HasUnitRms) {
  // As for one noise; octaves are independent, so their squares add.
  for (const float roughness : {0.3f, 0.5f, 1.0f}) {
    const Statistics s = statistics(fractalSum({.octaves = 4, .roughness = roughness}), 200000, 5);
    EXPECT_NEAR(s.rms, 1, 0.01);
    EXPECT_NEAR(s.mean, 0, 0.012);
  }
  const Statistics s =
      statistics(fractalSum(perlin({.seed = 3}), {.octaves = 3, .roughness = 0.8f}), 200000, 6);
  EXPECT_NEAR(s.rms, 1, 0.01);
}

TEST(FractalSum, OfOneOctaveIsItsNoise) {
  const ScalarField noise = fractalSum({.octaves = 1, .frequency = 2});
  EXPECT_EQ(noise.range(Box::everywhere()).max, kPerlinBound);
}

TEST(FractalSum, KeepsWhatEveryFieldPromises) {
  test::CheckOptions options;
  options.tolerance = 3e-2f;
  test::checkField(fractalSum({.octaves = 3}), kBox, options);
  options.step = 8e-3f;
  test::checkField(fractalSum(perlin(), {.octaves = 2, .frequency = 0.5f}), kBox, options);
}

TEST(Noise, RefusesOptionsOutsideTheirRange) {
  EXPECT_THROW(perlin({.frequency = 0}), Error);
  EXPECT_THROW(perlin({.frequency = std::numeric_limits<float>::infinity()}), Error);
  EXPECT_THROW(perlin({.rotation = Mat3f::scaling(2)}), Error);
  EXPECT_THROW(fractalSum({.octaves = 0}), Error);
  EXPECT_THROW(fractalSum({.octaves = 33}), Error);
  EXPECT_THROW(fractalSum({.lacunarity = 0}), Error);
  EXPECT_THROW(fractalSum({.roughness = -1}), Error);
}

}  // namespace
}  // namespace nephele

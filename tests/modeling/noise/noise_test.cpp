#include "nephele/modeling/noise/noise.h"

#include <gtest/gtest.h>

#include <thread>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/noise/detail/spectral_noise.h"
#include "nephele/modeling/noise/lattice_noise.h"
#include "nephele/modeling/noise/noise_draw.h"
#include "tests/modeling/noise/noise_statistics.h"
#include "tests/support/check_field.h"
#include "tests/support/each_target.h"

namespace nephele {
namespace {

using detail::LatticeKind;
using test::kSamples;
using test::kWide;
using test::optionsOf;
using test::Points;
using test::smallSpectrum;
using test::Statistics;
using test::statistics;

constexpr LatticeKind kLatticeKinds[] = {
    LatticeKind::perlin, LatticeKind::simplex,          LatticeKind::value,
    LatticeKind::worley, LatticeKind::worleyDifference, LatticeKind::gabor};

class Noises : public testing::TestWithParam<std::tuple<NoiseKind, bool>> {
 protected:
  NoiseOptions options() const { return optionsOf(std::get<0>(GetParam()), std::get<1>(GetParam())); }
};

std::string nameOf(const testing::TestParamInfo<std::tuple<NoiseKind, bool>>& info) {
  return std::string(noiseName(std::get<0>(info.param))) + (std::get<1>(info.param) ? "_moving" : "_still");
}

INSTANTIATE_TEST_SUITE_P(All, Noises,
                         testing::Combine(testing::ValuesIn(noiseKinds().begin(), noiseKinds().end()),
                                          testing::Bool()),
                         nameOf);

TEST_P(Noises, HaveMeanZeroUnitRmsAndKeepTheirBounds) {
  const ScalarField field = noise(options());
  const Statistics s = statistics(field, kSamples);
  const Interval bounds = field.range(Box::everywhere());
  // Standard error 1 / sqrt(samples), about as much for the rms.
  const double error = 5 / std::sqrt(double(kSamples));
  EXPECT_NEAR(s.mean, 0, error);
  EXPECT_NEAR(s.rms, 1, error);
  EXPECT_GE(s.low, bounds.min);
  EXPECT_LE(s.high, bounds.max);
  // Bounds are not far from what occurs: of 10^7 values the largest of a normal distribution is about 5.3.
  EXPECT_LT(s.low, 0.6 * bounds.min);
  EXPECT_GT(s.high, 0.55 * bounds.max);
}

TEST_P(Noises, KeepWhatEveryFieldPromises) {
  const Box box{{-3, -3, -3}, {3, 3, 3}};
  test::CheckOptions check;
  check.tolerance = 3e-2f;
  check.step = 1e-3f;
  check.smoothShare = 0.6;
  test::checkField(noise(options()), box, check);
}

TEST_P(Noises, GradientIsNeverSteeperThanStated) {
  // The change over any distance is at most the stated slope times it: across cells, tetrahedra, feature
  // points and the wrapping of tiles alike. That is also continuity.
  NoiseOptions o = options();
  o.rotation = Mat3f::identity();
  o.offset = Vec3f{};
  const ScalarField field = noise(o);
  std::mt19937 random(3);
  const Points a = test::randomPoints(kWide, 200000, random);
  Points b = a;
  std::vector<float> step(a.size());
  Points from(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Vec3f way = normalize(Vec3f{float(random() >> 8) - 0x1p23f, float(random() >> 8) - 0x1p23f,
                                      float(random() >> 8) - 0x1p23f});
    // Half of the pairs lie on either side of the nearest half cell, where lattices and tables change.
    const auto near = [&](float x) { return i % 2 ? std::round(2 * x) / 2 : x; };
    const Vec3f p{near(a.x[i] / 10), near(a.y[i] / 10), near(a.z[i] / 10)};
    from.set(i, p - way * 1e-3f);
    b.set(i, p + way * 1e-3f);
    step[i] = length(b[i] - from[i]);
  }
  std::vector<float> values(a.size());
  test::Gradients<float> g(a.size());
  field.evalGrad(from.spans(), values, g.spans());
  const auto next = test::evaluate(field, b);
  float steepest = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    steepest = std::max(steepest, length(Vec3f{g.data[0][i], g.data[1][i], g.data[2][i]}));
  float stated = 0;
  if (o.kind == NoiseKind::spectral) {
    const SpectrumOptions& s = o.spectrum;
    const std::uint32_t seed = detail::drawnLattice({.seed = o.seed}, "noise").seed;
    stated = detail::synthesise({s.exponent, s.lowest, s.highest, s.tile, s.resolution}, seed,
                                o.time.value_or(0), 0)
                 .steepest;
  } else {
    constexpr LatticeKind kinds[] = {LatticeKind::perlin,           LatticeKind::simplex, LatticeKind::worley,
                                     LatticeKind::worleyDifference, LatticeKind::value,   LatticeKind::gabor};
    stated = detail::latticeFacts(kinds[int(o.kind)], o.time.has_value()).steepest;
  }
  EXPECT_LE(steepest, stated * 1.0001f);
  for (std::size_t i = 0; i < a.size(); ++i)
    ASSERT_LE(std::abs(next.data[0][i] - values[i]), stated * step[i] * 1.001f + 2e-5f)
        << b.x[i] << " " << b.y[i] << " " << b.z[i];
}

TEST_P(Noises, AreTheSameEveryTimeAndOtherwiseForAnotherSeed) {
  NoiseOptions o = options();
  std::mt19937 random(4);
  const Points points = test::randomPoints(kWide, 200000, random);
  test::Values<float> a(points.size()), b(points.size());
  std::thread other([&] { b = test::evaluate(noise(o), points); });
  a = test::evaluate(noise(o), points);
  other.join();
  EXPECT_EQ(a.data[0], b.data[0]);
  o.seed = 8;
  b = test::evaluate(noise(o), points);
  double sum = 0;
  for (std::size_t i = 0; i < points.size(); ++i) sum += double(a.data[0][i]) * b.data[0][i];
  // Independent: standard error 0.0022; a tile of 64 x 64 x 64 / 4^3 free numbers adds about 0.02.
  EXPECT_NEAR(sum / double(points.size()), 0, o.kind == NoiseKind::spectral ? 0.1 : 0.012);
}

TEST_P(Noises, FractalSumsHaveUnitRms) {
  // Terms are independent, so that their squares add; standard error 0.0014.
  const ScalarField field =
      fractalSum(options(), {.octaves = 3, .lacunarity = 2.1f, .roughness = 0.6f, .seed = 3});
  const Statistics s = statistics(field, 500000);
  EXPECT_NEAR(s.mean, 0, 0.01);
  EXPECT_NEAR(s.rms, 1, std::get<0>(GetParam()) == NoiseKind::spectral ? 0.05 : 0.01);
  const Interval bounds = field.range(Box::everywhere());
  EXPECT_GE(s.low, bounds.min);
  EXPECT_LE(s.high, bounds.max);
}

class MovingNoises : public testing::TestWithParam<NoiseKind> {};
INSTANTIATE_TEST_SUITE_P(All, MovingNoises, testing::ValuesIn(noiseKinds().begin(), noiseKinds().end()),
                         [](const auto& kind) { return std::string(noiseName(kind.param)); });

/// Rms and largest of a - b at random points.
std::pair<double, double> difference(const NoiseOptions& a, const NoiseOptions& b) {
  std::mt19937 random(6);
  const Points points = test::randomPoints(kWide, 20000, random);
  const auto u = test::evaluate(noise(a), points), v = test::evaluate(noise(b), points);
  double sum = 0, largest = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double d = double(u.data[0][i]) - v.data[0][i];
    sum += d * d;
    largest = std::max(largest, std::abs(d));
  }
  return {std::sqrt(sum / double(points.size())), largest};
}

TEST_P(MovingNoises, ChangeContinuouslyInTime) {
  NoiseOptions a = optionsOf(GetParam(), true), b = a, c = a;
  b.time = *a.time + 0x1p-7f;
  c.time = *a.time + 0x1p-10f;
  const auto [longer, most] = difference(a, b);
  const auto [shorter, least] = difference(a, c);
  // Differentiable but for bounces of feature points: the change is proportional to the time that passed.
  EXPECT_NEAR(longer / shorter, 8, 1);
  EXPECT_LT(least, 0.03);
  EXPECT_LT(most, 0.24);
  EXPECT_GT(longer, 0.002);
}

/// Independent noises of unit rms differ by sqrt(2), opposite ones by 2. Feature points of cells stay in
/// theirs.
void expectIndependent(const NoiseOptions& a, const NoiseOptions& b) {
  const bool isOfCells = a.kind == NoiseKind::worley || a.kind == NoiseKind::worleyDifference;
  EXPECT_NEAR(difference(a, b).first, isOfCells ? 1.25 : std::sqrt(2.0), 0.25);
}

TEST_P(MovingNoises, AreOtherNoisesAfterAWhile) {
  for (const float later : {1.0f, 2.0f, 3.0f, 7.0f, 32.0f, 64.0f}) {
    SCOPED_TRACE(later);
    NoiseOptions a = optionsOf(GetParam(), true), b = a;
    b.time = *a.time + later;
    expectIndependent(a, b);
  }
}

TEST_P(MovingNoises, AreStillAtTimeZero) {
  NoiseOptions still = optionsOf(GetParam(), false), moving = still;
  moving.time = 0;
  EXPECT_LT(difference(still, moving).second, 1e-5);
}

TEST_P(MovingNoises, RepeatAfterTheirPeriod) {
  NoiseOptions a = optionsOf(GetParam(), true);
  a.period = 5;
  NoiseOptions b = a, c = a;
  b.time = *a.time + 5;
  c.time = *a.time + 2.5f;
  EXPECT_LT(difference(a, b).second, 2e-4);
  EXPECT_GT(difference(a, c).first, 0.5);
}

TEST_P(MovingNoises, AreNotTheirOppositesAfterHalfAPeriod) {
  for (const float period : {1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 8.0f}) {
    SCOPED_TRACE(period);
    NoiseOptions a = optionsOf(GetParam(), true);
    a.period = period;
    NoiseOptions b = a;
    b.time = *a.time + period / 2;
    expectIndependent(a, b);
  }
}

TEST(LatticeNoise, LanesEqualTheScalarTruthBitForBit) {
  std::mt19937 random(9);
  const float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
  for (const LatticeKind kind : kLatticeKinds)
    for (const bool moves : {false, true})
      for (const float reach : {2.0f, 1e6f, 1e12f}) {
        const detail::LatticeNoise noise{kind,
                                         {Mat3f::rotation({1, 2, 3}, 0.7f), {3.25f, -17.5f, 99}, 12345u},
                                         moves,
                                         detail::noiseClock(1.37f, 0)};
        Points points =
            test::randomPoints({{-reach, -reach, -reach}, {reach, reach, reach}}, kBlockSize, random);
        points.set(10, {nan, 1, 2});
        points.set(11, {inf, -inf, 0});
        points.set(12, {-0.0f, 0, 1e-40f});
        alignas(64) float x[3][kBlockSize], v[kBlockSize], w[kBlockSize], g[3][kBlockSize];
        for (int i = 0; i < kBlockSize; ++i)
          x[0][i] = points.x[i], x[1][i] = points.y[i], x[2][i] = points.z[i];
        const float* const in[3] = {x[0], x[1], x[2]};
        float* const out[3] = {g[0], g[1], g[2]};
        test::forEachTarget([&] {
          detail::latticeNoiseLanes(noise, in, v, nullptr, kBlockSize);
          detail::latticeNoiseLanes(noise, in, w, out, kBlockSize);
          for (int i = 0; i < kBlockSize; ++i) {
            Vec3f gradient;
            const float truth = detail::latticeNoiseScalar(noise, points[i], &gradient);
            ASSERT_TRUE(std::isfinite(truth) && isFinite(gradient));
            ASSERT_EQ(truth, detail::latticeNoiseScalar(noise, points[i], nullptr));
            ASSERT_EQ(v[i], truth) << int(kind) << " " << moves << " " << reach << " " << i;
            ASSERT_EQ(w[i], truth) << int(kind) << " " << moves << " " << reach << " " << i;
            for (int k = 0; k < 3; ++k)
              ASSERT_EQ(g[k][i], gradient[k]) << int(kind) << " " << moves << " " << reach << " " << i;
          }
        });
      }
}

TEST(LatticeNoise, SlopesHaveTheStatedRms) {
  // 10^6 points; kurtosis of slopes below 10: standard error below 0.15 %.
  for (const LatticeKind kind :
       {LatticeKind::perlin, LatticeKind::simplex, LatticeKind::value, LatticeKind::gabor})
    for (const bool moves : {false, true}) {
      const detail::LatticeNoise noise{
          kind, {Mat3f::identity(), {}, 99u}, moves, detail::noiseClock(1.37f, 0)};
      constexpr int kCount = 1 << 20;
      std::mt19937 random(5);
      const Points points = test::randomPoints(kWide, kCount, random);
      double sum[3] = {};
      alignas(64) float x[3][kBlockSize], v[kBlockSize], g[3][kBlockSize];
      const float* const in[3] = {x[0], x[1], x[2]};
      float* const out[3] = {g[0], g[1], g[2]};
      for (int first = 0; first < kCount; first += kBlockSize) {
        std::copy_n(points.x.data() + first, kBlockSize, x[0]);
        std::copy_n(points.y.data() + first, kBlockSize, x[1]);
        std::copy_n(points.z.data() + first, kBlockSize, x[2]);
        detail::latticeNoiseLanes(noise, in, v, out, kBlockSize);
        for (int a = 0; a < 3; ++a)
          for (const float d : g[a]) sum[a] += double(d) * d;
      }
      const double stated = detail::latticeFacts(kind, moves).gradientRms;
      for (const double s : sum) EXPECT_NEAR(std::sqrt(s / kCount), stated, 0.008 * stated) << int(kind);
    }
}

TEST(LatticeNoise, ConstantsFollowFromClosedForms) {
  const auto beta = [](double a, double b) { return std::tgamma(a) * std::tgamma(b) / std::tgamma(a + b); };
  const double pi = 3.14159265358979323846;
  // 2 corners per unit volume, E[g g^T] = 2/3 I: 4/3 int (1/2 - r^2)^8 r^2 dV, with r^2 = u / 2.
  const double simplex = 4.0 / 3 * 4 * pi * std::pow(0.5, 10.5) / 2 * beta(2.5, 9);
  EXPECT_NEAR(detail::kSimplexRms, std::sqrt(simplex), 1e-9);
  // Uniform numbers have variance 1/3; int s^2 over an axis is 181/462 for s = 6 t^5 - 15 t^4 + 10 t^3.
  EXPECT_NEAR(detail::kValueRms, std::sqrt(std::pow(2 * 181.0 / 462, 3) / 3), 1e-7);
  // 2 impulses per cell, waves of mean square 1/2: int (1 - r^2)^6 dV.
  EXPECT_NEAR(detail::kGaborRms, std::sqrt(4 * pi / 2 * beta(1.5, 7)), 1e-7);
}

TEST(LatticeNoise, SimplexBoundHoldsForEveryChoiceOfGradients) {
  // At a point the largest value over all gradients is the sum over corners of the fade times the two largest
  // distances by axis. One tetrahedron stands for all; close to the largest the sum is flat.
  double largest = 0;
  constexpr int kSteps = 120;
  for (int i = 0; i <= kSteps; ++i)
    for (int j = 0; j <= i; ++j)
      for (int k = 0; k <= j; ++k) {
        const double f[3] = {double(i) / kSteps, double(j) / kSteps, double(k) / kSteps};
        double sum = 0;
        for (int c = 0; c < 4; ++c) {
          double d[3], square = 0;
          for (int a = 0; a < 3; ++a) {
            d[a] = std::abs(f[a] - (f[0] + f[1] + f[2]) / 6 - (a < c) + c / 6.0);
            square += d[a] * d[a];
          }
          sum +=
              std::pow(std::max(0.5 - square, 0.0), 4) * (d[0] + d[1] + d[2] - std::min({d[0], d[1], d[2]}));
        }
        largest = std::max(largest, sum);
      }
  const detail::LatticeFacts facts = detail::latticeFacts(LatticeKind::simplex, false);
  EXPECT_LE(largest / detail::kSimplexRms, facts.high);
  EXPECT_GE(largest / detail::kSimplexRms, facts.high - 0.002);
}

/// A lattice without turn, so that random points of other functions can be compared.
const detail::PerlinLattice kStraight{Mat3f::identity(), {}, 0};

TEST(WorleyNoise, IsTheDistanceToTheNearestFeaturePoints) {
  // Feature points are where the noise is least: found from any start by walking down its gradient by its own
  // distance. Then F1 of a point must be the least distance to those found around it.
  const detail::LatticeNoise f1{LatticeKind::worley, kStraight, false, {}};
  const detail::LatticeNoise difference{LatticeKind::worleyDifference, kStraight, false, {}};
  const auto distance = [&](const Vec3f& p, Vec3f* way) {
    Vec3f g;
    const float d = detail::latticeNoiseScalar(f1, p, &g) * detail::kWorleyRms + detail::kWorleyMean;
    *way = g * (-detail::kWorleyRms * d);
    return d;
  };
  std::vector<Vec3f> found;
  std::mt19937 random(2);
  const Points starts = test::randomPoints({{-2, -2, -2}, {3, 3, 3}}, 20000, random);
  for (std::size_t i = 0; i < starts.size(); ++i) {
    Vec3f way;
    if (distance(starts[i], &way) >= 1.499f) continue;
    const Vec3f p = starts[i] + way;
    bool known = false;
    for (const Vec3f& q : found) known = known || length(q - p) < 1e-4f;
    if (!known) found.push_back(p);
  }
  // One per cell, in the cells that the starts reach: at least those of the 5 x 5 x 5 inside.
  int inside = 0;
  for (const Vec3f& q : found) inside += std::min({q.x, q.y, q.z}) > -2 && std::max({q.x, q.y, q.z}) < 3;
  EXPECT_EQ(inside, 125);
  const Points points = test::randomPoints({{0, 0, 0}, {1, 1, 1}}, 2000, random);
  for (std::size_t i = 0; i < points.size(); ++i) {
    float first = 1.5f, second = 1.5f;
    for (const Vec3f& q : found) {
      const float d = length(q - points[i]);
      if (d < first)
        second = first, first = d;
      else
        second = std::min(second, d);
    }
    Vec3f unused;
    EXPECT_NEAR(distance(points[i], &unused), first, 2e-4);
    const float walls = detail::latticeNoiseScalar(difference, points[i], nullptr);
    EXPECT_NEAR(walls * detail::kWorleyDifferenceRms + detail::kWorleyDifferenceMean, second - first, 4e-4);
  }
}

TEST(EveryNoise, OfPerlinAtRestAreThoseOfPerlin) {
  std::mt19937 random(4);
  const Points points = test::randomPoints(kWide, 1000, random);
  EXPECT_EQ(test::evaluate(noise({.frequency = 3, .seed = 9}), points).data,
            test::evaluate(perlin({.frequency = 3, .seed = 9}), points).data);
  const FractalSumOptions octaves{.octaves = 3, .frequency = 2, .seed = 5};
  EXPECT_EQ(test::evaluate(fractalSum(NoiseOptions{}, octaves), points).data,
            test::evaluate(fractalSum(octaves), points).data);
}

TEST(EveryNoise, AreFoundByName) {
  EXPECT_EQ(noiseNames(), "perlin, simplex, worley, worley_difference, value, gabor, fft");
  for (const NoiseKind kind : noiseKinds()) EXPECT_EQ(noiseKindOf(noiseName(kind)), kind);
  try {
    noiseKindOf("perln");
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(std::string(e.what()), "noise: unknown kind 'perln', must be one of " + noiseNames());
  }
}

TEST(EveryNoise, RefuseOptionsOutsideTheirRange) {
  const float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
  for (const NoiseKind kind : noiseKinds()) {
    for (const float frequency : {0.0f, -1.0f, inf, nan})
      EXPECT_THROW(noise({.kind = kind, .frequency = frequency}), Error);
    EXPECT_THROW(noise({.kind = kind, .offset = Vec3f{0, nan, 0}}), Error);
    EXPECT_THROW(noise({.kind = kind, .rotation = Mat3f::scaling(2)}), Error);
    EXPECT_THROW(noise({.kind = kind, .time = inf}), Error);
    for (const float period : {0.0f, -2.0f, inf, nan})
      EXPECT_THROW(noise({.kind = kind, .time = 1.0f, .period = period}), Error);
    EXPECT_THROW(fractalSum({.kind = kind}, {.octaves = 0}), Error);
  }
  EXPECT_THROW(noise({.kind = NoiseKind(99)}), Error);
  EXPECT_THROW(curlNoise({.kind = NoiseKind::worley}), Error);
  EXPECT_THROW(curlNoise({.kind = NoiseKind::worleyDifference}), Error);
  const auto spectral = [](const SpectrumOptions& s) { noise({.kind = NoiseKind::spectral, .spectrum = s}); };
  EXPECT_THROW(spectral({.exponent = nan}), Error);
  EXPECT_THROW(spectral({.exponent = 17}), Error);
  EXPECT_THROW(spectral({.lowest = 0}), Error);
  EXPECT_THROW(spectral({.lowest = 3, .highest = 2}), Error);
  EXPECT_THROW(spectral({.highest = inf}), Error);
  EXPECT_THROW(spectral({.tile = -1}), Error);
  EXPECT_THROW(spectral({.tile = 16}), Error);                         // too few nodes per shortest wave
  EXPECT_THROW(spectral({.lowest = 0.01f, .highest = 0.02f}), Error);  // no wave fits the tile
  EXPECT_THROW(spectral({.resolution = 100}), Error);
  EXPECT_THROW(spectral({.resolution = 1024}), Error);
  EXPECT_NO_THROW(spectral({.lowest = 0.125f, .highest = 0.125f, .resolution = 16}));
}

}  // namespace
}  // namespace nephele

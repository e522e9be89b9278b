#include "nephele/modeling/noise/noises.h"

#include <fftw3.h>
#include <gtest/gtest.h>

#include <complex>
#include <thread>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/noise/detail/spectral_noise.h"
#include "nephele/modeling/noise/lattice_noise.h"
#include "nephele/modeling/noise/noise_draw.h"
#include "tests/support/check_field.h"
#include "tests/support/each_target.h"

namespace nephele {
namespace {

using detail::LatticeKind;
using test::Points;

constexpr LatticeKind kLatticeKinds[] = {
    LatticeKind::perlin, LatticeKind::simplex,          LatticeKind::value,
    LatticeKind::worley, LatticeKind::worleyDifference, LatticeKind::gabor};

/// Many cells, so that samples are nearly independent.
const Box kWide{{-500, -500, -500}, {500, 500, 500}};

// A sanitized program is some ten times slower.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr std::size_t kSamples = 1000000;
#else
constexpr std::size_t kSamples = 10000000;
#endif

struct Statistics {
  double mean = 0, rms = 0, low = 1e9, high = -1e9;
};

/// Of random points in kWide; the same at any thread count.
Statistics statistics(const ScalarField& field, std::size_t count) {
  constexpr std::size_t kPiece = 50000;
  std::vector<Statistics> pieces(count / kPiece);
  parallelFor(pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      std::mt19937 random(unsigned(p) + 1);
      const Points points = test::randomPoints(kWide, kPiece, random);
      const auto values = test::evaluate(field, points);
      Statistics& s = pieces[p];
      for (const float v : values.data[0]) {
        s.mean += v;
        s.rms += double(v) * v;
        s.low = std::min(s.low, double(v));
        s.high = std::max(s.high, double(v));
      }
    }
  });
  Statistics all;
  for (const Statistics& s : pieces) {
    all.mean += s.mean;
    all.rms += s.rms;
    all.low = std::min(all.low, s.low);
    all.high = std::max(all.high, s.high);
  }
  all.mean /= double(count);
  all.rms = std::sqrt(all.rms / double(count));
  return all;
}

/// A small tile, for tests that do not look at the spectrum.
SpectrumOptions smallSpectrum() {
  return {.lowest = 0.5f, .highest = 2, .tile = 8, .resolution = 64};
}

NoiseOptions optionsOf(NoiseKind kind, bool moves) {
  NoiseOptions o{.kind = kind, .seed = 7, .spectrum = smallSpectrum()};
  if (moves) o.time = 3.7f;
  return o;
}

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

TEST_P(MovingNoises, AreOtherNoisesAfterAWhile) {
  NoiseOptions a = optionsOf(GetParam(), true), b = a;
  b.time = *a.time + 2;
  // Independent noises of unit rms differ by sqrt(2).
  EXPECT_GT(difference(a, b).first, 0.9);
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

TEST(SpectralNoise, LanesEqualTheScalarTruthBitForBit) {
  const detail::SpectralTile tile = detail::synthesise({3, 0.5f, 2, 4, 32}, 5, 0, 0);
  std::mt19937 random(9);
  const float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
  for (const float reach : {2.0f, 1e6f, 1e12f}) {
    const detail::PerlinLattice lattice{Mat3f::rotation({1, 2, 3}, 0.7f), {3.25f, -17.5f, 99}, 0};
    Points points = test::randomPoints({{-reach, -reach, -reach}, {reach, reach, reach}}, kBlockSize, random);
    points.set(10, {nan, 1, 2});
    points.set(11, {inf, -inf, 0});
    alignas(64) float x[3][kBlockSize], v[kBlockSize], w[kBlockSize], g[3][kBlockSize];
    for (int i = 0; i < kBlockSize; ++i) x[0][i] = points.x[i], x[1][i] = points.y[i], x[2][i] = points.z[i];
    const float* const in[3] = {x[0], x[1], x[2]};
    float* const out[3] = {g[0], g[1], g[2]};
    test::forEachTarget([&] {
      detail::spectralLanes(tile, lattice, in, v, nullptr, kBlockSize);
      detail::spectralLanes(tile, lattice, in, w, out, kBlockSize);
      for (int i = 0; i < kBlockSize; ++i) {
        Vec3f gradient;
        const float truth = detail::spectralScalar(tile, lattice, points[i], &gradient);
        ASSERT_TRUE(std::isfinite(truth));
        ASSERT_EQ(v[i], truth) << reach << " " << i;
        ASSERT_EQ(w[i], truth) << reach << " " << i;
        for (int k = 0; k < 3; ++k) ASSERT_EQ(g[k][i], gradient[k]) << reach << " " << i;
      }
    });
  }
}

/// Variance of a tile between i and i + 1 cycles per tile, and how many independent waves lie there.
struct Shell {
  double variance = 0;
  int waves = 0;
};

std::vector<Shell> spectrumOf(const detail::SpectralTile& tile) {
  const int n = tile.resolution, half = n / 2 + 1;
  std::vector<float> values(std::size_t(n) * n * n);
  std::vector<std::complex<float>> waves(std::size_t(n) * n * half);
  const fftwf_plan plan = fftwf_plan_dft_r2c_3d(
      n, n, n, values.data(), reinterpret_cast<fftwf_complex*>(waves.data()), FFTW_ESTIMATE);
  const detail::PerlinLattice nodes{Mat3f::scaling(1 / tile.nodesPerUnit), {}, 0};
  for (int z = 0; z < n; ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x)
        values[(std::size_t(z) * n + y) * n + x] =
            detail::spectralScalar(tile, nodes, {float(x), float(y), float(z)}, nullptr);
  fftwf_execute(plan);
  fftwf_destroy_plan(plan);
  const double total = double(n) * n * n;
  std::vector<Shell> shells(static_cast<std::size_t>(n));
  for (int z = 0; z < n; ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < half; ++x) {
        const double b = y <= n / 2 ? y : y - n, c = z <= n / 2 ? z : z - n;
        // The plane x = 0 holds each wave twice.
        Shell& shell = shells[std::size_t(std::sqrt(x * x + b * b + c * c))];
        const double square = std::norm(std::complex<double>(waves[(std::size_t(z) * n + y) * half + x]));
        shell.variance += (x == 0 || x == n / 2 ? 1 : 2) * square / (total * total);
        shell.waves += x != 0 || b > 0 || (b == 0 && c > 0);
      }
  return shells;
}

TEST(SpectralNoise, HasTheSpectrumThatWasAsked) {
  for (const float exponent : {0.0f, 11.0f / 3, 6.0f}) {
    // Tile 8: waves from 4 to 16 cycles per tile.
    const detail::Spectrum asked{exponent, 0.5f, 2, 8, 64};
    const auto shells = spectrumOf(detail::synthesise(asked, 11, 2.5f, 0));
    // What the shells should hold, up to a factor, wave by wave.
    std::vector<double> expected(shells.size());
    double sum = 0, measured = 0;
    for (int z = -16; z <= 16; ++z)
      for (int y = -16; y <= 16; ++y)
        for (int x = -16; x <= 16; ++x) {
          const double wave = std::sqrt(double(x * x + y * y + z * z));
          if (wave < 4 || wave > 16) continue;
          expected[std::size_t(wave)] += std::pow(wave, -double(exponent));
          sum += std::pow(wave, -double(exponent));
        }
    for (const Shell& s : shells) measured += s.variance;
    for (std::size_t i = 0; i < shells.size(); ++i) {
      if (expected[i] == 0) {
        EXPECT_LT(shells[i].variance, 1e-12) << i;
        continue;
      }
      // The strength of a wave has a standard deviation as large as its mean; the shell of 16 holds only
      // waves of exactly 16 cycles. The largest shell weighs on the common factor as well.
      int waves = shells[i].waves;
      if (i == 16) waves = 3;
      EXPECT_NEAR(shells[i].variance / measured * sum / expected[i], 1, 4 / std::sqrt(double(waves)) + 0.15)
          << "exponent " << exponent << " wave number " << i;
    }
  }
}

TEST(SpectralNoise, IsNormallyDistributed) {
  // Of 10^6 values of many tiles: third and fourth moments of a normal distribution are 0 and 3. A tile of
  // waves 4 to 16 at exponent 0 holds thousands of independent numbers; so few at their standard errors.
  double third = 0, fourth = 0;
  constexpr int kTiles = 8;
  for (int seed = 0; seed < kTiles; ++seed) {
    const detail::SpectralTile tile = detail::synthesise({0, 0.5f, 2, 8, 64}, unsigned(seed), 0, 0);
    double a = 0, b = 0;
    int n = 0;
    for (float z = 0; z < 8; z += 0.53f)
      for (float y = 0; y < 8; y += 0.53f)
        for (float x = 0; x < 8; x += 0.53f, ++n) {
          const double v = detail::spectralScalar(tile, kStraight, {x, y, z}, nullptr);
          a += v * v * v;
          b += v * v * v * v;
        }
    third += a / n / kTiles;
    fourth += b / n / kTiles;
  }
  // 27 000 samples, of variances 15 and 96: standard errors 0.024 and 0.06.
  EXPECT_NEAR(third, 0, 0.1);
  EXPECT_NEAR(fourth, 3, 0.25);
}

TEST(SpectralNoise, RepeatsAfterItsTile) {
  const ScalarField f = noise({.kind = NoiseKind::spectral,
                               .frequency = 2,
                               .offset = Vec3f{},
                               .rotation = Mat3f::identity(),
                               .spectrum = smallSpectrum()});
  for (const Vec3f p : {Vec3f{0.1f, 0.2f, 0.3f}, Vec3f{-1.7f, 3.9f, 0.01f}}) {
    EXPECT_NEAR(f(p), f(p + Vec3f{4, 0, 0}), 1e-4);
    EXPECT_NEAR(f(p), f(p + Vec3f{0, -8, 4}), 1e-4);
    EXPECT_GT(std::abs(f(p) - f(p + Vec3f{2, 0, 0})), 1e-3);
  }
}

TEST(SpectralNoise, ResolutionOnlySharpensTheSameField) {
  NoiseOptions coarse{.kind = NoiseKind::spectral, .spectrum = smallSpectrum()}, fine = coarse;
  fine.spectrum.resolution = 128;
  std::mt19937 random(6);
  const Points points = test::randomPoints({{-4, -4, -4}, {4, 4, 4}}, 2000, random);
  const auto u = test::evaluate(noise(coarse), points), v = test::evaluate(noise(fine), points);
  // A cubic spline of 4 nodes per wave is off by up to some percent of that wave, and few waves are so short.
  for (std::size_t i = 0; i < points.size(); ++i) EXPECT_NEAR(u.data[0][i], v.data[0][i], 0.05);
}

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

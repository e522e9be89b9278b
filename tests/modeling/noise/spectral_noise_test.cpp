#include "nephele/modeling/noise/detail/spectral_noise.h"

#include <gtest/gtest.h>

#include <complex>
#include <numbers>

#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/noise/detail/inverse_fft.h"
#include "nephele/modeling/noise/noise.h"
#include "tests/modeling/noise/noise_statistics.h"
#include "tests/support/check_field.h"
#include "tests/support/each_target.h"

namespace nephele {
namespace {

using test::Points;
using test::smallSpectrum;

/// Lattice coordinates that are world coordinates.
const detail::PerlinLattice kStraight{Mat3f::identity(), {}, 0};

TEST(InverseFft, SumsWavesAsTheFormulaSays) {
  // Each wave is 2 |w| cos(2 pi (a x + b y + c z) / n + arg w), with its opposite; alone where it is its own.
  struct Wave {
    int a, b, c;
    std::complex<double> w;
  };
  for (const int n : {16, 32, 64, 128}) {
    const Wave all[] = {{0, 0, 0, {0.7, 0}},       {1, 0, 0, {0.3, -0.4}},
                        {3, 2, -5, {-1, 0.5}},     {n / 2 - 1, -1, 4, {0.2, 0.9}},
                        {0, 5, -3, {0.6, -0.1}},   {0, 0, 7, {0, 1}},
                        {n / 4, -n / 4, 2, {1, 1}}};
    const int half = n / 2 + 1;
    std::vector<std::complex<float>> waves(std::size_t(n) * n * half);
    const auto place = [&](int a, int b, int c) -> std::complex<float>& {
      return waves[(std::size_t(c & (n - 1)) * n + std::size_t(b & (n - 1))) * std::size_t(half) +
                   std::size_t(a)];
    };
    for (const Wave& wave : all) {
      place(wave.a, wave.b, wave.c) = std::complex<float>(wave.w);
      if (wave.a == 0) place(0, -wave.b, -wave.c) = std::conj(std::complex<float>(wave.w));
    }
    const std::vector<float> values = detail::sumOfWaves(waves, n);
    ASSERT_EQ(values.size(), std::size_t(n) * n * n);
    std::mt19937 random(3);
    for (int i = 0; i < 2000; ++i) {
      const int x = int(random() % unsigned(n)), y = int(random() % unsigned(n)),
                z = int(random() % unsigned(n));
      double expected = 0;
      for (const Wave& wave : all) {
        const double turns = double(wave.a) * x + double(wave.b) * y + double(wave.c) * z;
        const double own = (wave.w * std::polar(1.0, 2 * std::numbers::pi * turns / n)).real();
        expected += wave.a == 0 && wave.b == 0 && wave.c == 0 ? own : 2 * own;
      }
      // Of the order of log2(n^3) roundings of 6e-8 of sums up to 12.
      EXPECT_NEAR(values[(std::size_t(z) * n + y) * n + x], expected, 1e-5) << n;
    }
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

/// Sums over x, y, z of values[z][y][x] e^(-i 2 pi (a x + b y + c z) / n), as [c][b][a]: axis by axis, by the
/// definition, so that nothing of a library's transform is trusted.
std::vector<std::complex<double>> transformOf(const std::vector<double>& values, int n) {
  std::vector<std::complex<double>> turns;
  for (int i = 0; i < n; ++i) turns.push_back(std::polar(1.0, -2 * std::numbers::pi * i / n));
  std::vector<std::complex<double>> result(values.begin(), values.end());
  for (int stride = 1; stride < n * n * n; stride *= n)
    parallelFor(std::size_t(n) * n, 16, [&](std::size_t begin, std::size_t end) {
      std::vector<std::complex<double>> line(std::size_t(n), 0.0);
      for (int row = int(begin); row < int(end); ++row) {
        const int first = row / stride * stride * n + row % stride;
        for (int k = 0; k < n; ++k) {
          line[std::size_t(k)] = 0;
          for (int i = 0; i < n; ++i)
            line[std::size_t(k)] += result[std::size_t(first + i * stride)] * turns[std::size_t(i * k % n)];
        }
        for (int k = 0; k < n; ++k) result[std::size_t(first + k * stride)] = line[std::size_t(k)];
      }
    });
  return result;
}

std::vector<Shell> spectrumOf(const detail::SpectralTile& tile) {
  const int n = tile.resolution;
  std::vector<double> values(std::size_t(n) * n * n);
  const detail::PerlinLattice nodes{Mat3f::scaling(1 / tile.nodesPerUnit), {}, 0};
  for (int z = 0; z < n; ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x)
        values[(std::size_t(z) * n + y) * n + x] =
            detail::spectralScalar(tile, nodes, {float(x), float(y), float(z)}, nullptr);
  const auto waves = transformOf(values, n);
  const double total = double(n) * n * n;
  std::vector<Shell> shells(static_cast<std::size_t>(n));
  for (int z = 0; z < n; ++z)
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) {
        const auto signedWave = [n](int i) { return double(i <= n / 2 ? i : i - n); };
        const double a = signedWave(x), b = signedWave(y), c = signedWave(z);
        Shell& shell = shells[std::size_t(std::sqrt(a * a + b * b + c * c))];
        shell.variance += std::norm(waves[(std::size_t(z) * n + y) * n + x]) / (total * total);
        // A wave and its opposite are one.
        shell.waves += a > 0 || (a == 0 && (b > 0 || (b == 0 && c > 0)));
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

}  // namespace
}  // namespace nephele

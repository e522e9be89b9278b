// A Gaussian random field: independent normal amplitudes for all waves that fit the tile, each as strong as
// the spectrum asks, turned into values by one inverse FFT. Waves are divided by what sampling a cubic
// B-spline does to them, so that the spline takes their values on the nodes. The variance and slope of the
// spline between the nodes are known for each wave in closed form (sums of shifted sinc powers are B-splines
// of degree 7 and 5 on whole numbers), which gives exactly unit rms over the tile.
//
// Time: each wave has two amplitudes and goes from one to the other, a cos + b sin, at one of 16 rates:
// normal with the same variance at all times.
//
// Amplitudes are drawn from a hash of the wave's whole numbers: the same whatever the resolution.
// Known limits: the field repeats after one tile; anisotropy of the tile's cube shows for waves as long as
// it.
#include "nephele/modeling/noise/detail/spectral_noise.h"

#include <algorithm>
#include <cmath>
#include <complex>

#include "nephele/modeling/noise/detail/inverse_fft.h"
#include "nephele/modeling/noise/lattice_noise.h"
#include "nephele/modeling/noise/noise_draw.h"

namespace nephele::detail {
namespace {

constexpr double kTurn = 2 * 3.14159265358979323846;

/// What belongs to one axis of a wave of `turns` cycles per node.
struct AxisFactors {
  double sampling;  ///< The spline with these coefficients, on the nodes.
  double square;    ///< Its mean square.
  double slope;     ///< Mean square of its slope, per node.
};

AxisFactors axisFactors(int wave, int resolution) {
  const double w = kTurn * wave / resolution, s = 2 * std::sin(w / 2);
  return {(4 + 2 * std::cos(w)) / 6,
          (2416 + 2382 * std::cos(w) + 240 * std::cos(2 * w) + 2 * std::cos(3 * w)) / 5040,
          s * s * (66 + 52 * std::cos(w) + 2 * std::cos(2 * w)) / 120};
}

/// Two independent normal numbers (Box and Muller).
std::complex<double> normalPair(Draw& draw) {
  const double u = (draw.bits() + 0.5) * 0x1p-32, v = draw.bits() * 0x1p-32;
  return std::polar(std::sqrt(-2 * std::log(u)), kTurn * v);
}

/// The amplitude of a wave before its strength: of mean square 2.
std::complex<double> amplitude(int x, int y, int z, std::uint32_t seed, const NoiseClock& clock) {
  const auto bits = [](int i) { return std::uint64_t(std::uint32_t(i) & 0x1fffffu); };
  Draw waveDraw(std::uint32_t(((bits(x) << 42 | bits(y) << 21 | bits(z)) * 0xd6e8feb86659fd93ull) >> 32));
  Draw draw(waveDraw.bits() ^ seed);
  const std::complex<double> a = normalPair(draw), b = normalPair(draw);
  const std::uint32_t rate = draw.bits() & 15u;
  return a * double(clock.cosine[rate]) + b * double(clock.sine[rate]);
}

/// Bounds of values and slopes, by the coefficients.
void measure(SpectralTile& tile) {
  const int n = tile.resolution, row = tile.rowLength();
  const float* const c = tile.coefficients.data();
  tile.low = tile.high = c[0];
  float change[3] = {0, 0, 0};
  for (int z = 0; z < n; ++z)
    for (int y = 0; y < n; ++y) {
      const float* const here = c + std::size_t(z * n + y) * row;
      const float* const nextY = c + std::size_t(z * n + ((y + 1) & (n - 1))) * row;
      const float* const nextZ = c + std::size_t(((z + 1) & (n - 1)) * n + y) * row;
      for (int x = 0; x < n; ++x) {
        tile.low = std::min(tile.low, here[x]);
        tile.high = std::max(tile.high, here[x]);
        change[0] = std::max(change[0], std::abs(here[x + 1] - here[x]));
        change[1] = std::max(change[1], std::abs(nextY[x] - here[x]));
        change[2] = std::max(change[2], std::abs(nextZ[x] - here[x]));
      }
    }
  // Sums of weights that are 1 to rounding.
  tile.low -= 1e-5f;
  tile.high += 1e-5f;
  tile.steepest = 1.0001f * tile.nodesPerUnit * length(Vec3f{change[0], change[1], change[2]});
}

}  // namespace

SpectralTile synthesise(const Spectrum& spectrum, std::uint32_t seed, float time, float period) {
  const int n = spectrum.resolution, half = n / 2 + 1;
  SpectralTile tile;
  tile.resolution = n;
  tile.nodesPerUnit = float(n) / spectrum.tile;
  const NoiseClock clock = noiseClock(time, period);
  std::vector<std::complex<float>> waves(std::size_t(n) * n * half);
  std::vector<AxisFactors> factors(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) factors[std::size_t(i)] = axisFactors(i, n);
  const double lowest = double(spectrum.lowest) * spectrum.tile,
               highest = double(spectrum.highest) * spectrum.tile;
  const int reach = int(std::floor(highest));
  double variance = 0, slopes = 0;
  const auto index = [&](int i) { return std::size_t(i & (n - 1)); };
  for (int z = -reach; z <= reach; ++z)
    for (int y = -reach; y <= reach; ++y)
      for (int x = 0; x <= reach; ++x) {
        const double wave = std::sqrt(double(x) * x + double(y) * y + double(z) * z);
        // Room for rounding: waves exactly at a limit belong to the band.
        if (wave < lowest * (1 - 1e-6) || wave > highest * (1 + 1e-6) || wave == 0) continue;
        // A wave and its opposite are one: in the plane x = 0 both are stored.
        const bool opposite = x == 0 && (y < 0 || (y == 0 && z < 0));
        const std::complex<double> a =
            opposite ? std::conj(amplitude(0, -y, -z, seed, clock)) : amplitude(x, y, z, seed, clock);
        const double strength = std::pow(wave / lowest, -0.5 * double(spectrum.exponent));
        const AxisFactors &fx = factors[index(x)], &fy = factors[index(y)], &fz = factors[index(z)];
        const std::complex<double> c = a * (strength / (fx.sampling * fy.sampling * fz.sampling));
        waves[(index(z) * std::size_t(n) + index(y)) * std::size_t(half) + index(x)] = std::complex<float>(c);
        const double square = std::norm(c) * (x == 0 ? 1 : 2);
        variance += square * fx.square * fy.square * fz.square;
        slopes += square * (fx.slope * fy.square * fz.square + fx.square * fy.slope * fz.square +
                            fx.square * fy.square * fz.slope);
      }
  const std::vector<float> values = sumOfWaves(waves, n);
  const float scale = float(1 / std::sqrt(variance));
  tile.gradientRms = float(std::sqrt(slopes / variance / 3) * n / double(spectrum.tile));
  const int row = tile.rowLength();
  tile.coefficients.resize(std::size_t(n) * n * row);
  for (std::size_t r = 0; r < std::size_t(n) * n; ++r)
    for (int x = 0; x < row; ++x)
      tile.coefficients[r * std::size_t(row) + std::size_t(x)] =
          values[r * std::size_t(n) + index(x)] * scale;
  measure(tile);
  return tile;
}

}  // namespace nephele::detail

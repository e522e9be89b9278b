// Perlin noise: the scalar truth against lanes, on random points (every point in another cell) and on
// coherent ones (along rows of a fine grid). The usual scalar code, with a table of permutations, stands
// beside them as the loop that others would write. Then every kind of noise, still and moving, with and
// without gradient: the truth, one point at a time, and lanes of random points. Items per second are points.
#include <benchmark/benchmark.h>

#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "nephele/modeling/noise/detail/noise_kernels.h"
#include "nephele/modeling/noise/detail/spectral_noise.h"
#include "nephele/modeling/noise/lattice_noise.h"
#include "nephele/modeling/noise/noise.h"

namespace nephele {
namespace {

constexpr std::size_t kPoints = 1 << 14;

struct Data {
  std::vector<float> x, y, z, values, gx, gy, gz;

  explicit Data(bool coherent) {
    for (auto* lane : {&x, &y, &z, &values, &gx, &gy, &gz}) lane->resize(kPoints);
    std::mt19937 random(1);
    std::uniform_real_distribution<float> coordinate(-500, 500);
    for (std::size_t i = 0; i < kPoints; ++i) {
      if (coherent) {
        x[i] = 0.02f * float(i % 128), y[i] = 0.02f * float(i / 128), z[i] = 0.3f;
      } else {
        x[i] = coordinate(random), y[i] = coordinate(random), z[i] = coordinate(random);
      }
    }
  }
  PointSpans points() const { return {x, y, z}; }
};

/// Improved noise with a table, one point at a time.
class TableNoise {
 public:
  TableNoise() : table_(512) {
    std::iota(table_.begin(), table_.begin() + 256, 0);
    std::shuffle(table_.begin(), table_.begin() + 256, std::mt19937(1));
    std::copy_n(table_.begin(), 256, table_.begin() + 256);
  }
  float operator()(float x, float y, float z) const {
    const float fx = std::floor(x), fy = std::floor(y), fz = std::floor(z);
    const int i = int(fx) & 255, j = int(fy) & 255, k = int(fz) & 255;
    x -= fx, y -= fy, z -= fz;
    const float u = fade(x), v = fade(y), w = fade(z);
    const int a = table_[i] + j, b = table_[i + 1] + j;
    const int aa = table_[a & 511] + k, ab = table_[(a + 1) & 511] + k, ba = table_[b & 511] + k,
              bb = table_[(b + 1) & 511] + k;
    const auto at = [&](int h) { return table_[h & 511]; };
    const float near = mix(v, mix(u, grad(at(aa), x, y, z), grad(at(ba), x - 1, y, z)),
                           mix(u, grad(at(ab), x, y - 1, z), grad(at(bb), x - 1, y - 1, z)));
    const float far = mix(v, mix(u, grad(at(aa + 1), x, y, z - 1), grad(at(ba + 1), x - 1, y, z - 1)),
                          mix(u, grad(at(ab + 1), x, y - 1, z - 1), grad(at(bb + 1), x - 1, y - 1, z - 1)));
    return mix(w, near, far);
  }

 private:
  static float fade(float t) { return t * t * t * (t * (t * 6 - 15) + 10); }
  static float mix(float t, float a, float b) { return a + t * (b - a); }
  static float grad(int hash, float x, float y, float z) {
    const int h = hash & 15;
    const float u = h < 8 ? x : y, v = h < 4 ? y : h == 12 || h == 14 ? x : z;
    return (h & 1 ? -u : u) + (h & 2 ? -v : v);
  }
  std::vector<int> table_;
};

void tablePerPoint(benchmark::State& state, bool coherent) {
  Data data(coherent);
  const TableNoise noise;
  for (auto _ : state) {
    for (std::size_t i = 0; i < kPoints; ++i) data.values[i] = noise(data.x[i], data.y[i], data.z[i]);
    benchmark::DoNotOptimize(data.values.data());
  }
  state.SetItemsProcessed(state.iterations() * std::int64_t(kPoints));
}
BENCHMARK_CAPTURE(tablePerPoint, random, false);
BENCHMARK_CAPTURE(tablePerPoint, coherent, true);

void scalarTruth(benchmark::State& state, bool coherent) {
  Data data(coherent);
  const detail::PerlinLattice lattice{Mat3f::identity(), {}, 1};
  for (auto _ : state) {
    for (std::size_t i = 0; i < kPoints; ++i)
      data.values[i] = detail::perlinScalar(lattice, {data.x[i], data.y[i], data.z[i]}, nullptr);
    benchmark::DoNotOptimize(data.values.data());
  }
  state.SetItemsProcessed(state.iterations() * std::int64_t(kPoints));
}
BENCHMARK_CAPTURE(scalarTruth, random, false);
BENCHMARK_CAPTURE(scalarTruth, coherent, true);

void batched(benchmark::State& state, bool coherent) {
  Data data(coherent);
  const ScalarField noise = perlin();
  for (auto _ : state) {
    noise.eval(data.points(), data.values);
    benchmark::DoNotOptimize(data.values.data());
  }
  state.SetItemsProcessed(state.iterations() * std::int64_t(kPoints));
}
BENCHMARK_CAPTURE(batched, random, false);
BENCHMARK_CAPTURE(batched, coherent, true);

void batchedWithGradient(benchmark::State& state, bool coherent) {
  Data data(coherent);
  const ScalarField noise = perlin();
  for (auto _ : state) {
    noise.evalGrad(data.points(), data.values, {{data.gx, data.gy, data.gz}});
    benchmark::DoNotOptimize(data.values.data());
  }
  state.SetItemsProcessed(state.iterations() * std::int64_t(kPoints));
}
BENCHMARK_CAPTURE(batchedWithGradient, random, false);
BENCHMARK_CAPTURE(batchedWithGradient, coherent, true);

constexpr detail::PerlinLattice kLattice{Mat3f::identity(), {}, 1};

/// Calls `scalar(point, gradient or null)` for each point, as a loop would.
template <class Scalar>
void perPoint(benchmark::State& state, bool gradient, const Scalar& scalar) {
  Data data(false);
  for (auto _ : state) {
    for (std::size_t i = 0; i < kPoints; ++i) {
      Vec3f g;
      data.values[i] = scalar(Vec3f{data.x[i], data.y[i], data.z[i]}, gradient ? &g : nullptr);
      data.gx[i] = g.x, data.gy[i] = g.y, data.gz[i] = g.z;
    }
    benchmark::DoNotOptimize(data.values.data());
    benchmark::DoNotOptimize(data.gx.data());
  }
  state.SetItemsProcessed(state.iterations() * std::int64_t(kPoints));
}

const detail::SpectralTile& tile() {
  const SpectrumOptions s;
  static const detail::SpectralTile made =
      detail::synthesise({s.exponent, s.lowest, s.highest, s.tile, s.resolution}, 1, 0, 0);
  return made;
}

void everyKindScalar(benchmark::State& state, NoiseKind kind, bool moves, bool gradient) {
  if (kind == NoiseKind::spectral)
    return perPoint(state, gradient,
                    [&](const Vec3f& p, Vec3f* g) { return detail::spectralScalar(tile(), kLattice, p, g); });
  using detail::LatticeKind;
  constexpr LatticeKind kinds[] = {LatticeKind::perlin,           LatticeKind::simplex, LatticeKind::worley,
                                   LatticeKind::worleyDifference, LatticeKind::value,   LatticeKind::gabor};
  const detail::LatticeNoise noise{kinds[int(kind)], kLattice, moves, detail::noiseClock(1.5f, 0)};
  perPoint(state, gradient,
           [&](const Vec3f& p, Vec3f* g) { return detail::latticeNoiseScalar(noise, p, g); });
}

void everyKindLanes(benchmark::State& state, NoiseKind kind, bool moves, bool gradient) {
  Data data(false);
  NoiseOptions options{.kind = kind};
  if (moves) options.time = 1.5f;
  const ScalarField field = noise(options);
  for (auto _ : state) {
    if (gradient) {
      field.evalGrad(data.points(), data.values, {{data.gx, data.gy, data.gz}});
    } else {
      field.eval(data.points(), data.values);
    }
    benchmark::DoNotOptimize(data.values.data());
  }
  state.SetItemsProcessed(state.iterations() * std::int64_t(kPoints));
}

/// One tile at the default resolution; items are nodes.
void synthesis(benchmark::State& state) {
  std::uint32_t seed = 0;
  const SpectrumOptions s;
  for (auto _ : state) {
    const auto made =
        detail::synthesise({s.exponent, s.lowest, s.highest, s.tile, s.resolution}, ++seed, 0, 0);
    benchmark::DoNotOptimize(made.coefficients.data());
  }
  state.SetItemsProcessed(state.iterations() * std::int64_t(s.resolution) * s.resolution * s.resolution);
}
BENCHMARK(synthesis)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace nephele

int main(int argumentCount, char** arguments) {
  using namespace nephele;
  for (const NoiseKind kind : noiseKinds())
    for (const bool moves : {false, true})
      for (const bool gradient : {false, true}) {
        // The tile of another time costs the same.
        if (kind == NoiseKind::spectral && moves) continue;
        const std::string name = std::string(noiseName(kind)) + (moves ? "/moving" : "/still") +
                                 (gradient ? "/gradient" : "/value");
        benchmark::RegisterBenchmark(("scalar/" + name).c_str(), everyKindScalar, kind, moves, gradient);
        benchmark::RegisterBenchmark(("lanes/" + name).c_str(), everyKindLanes, kind, moves, gradient);
      }
  benchmark::Initialize(&argumentCount, arguments);
  benchmark::RunSpecifiedBenchmarks();
}

// Marching, per sample: vectors against the scalar loop, by extinction; and how light and marching grow with
// the bricks that hold anything while the box around them grows with their cube.

#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>

#include "nephele/render/light/light_volume.h"
#include "nephele/render/march/march_kernels.h"
#include "nephele/render/march/raymarch.h"
#include "tests/support/density.h"
#include "tests/support/march_scene.h"
#include "tests/support/scalar_march.h"

namespace nephele {
namespace {

// A bumpy ball across `resolution` voxels, hollow, so that its bricks grow with the square of the resolution.
std::shared_ptr<BrickGrid> shell(int resolution) {
  const int n = resolution / 2;
  return test::densityGrid(test::voxels(1.0f / float(n)), {-n, -n, -n}, {n, n, n}, [](const Vec3f& p) {
    const float r = length(p) + 0.1f * std::sin(9 * p.x) * std::sin(8 * p.y) * std::sin(7 * p.z);
    return std::fmin(std::fmax(30 * (0.05f - std::fabs(r - 0.8f)), 0.0f), 1.0f);
  });
}

// A cube full of smoke from `low` to 1.
std::shared_ptr<BrickGrid> smoke(int resolution, int low) {
  const int n = resolution / (1 - low);
  return test::densityGrid(
      test::voxels(1.0f / float(n)), {low * n, low * n, low * n}, {n - 1, n - 1, n - 1},
      [](const Vec3f& p) { return 1 + std::sin(20 * p.x) * std::sin(23 * p.y) * std::sin(17 * p.z); });
}

// Rays of a 64 x 64 picture through a shell, or of `across` x `across` pixels of its middle, for the kernels
// alone.
struct Rays {
  std::shared_ptr<const BrickGrid> grid;
  RenderVolume volume{grid};
  test::SunColumns sun{{volume, {0.3f, 0.8f, 0.4f}}};
  MarchScene scene = test::sceneOf(volume, sun);
  std::vector<MarchRay> rays;
  std::vector<MarchResult> results;

  Rays(std::shared_ptr<const BrickGrid> density, int octaves, float extinction, int across = 64)
      : grid(std::move(density)) {
    scene.octaves = octaves;
    scene.attenuation[1] = 0.9f, scene.attenuation[2] = 0.7f;
    scene.extinction = extinction;
    scene.step = scene.uniformStep = grid->voxelSize();
    scene.leastStep = grid->voxelSize() / 8;
    for (int i = 0; i != across * across; ++i) {
      const Vec3f origin{float(i % across - across / 2) / 32, float(i / across - across / 2) / 32, -1.0f},
          direction = normalize(Vec3f{0.1f, 0.05f, 1});
      const auto in = [&](const Affine& map, const Vec3i& first) {
        return LatticeRay{map(origin) - Vec3f(first * 8), map.linear * direction};
      };
      MarchRay& ray = rays.emplace_back();
      ray.density = in(grid->worldToIndex(), grid->firstBrick());
      ray.suns[0] = in(sun.light.worldToLattice(), sun.light.firstBrick());
      ray.length = 2;
      for (int n = 0; n != 3; ++n) ray.weight[0][0][n] = 0.1f;
    }
    results.resize(rays.size());
  }
};

template <class March>
void march(benchmark::State& state, Rays rays, March&& kernel) {
  std::int64_t samples = 0;
  for (auto _ : state) {
    kernel(rays.scene, rays.rays, rays.results);
    for (const MarchResult& result : rays.results) samples += result.samples;
  }
  state.SetItemsProcessed(samples);
}

void marchVectors(benchmark::State& state) {
  march(state, {shell(128), 3, float(state.range(0))},
        [](const auto& scene, const auto& rays, auto& results) { marchRays(scene, rays, results); });
}
void marchScalar(benchmark::State& state) {
  march(state, {shell(128), 3, float(state.range(0))},
        [](const auto& scene, const auto& rays, auto& results) {
          test::marchRaysScalar(scene, rays, results);
        });
}
// One tile of a picture through thin smoke, single scattering, again and again, so that what it reads fits
// into the second-level cache: what a sample costs at least.
void marchTile(benchmark::State& state) {
  march(state, {smoke(64, -1), 1, 0.1f, 16},
        [](const auto& scene, const auto& rays, auto& results) { marchRays(scene, rays, results); });
}
BENCHMARK(marchTile)->Unit(benchmark::kMillisecond);
BENCHMARK(marchVectors)->Arg(1)->Arg(10)->Arg(100)->Unit(benchmark::kMillisecond);
BENCHMARK(marchScalar)->Arg(1)->Arg(10)->Arg(100)->Unit(benchmark::kMillisecond);

// What the march reads made of a density, and of a sun's columns in their own memory. Items: voxels.
void codeDensity(benchmark::State& state) {
  const int n = int(state.range(0));
  const auto grid = smoke(n, 0);
  for (auto _ : state) benchmark::DoNotOptimize(CodedBricks(*grid));
  state.SetItemsProcessed(state.iterations() * n * n * n);
}
void codeSun(benchmark::State& state) {
  const int n = int(state.range(0));
  const LightVolume light(RenderVolume(smoke(n, 0)), {0.3f, 0.8f, 0.4f});
  for (auto _ : state) {
    state.PauseTiming();
    auto coded = std::make_unique<LightVolume>(light);
    state.ResumeTiming();
    coded->code();
    state.PauseTiming();
    coded.reset();
    state.ResumeTiming();
  }
  state.SetItemsProcessed(state.iterations() * n * n * n);
}
BENCHMARK(codeDensity)->Arg(128)->Arg(256)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(codeSun)->Arg(128)->Arg(256)->Unit(benchmark::kMillisecond)->UseRealTime();

// Items: bricks that hold density.
void sunOfAShell(benchmark::State& state) {
  const RenderVolume volume(shell(int(state.range(0))));
  for (auto _ : state) benchmark::DoNotOptimize(LightVolume(volume, {0.3f, 0.8f, 0.4f}));
  state.SetItemsProcessed(state.iterations() * std::int64_t(volume.occupiedBricks().size()));
}
BENCHMARK(sunOfAShell)->Arg(64)->Arg(128)->Arg(256)->Unit(benchmark::kMillisecond)->UseRealTime();

// A cube full of smoke. Items: voxels.
void sunOfSmoke(benchmark::State& state) {
  const int n = int(state.range(0));
  const RenderVolume volume(smoke(n, 0));
  // Once before: virtual machines may take ten times as long for memory that was never touched.
  benchmark::DoNotOptimize(LightVolume(volume, {0.3f, 0.8f, 0.4f}));
  for (auto _ : state) benchmark::DoNotOptimize(LightVolume(volume, {0.3f, 0.8f, 0.4f}));
  state.SetItemsProcessed(state.iterations() * n * n * n);
}
BENCHMARK(sunOfSmoke)->Arg(128)->Arg(256)->Arg(512)->Unit(benchmark::kMillisecond)->UseRealTime();

void pictureOfAShell(benchmark::State& state) {
  const RenderVolume volume(shell(int(state.range(0))));
  Medium medium;
  medium.extinction = defaultExtinction(volume);
  const Lights lights{{{}}, {0.1f, 0.2f, 0.3f}};
  const Camera camera = Camera::framing(volume.outline(), 20, 10, {320, 240, 35});
  std::int64_t samples = 0;
  for (auto _ : state) samples += std::int64_t(renderImage(volume, medium, lights, camera).samples);
  state.SetItemsProcessed(samples);
  state.counters["occupied_bricks"] = double(volume.occupiedBricks().size());
}
BENCHMARK(pictureOfAShell)->Arg(64)->Arg(128)->Arg(256)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace nephele

BENCHMARK_MAIN();

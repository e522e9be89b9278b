// Cost of a frame against the number of steps before it: gridless, through every velocity since the start,
// and SELMA, one step of the map and a reading through it. The picture is 96^3 samples of the density, the
// velocities are grids of 64^3, one per frame, as a simulation leaves them.
#include <benchmark/benchmark.h>

#include <array>
#include <memory>
#include <vector>

#include "nephele/levelset/flow/advection.h"
#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/grid/grid_field.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"
#include "nephele/modeling/noise/noise.h"
#include "nephele/modeling/shape/shapes.h"

namespace nephele {
namespace {

constexpr float kSide = 64;
constexpr int kSamples = 96;

/// The velocity of a frame: whirls of half the box, up to about one voxel per frame.
VectorField velocityOf(int frame) {
  static std::vector<VectorField> frames;
  while (int(frames.size()) <= frame) {
    const VectorField u =
        curlNoise({.frequency = 2 / kSide, .seed = 7, .time = 0.05f * float(frames.size())}) *
        ScalarField(0.3f);
    frames.push_back(bake(u, {.voxelSize = 1, .box = {{0, 0, 0}, {kSide, kSide, kSide}}}));
  }
  return frames[std::size_t(frame)];
}

double bytesOf(const VectorField& baked) {
  double bytes = 0;
  for (const auto& grid : gridsOf(baked)) bytes += double(grid->memoryBytes());
  return bytes;
}

std::shared_ptr<const BrickGrid> cloud() {
  static const auto grid = gridOf(
      bake(smoothstep(-1.5f, 1.5f, sphere({kSide / 2, kSide / 2, kSide / 2}, kSide / 4)),
           {.voxelSize = 1, .box = Box{{0, 0, 0}, {kSide, kSide, kSide}}.expanded(8), .background = 0.0f}));
  return grid;
}

/// Reads `density` at the samples of the picture.
void takePicture(const ScalarField& density) {
  parallelFor(kSamples, 1, [&](std::size_t begin, std::size_t end) {
    std::vector<float> x, y, z;
    for (std::size_t k = begin; k < end; ++k)
      for (int j = 0; j < kSamples; ++j)
        for (int i = 0; i < kSamples; ++i) {
          x.push_back((float(i) + 0.5f) * kSide / kSamples);
          y.push_back((float(j) + 0.5f) * kSide / kSamples);
          z.push_back((float(k) + 0.5f) * kSide / kSamples);
        }
    std::vector<float> values(x.size());
    density.eval({x, y, z}, values);
    benchmark::DoNotOptimize(values.data());
  });
}

void gridlessFrame(benchmark::State& state) {
  std::vector<VectorField> velocities;
  double bytes = double(cloud()->memoryBytes());
  for (int frame = 0; frame < state.range(0); ++frame) {
    velocities.push_back(velocityOf(frame));
    bytes += bytesOf(velocities.back());
  }
  const ScalarField density = compose(gridField(cloud()), traceBack(velocities));
  for (auto _ : state) takePicture(density);
  state.SetItemsProcessed(state.iterations() * kSamples * kSamples * kSamples);
  state.counters["bytes"] = bytes;
}
BENCHMARK(gridlessFrame)->DenseRange(5, 60, 11)->Unit(benchmark::kMillisecond)->UseRealTime();

void selmaFrame(benchmark::State& state) {
  static std::vector<FlowMap> maps;
  const auto grid = cloud();
  const Matter matter(std::span(&grid, 1), grid->lattice());
  if (maps.empty()) maps.push_back(identityMap(matter));
  while (int(maps.size()) < state.range(0))
    maps.push_back(advanced(maps.back(), matter, velocityOf(int(maps.size()) - 1), 1));
  const int frame = int(state.range(0)) - 1;
  FlowMap map;
  for (auto _ : state) {
    map = advanced(maps[std::size_t(frame)], matter, velocityOf(frame), 1);
    takePicture(compose(gridField(grid), mapField(map)));
  }
  state.SetItemsProcessed(state.iterations() * kSamples * kSamples * kSamples);
  // The map before and after, and the velocity of the frame.
  state.counters["bytes"] =
      double(grid->memoryBytes() + map.memoryBytes() + maps[std::size_t(frame)].memoryBytes()) +
      bytesOf(velocityOf(frame));
  state.counters["bricks"] = double(map.bricks.size());
}
BENCHMARK(selmaFrame)->DenseRange(5, 60, 11)->Unit(benchmark::kMillisecond)->UseRealTime();

/// One step of each method on a ball of 64 voxels across, with procedural noise: items are its voxels.
void oneStep(benchmark::State& state) {
  const VectorField u = curlNoise({.frequency = 2 / kSide, .seed = 7}) * ScalarField(0.3f);
  AdvectionOptions options;
  options.method = state.range(0) == 0   ? AdvectionMethod::gridless
                   : state.range(0) == 1 ? AdvectionMethod::selma
                                         : AdvectionMethod::grid;
  options.scheme = state.range(0) == 2   ? GridScheme::plain
                   : state.range(0) == 3 ? GridScheme::macCormack
                                         : GridScheme::bfecc;
  for (auto _ : state) benchmark::DoNotOptimize(advectGrids({cloud()}, u, options));
  const auto grid = cloud();
  state.SetItemsProcessed(state.iterations() *
                          std::int64_t(Matter(std::span(&grid, 1), grid->lattice()).bricks().size() * 512));
}
BENCHMARK(oneStep)->DenseRange(0, 4)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace nephele

BENCHMARK_MAIN();

// Speed of cumulo: one layer, gridded against procedural, and the cost of a whole cloud against its size.
#include <benchmark/benchmark.h>

#include <random>

#include "nephele/levelset/cloud/cloud_density.h"
#include "nephele/levelset/cloud/layers_on_grids.h"
#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/grid/grid_field.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/cloud/density_profile.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/shape/shapes.h"

namespace nephele {
namespace {

const Box kTorusBox{{-1.25f, -0.25f, -1.25f}, {1.25f, 0.25f, 1.25f}};
constexpr float kLongestSide = 2.5f;

/// Amplitude 2.5 %, frequency 6 per longest side.
std::vector<CumuloLayer> cloudLayers(int count) {
  return cumuloLayers(
      {.layers = count, .amplitude = 0.025f * kLongestSide, .frequency = 6 / kLongestSide, .billow = 1.0f});
}

/// A base that was sampled, as the distance to a mesh is.
ScalarField sampledTorus(float voxelSize, const std::vector<CumuloLayer>& layers) {
  const float outside = cumuloExteriorBand(layers, voxelSize), inside = cumuloInteriorBand(layers, voxelSize);
  return bake(torus(), {.voxelSize = 4 * voxelSize,
                        .box = kTorusBox.expanded(outside),
                        .band = {-outside, inside},
                        .interpolation = Interpolation::tricubic});
}

/// One layer over the voxels of its band: items are active voxels.
void oneLayer(benchmark::State& state) {
  const auto layers = cloudLayers(1);
  const float voxel = 1 / (12 * layers[0].frequency) / float(state.range(0));
  std::vector<CumuloLayer> fine = layers;
  fine[0].frequency *= float(state.range(0));
  const ScalarField base = sampledTorus(voxel, fine);
  std::uint64_t voxels = 0;
  for (auto _ : state)
    voxels = griddedCumulo(base, fine, {.voxelSize = voxel, .box = kTorusBox}).layers[0].activeVoxels;
  state.SetItemsProcessed(std::int64_t(voxels) * state.iterations());
  state.counters["voxels"] = double(voxels);
}
BENCHMARK(oneLayer)->Arg(1)->Arg(4)->Unit(benchmark::kMillisecond);

std::uint64_t activeVoxels(const GriddedCumulo& cloud) {
  std::uint64_t voxels = 0;
  for (const CumuloLayerReport& layer : cloud.layers) voxels += layer.activeVoxels;
  return voxels;
}

/// Three layers whose waves are as many voxels long at every resolution: items are active voxels of all
/// layers, and cost should follow them.
void layersOfResolution(benchmark::State& state) {
  const float scale = float(state.range(0)) / 512;
  const auto layers = cumuloLayers(
      {.layers = 3, .amplitude = 0.025f * kLongestSide / scale, .frequency = 6 * scale / kLongestSide});
  const float voxel = kLongestSide / float(state.range(0));
  const ScalarField base = sampledTorus(voxel, layers);
  std::uint64_t voxels = 0;
  for (auto _ : state)
    voxels = activeVoxels(griddedCumulo(base, layers, {.voxelSize = voxel, .box = kTorusBox}));
  state.SetItemsProcessed(std::int64_t(voxels) * state.iterations());
  state.counters["voxels"] = double(voxels);
}
BENCHMARK(layersOfResolution)->Arg(512)->Arg(1024)->Arg(2048)->Unit(benchmark::kMillisecond);

/// What parameters that vary cost: three layers at resolution 512 whose parameters are constants (0), ramps
/// along x (1), or a sampled mask (2), with the same largest values.
void varyingParameters(benchmark::State& state) {
  CumuloFractal fractal{.layers = 3, .amplitude = 0.025f * kLongestSide, .frequency = 6 / kLongestSide};
  ScalarField across = ramp(plane({}, {1, 0, 0}), {{-kLongestSide / 2, 0}, {kLongestSide / 2, 1}});
  const float voxel = kLongestSide / 512;
  if (state.range(0) == 2)
    across = bake(across, {.voxelSize = 4 * voxel, .box = kTorusBox.expanded(kLongestSide / 4)});
  if (state.range(0) > 0) {
    const ScalarField share = 0.5f + 0.5f * across;
    fractal.amplitude = fractal.amplitude * share;
    fractal.roughness = fractal.roughness * share;
    fractal.billow = fractal.billow * share;
    fractal.billowScale = fractal.billowScale * share;
  }
  if (state.range(0) == 1) fractal.frequency = fractal.frequency * (0.5f + 0.5f * across);
  const auto layers = cumuloLayers(fractal);
  const ScalarField base = sampledTorus(voxel, layers);
  std::uint64_t voxels = 0;
  for (auto _ : state)
    voxels = activeVoxels(griddedCumulo(base, layers, {.voxelSize = voxel, .box = kTorusBox}));
  state.SetItemsProcessed(std::int64_t(voxels) * state.iterations());
  state.SetLabel(state.range(0) == 0 ? "constants" : state.range(0) == 1 ? "ramps" : "mask");
}
BENCHMARK(varyingParameters)->Arg(0)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond);

/// A cloud of three layers with its density: items are active voxels of the density.
void cloudOfResolution(benchmark::State& state) {
  const auto layers = cloudLayers(3);
  const float voxel = kLongestSide / float(state.range(0));
  const ScalarField base = sampledTorus(voxel, layers);
  std::uint64_t voxels = 0;
  for (auto _ : state) {
    const GriddedCumulo cloud = griddedCumulo(base, layers, {.voxelSize = voxel, .box = kTorusBox});
    VoxelGrid<float> density =
        cloudDensity(cloud, {.voxelSize = voxel, .edgeThickness = 0.0035f * kLongestSide});
    state.PauseTiming();
    voxels = describe(toVdb(std::move(density), {"density", VdbGridInfo::Class::fogVolume})).activeVoxels;
    state.ResumeTiming();
  }
  state.SetItemsProcessed(std::int64_t(voxels) * state.iterations());
  state.counters["voxels"] = double(voxels);
}
BENCHMARK(cloudOfResolution)->Arg(256)->Arg(512)->Arg(1024)->Unit(benchmark::kMillisecond);

/// The procedural form at random points near the surface: items are points. Dividing the density's voxels by
/// this rate estimates what a cloud would cost without grids.
void proceduralPoints(benchmark::State& state) {
  const int count = int(state.range(0));
  const auto layers = cloudLayers(count);
  const float voxel = kLongestSide / 512;
  const ScalarField base = sampledTorus(voxel, layers);
  const ScalarField cloud = cumulo(base, layers, {.voxelSize = voxel});
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(0, 1);
  std::vector<float> x, y, z;
  const Box box = kTorusBox.expanded(displacementBound(layers));
  std::size_t drawn = 0;
  for (; x.size() < 256; ++drawn) {
    const Vec3f p = box.min + box.size() * Vec3f{unit(random), unit(random), unit(random)};
    const float l = base(p);
    if (l < -displacementBound(layers) || l > 0) continue;
    x.push_back(p.x);
    y.push_back(p.y);
    z.push_back(p.z);
  }
  std::vector<float> values(x.size());
  for (auto _ : state) cloud.eval({x, y, z}, values);
  state.SetItemsProcessed(std::int64_t(x.size()) * state.iterations());
  // All voxels of the band at resolution 512, on one core.
  const Vec3f voxels = box.size() / voxel;
  const double share =
      double(x.size()) / (double(voxels.x) * voxels.y * voxels.z * double(x.size()) / double(drawn));
  state.counters["seconds_at_512"] =
      benchmark::Counter(share, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(proceduralPoints)->Arg(1)->Arg(2)->Arg(3)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace nephele

BENCHMARK_MAIN();

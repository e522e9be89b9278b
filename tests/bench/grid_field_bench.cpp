// Sampling of bricked grids, per point: our kernels, the plain loops beside them, and OpenVDB's BoxSampler on
// an accessor, all on the same dense 128^3 of samples, along rays (0.4 voxels apart) and at random points.
// And baking, per active voxel. And look-ups of a painted vertex attribute near its surface, exact and by its
// sparse grid.

#include <benchmark/benchmark.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>

#include <random>

#include "nephele/levelset/cloud/attribute_field.h"
#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/grid/grid_kernels.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/noise/noise.h"
#include "nephele/modeling/shape/shapes.h"
#include "tests/support/test_meshes.h"

namespace nephele {
namespace {

constexpr int kResolution = 128;
constexpr int kPoints = 1 << 16;

struct Scene {
  std::shared_ptr<const BrickGrid> grid;
  openvdb::FloatGrid::Ptr vdb;
  /// Along rays, and random.
  std::array<std::array<std::vector<float>, 3>, 2> points;
  std::array<std::vector<float>, 4> results;
};

Scene makeScene() {
  Scene scene;
  const float last = kResolution - 1;
  scene.grid =
      bakeGrid(perlin({.frequency = 0.1f}), {.voxelSize = 1, .box = {{0, 0, 0}, {last, last, last}}});
  openvdb::initialize();
  scene.vdb = openvdb::FloatGrid::create();
  auto accessor = scene.vdb->getAccessor();
  for (int z = 0; z < kResolution; ++z)
    for (int y = 0; y < kResolution; ++y)
      for (int x = 0; x < kResolution; ++x) accessor.setValue({x, y, z}, scene.grid->at({x, y, z}));
  std::mt19937 random(1);
  std::uniform_real_distribution<float> u(2, last - 2);
  for (int i = 0; i < kPoints; ++i) {
    const int ray = i / 256, step = i % 256;
    scene.points[0][0].push_back(4 + float(ray % 16) * 0.5f + float(step) * 0.4f * 0.9f);
    scene.points[0][1].push_back(4 + float(ray / 16) * 0.5f + float(step) * 0.4f * 0.3f);
    scene.points[0][2].push_back(40 + float(step) * 0.4f * 0.3f);
    for (auto& lane : scene.points[1]) lane.push_back(u(random));
  }
  for (auto& lane : scene.results) lane.resize(kPoints);
  return scene;
}

Scene& scene() {
  static Scene result = makeScene();
  return result;
}

template <class Body>
void perBlock(benchmark::State& state, const Body& body) {
  Scene& s = scene();
  const auto& p = s.points[std::size_t(state.range(0))];
  for (auto _ : state) {
    for (int i = 0; i < kPoints; i += kBlockSize) {
      const PointBlock block{p[0].data() + i, p[1].data() + i, p[2].data() + i, kBlockSize,
                             std::uint64_t(i + 1)};
      body(*s.grid, block, s.results[0].data() + i,
           BlockLanes<3>{s.results[1].data() + i, s.results[2].data() + i, s.results[3].data() + i});
    }
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * kPoints);
  state.SetLabel(state.range(0) == 0 ? "along rays" : "random");
}

template <auto kernel>
void values(benchmark::State& state) {
  perBlock(state, [](const BrickGrid& grid, const PointBlock& points, float* out, const BlockLanes<3>&) {
    kernel(grid, points, out);
  });
}

template <auto kernel>
void gradients(benchmark::State& state) {
  perBlock(state, [](const BrickGrid& grid, const PointBlock& points, float* out,
                     const BlockLanes<3>& grads) { kernel(grid, points, out, grads); });
}

void openvdbBoxSampler(benchmark::State& state) {
  Scene& s = scene();
  const auto& p = s.points[std::size_t(state.range(0))];
  const auto accessor = s.vdb->getConstAccessor();
  for (auto _ : state) {
    for (int i = 0; i < kPoints; ++i)
      s.results[0][std::size_t(i)] = openvdb::tools::BoxSampler::sample(
          accessor, openvdb::Vec3R(p[0][std::size_t(i)], p[1][std::size_t(i)], p[2][std::size_t(i)]));
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * kPoints);
  state.SetLabel(state.range(0) == 0 ? "along rays" : "random");
}

/// A sphere with two octaves of noise in a band of 3 voxels; items are active voxels.
void bakeNoisySphere(benchmark::State& state) {
  const float h = 2.4f / float(state.range(0));
  const ScalarField field =
      sphere({0, 0, 0}, 1.0f) + 0.03f * fractalSum({.octaves = 2, .frequency = 3, .seed = 1});
  const BakeOptions options{
      .voxelSize = h, .box = {{-1.2f, -1.2f, -1.2f}, {1.2f, 1.2f, 1.2f}}, .band = {-3 * h, 3 * h}};
  std::size_t active = 0, bricks = 0, bytes = 0;
  for (auto _ : state) {
    const auto grid = bakeGrid(field, options);
    state.PauseTiming();
    active = activeVoxelCount(*grid, options.band);
    bricks = grid->poolSize();
    bytes = grid->memoryBytes();
    state.ResumeTiming();
  }
  state.SetItemsProcessed(std::int64_t(state.iterations() * active));
  state.SetLabel(std::to_string(bricks) + " bricks, " + std::to_string(bytes >> 20) + " MB");
}

/// A torus of 65 536 triangles with a wavy attribute; the finest voxel of the grid is half an edge.
struct Painted {
  Mesh mesh = test::torusMesh(1, 0.4, 256, 128);
  std::array<std::vector<float>, 3> points;
  AttributeFieldOptions options;

  Painted(AttributeFieldOptions::Spread spread, bool gridded) {
    options = {.spread = spread, .voxelSize = gridded ? 0.01f : 0.0f, .band = 0.05f};
    MeshAttribute wave{"wave", MeshAttribute::Domain::vertex, 1, {}};
    for (const Vec3d& p : mesh.positions) wave.values.push_back(float(std::sin(5 * p.x) * std::cos(4 * p.y)));
    mesh.attributes.push_back(std::move(wave));
    // Voxel by voxel within a brick's width of each other, as the layers of a cloud ask for them.
    std::mt19937 random(2);
    std::uniform_real_distribution<double> u(-0.04, 0.04);
    for (std::size_t v = 0; v < mesh.positions.size(); ++v)
      for (int axis = 0; axis < 3; ++axis)
        points[std::size_t(axis)].push_back(float(mesh.positions[v][axis] + u(random)));
  }
};

void attributeLookUp(benchmark::State& state, AttributeFieldOptions::Spread spread, bool gridded) {
  Painted painted(spread, gridded);
  const ScalarField field = attributeField(painted.mesh, "wave", painted.options);
  std::vector<float> values(painted.points[0].size());
  for (auto _ : state) {
    field.eval({painted.points[0], painted.points[1], painted.points[2]}, values);
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(std::int64_t(state.iterations() * values.size()));
}

void attributeGrid(benchmark::State& state, AttributeFieldOptions::Spread spread) {
  const Painted painted(spread, true);
  for (auto _ : state) benchmark::DoNotOptimize(attributeField(painted.mesh, "wave", painted.options).node());
}

BENCHMARK(values<sampleTrilinear>)->Name("trilinear")->Arg(0)->Arg(1);
BENCHMARK(values<sampleTrilinearScalar>)->Name("trilinear_plain_loop")->Arg(0)->Arg(1);
BENCHMARK(openvdbBoxSampler)->Name("trilinear_openvdb_box_sampler")->Arg(0)->Arg(1);
BENCHMARK(gradients<sampleTrilinearGrad>)->Name("trilinear_and_gradient")->Arg(0)->Arg(1);
BENCHMARK(gradients<sampleTrilinearGradScalar>)->Name("trilinear_and_gradient_plain_loop")->Arg(0)->Arg(1);
BENCHMARK(values<sampleTricubic>)->Name("tricubic")->Arg(0)->Arg(1);
BENCHMARK(values<sampleTricubicScalar>)->Name("tricubic_plain_loop")->Arg(0)->Arg(1);
BENCHMARK(gradients<sampleTricubicGrad>)->Name("tricubic_and_gradient")->Arg(0)->Arg(1);
BENCHMARK(gradients<sampleTricubicGradScalar>)->Name("tricubic_and_gradient_plain_loop")->Arg(0)->Arg(1);
BENCHMARK(bakeNoisySphere)->Name("bake")->Arg(256)->Arg(512)->Unit(benchmark::kMillisecond)->UseRealTime();

using Spread = AttributeFieldOptions::Spread;
BENCHMARK_CAPTURE(attributeLookUp, closest_exact, Spread::closest, false);
BENCHMARK_CAPTURE(attributeLookUp, closest_gridded, Spread::closest, true);
BENCHMARK_CAPTURE(attributeLookUp, spheres_exact, Spread::spheres, false);
BENCHMARK_CAPTURE(attributeLookUp, spheres_gridded, Spread::spheres, true);
BENCHMARK_CAPTURE(attributeGrid, closest, Spread::closest)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(attributeGrid, spheres, Spread::spheres)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace nephele

BENCHMARK_MAIN();

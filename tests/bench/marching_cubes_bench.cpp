// Marching cubes beside OpenVDB's mesher on the same grids; items are the cells that the surface crosses.
#include <benchmark/benchmark.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <cmath>
#include <map>
#include <memory>

#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/grid/openvdb_bridge.h"
#include "nephele/levelset/mesh/adaptive_mesh.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/noise/noise.h"
#include "nephele/modeling/shape/shapes.h"

namespace {

using namespace nephele;

constexpr float kRadius = 0.9f;

// `resolution` voxels along the side of the box [-1, 1]^3, band of three voxels.
std::shared_ptr<BrickGrid> makeGrid(const ScalarField& shape, int resolution) {
  const float voxelSize = 2.0f / float(resolution);
  return bakeGrid(shape, {.voxelSize = voxelSize,
                          .box = {{-1, -1, -1}, {1, 1, 1}},
                          .band = {-3 * voxelSize, 3 * voxelSize},
                          .background = -3 * voxelSize});
}

std::shared_ptr<BrickGrid> sphereGrid(int resolution) {
  return makeGrid(sphere({}, kRadius), resolution);
}

// A sphere whose surface noise crumples at the scale of some voxels.
std::shared_ptr<BrickGrid> noiseGrid(int resolution) {
  const ScalarField bumps = perlin({.frequency = 8}) * ScalarField(0.05f);
  return makeGrid(sphere({}, 0.7f) + bumps, resolution);
}

using MakeGrid = std::shared_ptr<BrickGrid> (*)(int);

// OpenVDB's mesher, unless it adapts, makes one vertex in every cell that the surface crosses.
std::size_t surfaceCells(const BrickGrid& grid) {
  return adaptiveMesh(grid, 0, 0).positions.size();
}

void report(benchmark::State& state, const BrickGrid& grid, std::size_t faces) {
  const std::size_t cells = surfaceCells(grid);
  state.SetItemsProcessed(state.iterations() * std::int64_t(cells));
  state.counters["cells"] = double(cells);
  state.counters["faces"] = double(faces);
}

void marchingCubesOf(benchmark::State& state, MakeGrid make) {
  const auto grid = make(int(state.range(0)));
  std::size_t faces = 0;
  for (auto _ : state) faces = marchingCubes(*grid).faceCount();
  report(state, *grid, faces);
}

void openVdbOf(benchmark::State& state, MakeGrid make) {
  const auto grid = make(int(state.range(0)));
  const auto vdb = detail::toOpenVdb(*grid, detail::TreeValues::levelSet(*grid, "surface"), "surface");
  vdb->setGridClass(openvdb::GRID_LEVEL_SET);
  std::size_t faces = 0;
  for (auto _ : state) {
    std::vector<openvdb::Vec3s> points;
    std::vector<openvdb::Vec3I> triangles;
    std::vector<openvdb::Vec4I> quads;
    openvdb::tools::volumeToMesh(*vdb, points, triangles, quads, 0, 0);
    faces = triangles.size() + quads.size();
  }
  report(state, *grid, faces);
}

void sizes(benchmark::internal::Benchmark* benchmark) {
  benchmark->ArgName("resolution")
      ->Arg(128)
      ->Arg(256)
      ->Arg(512)
      ->Unit(benchmark::kMillisecond)
      ->UseRealTime();
}

BENCHMARK_CAPTURE(marchingCubesOf, sphere, sphereGrid)->Apply(sizes);
BENCHMARK_CAPTURE(openVdbOf, sphere, sphereGrid)->Apply(sizes);
BENCHMARK_CAPTURE(marchingCubesOf, noise, noiseGrid)->Apply(sizes);
BENCHMARK_CAPTURE(openVdbOf, noise, noiseGrid)->Apply(sizes);

}  // namespace

BENCHMARK_MAIN();

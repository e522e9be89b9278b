// Cutting a level set into pieces, per knife, and what the level set costs by itself: a torus of 65 536
// triangles at 256 voxels along its longest side.

#include <benchmark/benchmark.h>

#include "levelset/grid_field.h"
#include "levelset/mesh_pieces.h"
#include "levelset/mesh_to_level_set.h"
#include "levelset/pieces.h"
#include "tests/support/test_meshes.h"

namespace nephele {
namespace {

const Mesh& torus() {
  static const Mesh mesh = test::torusMesh(1, 0.4, 256, 128);
  return mesh;
}

constexpr float kVoxel = 2.8f / 256;

void levelSet(benchmark::State& state) {
  for (auto _ : state)
    benchmark::DoNotOptimize(&meshToLevelSet(torus(), {.voxelSize = double(kVoxel)}).impl());
}

void cut(benchmark::State& state, CutOptions options) {
  const ScalarField level = gridField(toBricks(meshToLevelSet(torus(), {.voxelSize = double(kVoxel)})));
  Pieces pieces;
  for (auto _ : state) pieces = cutIntoPieces(level, options);
  state.SetLabel(std::to_string(pieces.pieces.size()) + " pieces of " + std::to_string(pieces.codes) +
                 " codes");
}

CutOptions options() {
  return {.voxelSize = kVoxel, .box = boundingBox(torus())};
}

void planes(benchmark::State& state) {
  CutOptions all = options();
  for (const BladePlane& blade : randomBlades({.count = int(state.range(0)), .box = all.box, .seed = 1}))
    all.knives.push_back(flatKnife(blade));
  cut(state, all);
}

void roughPlanes(benchmark::State& state) {
  CutOptions all = options();
  for (const BladePlane& blade : randomBlades({.count = int(state.range(0)), .box = all.box, .seed = 1}))
    all.knives.push_back(roughKnife(blade, {.amplitude = 0.02f, .noise = {.frequency = 2}}));
  cut(state, all);
}

void cells(benchmark::State& state) {
  CutOptions all = options();
  all.cells = scatteredPoints(ScalarField(1), all.box, int(state.range(0)), 1);
  cut(state, all);
}

void exactCut(benchmark::State& state, const MeshCutOptions& options) {
  MeshPieces pieces;
  for (auto _ : state) pieces = cutMesh(torus(), options);
  state.SetItemsProcessed(state.iterations() * std::int64_t(pieces.pieces.size()));
  state.SetLabel(std::to_string(pieces.pieces.size()) + " pieces");
}

void exactPlanes(benchmark::State& state) {
  exactCut(state,
           {.planes = randomBlades({.count = int(state.range(0)), .box = boundingBox(torus()), .seed = 1})});
}

void exactCells(benchmark::State& state) {
  exactCut(state, {.cells = scatteredPoints(ScalarField(1), boundingBox(torus()), int(state.range(0)), 1)});
}

BENCHMARK(levelSet)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(planes)->Arg(1)->Arg(5)->Arg(20)->Arg(40)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(roughPlanes)->Arg(5)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(cells)->Arg(12)->Arg(100)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(exactPlanes)->Arg(1)->Arg(5)->Arg(20)->Arg(40)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(exactCells)->Arg(12)->Arg(100)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace nephele

BENCHMARK_MAIN();

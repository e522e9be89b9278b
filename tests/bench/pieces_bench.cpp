// Cutting into pieces, as level sets and exactly, by number of knives; the same exact Voronoi cells by clips
// with CGAL; and what the level set costs by itself. The bunny of the shared data where it is, else a torus
// of 65 536 triangles, at 256 voxels along its longest side.

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <filesystem>

#include "nephele/levelset/cut/cut.h"
#include "nephele/levelset/grid/grid_field.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/levelset/mesh/mesh_to_level_set.h"
#include "tests/bench/corefined_cells.h"
#include "tests/support/test_meshes.h"

namespace nephele {
namespace {

const Mesh& source() {
  static const Mesh mesh = [] {
    const auto path =
        std::filesystem::path(NEPHELE_SOURCE_DIR).parent_path() / "shared/data/meshes/bunny_60k.obj";
    return std::filesystem::exists(path) ? triangulated(readMesh(path.string()))
                                         : test::torusMesh(1, 0.4, 256, 128);
  }();
  return mesh;
}

Box box() {
  return boundingBox(source());
}

float voxel() {
  const Vec3f size = box().size();
  return std::max({size.x, size.y, size.z}) / 256;
}

std::vector<BladePlane> blades(std::int64_t count) {
  return randomBlades({.count = int(count), .box = box(), .seed = 1});
}

const ScalarField& level() {
  static const ScalarField field =
      gridField(toBricks(meshToLevelSet(source(), {.voxelSize = double(voxel())})));
  return field;
}

void levelSet(benchmark::State& state) {
  for (auto _ : state)
    benchmark::DoNotOptimize(meshToLevelSet(source(), {.voxelSize = double(voxel())}).sampledBricks());
}

PieceLattice lattice() {
  return {.voxelSize = voxel(), .box = box()};
}

void cut(benchmark::State& state, const Knives& knives) {
  level();
  Pieces pieces;
  for (auto _ : state) pieces = cutIntoLevelSets(level(), lattice(), knives);
  state.SetItemsProcessed(state.iterations() * std::int64_t(pieces.pieces.size()));
  state.counters["pieces"] = double(pieces.pieces.size());
  state.SetLabel(fmt::format("{} pieces of {} codes", pieces.pieces.size(), pieces.codes));
}

void planes(benchmark::State& state) {
  cut(state, {.planes = blades(state.range(0))});
}

RoughnessOptions roughness() {
  const float size = length(box().size());
  return {.amplitude = 0.01f * size, .noise = {.frequency = 4 / size}};
}

std::vector<RoughBlade> rough(std::int64_t count) {
  std::vector<RoughBlade> all;
  for (const BladePlane& blade : blades(count)) all.push_back({blade, roughness()});
  return all;
}

void roughPlanes(benchmark::State& state) {
  cut(state, {.rough = rough(state.range(0))});
}

std::vector<Vec3f> scattered(std::int64_t count) {
  return scatteredPoints(ScalarField(1), box(), int(count), 1);
}

void cells(benchmark::State& state) {
  cut(state, {.cells = scattered(state.range(0))});
}

void exactCut(benchmark::State& state, const Knives& knives) {
  Pieces pieces;
  for (auto _ : state) pieces = cutIntoMeshes(source(), knives);
  state.SetItemsProcessed(state.iterations() * std::int64_t(pieces.pieces.size()));
  state.counters["pieces"] = double(pieces.pieces.size());
  state.SetLabel(fmt::format("{} pieces", pieces.pieces.size()));
}

void exactPlanes(benchmark::State& state) {
  exactCut(state, {.planes = blades(state.range(0))});
}

void exactRough(benchmark::State& state) {
  exactCut(state, {.rough = rough(state.range(0))});
}

void exactBall(benchmark::State& state) {
  exactCut(state,
           {.solids = {test::icosphere(0.2 * double(length(box().size())), 5, Vec3d(box().center()))}});
}

void exactCells(benchmark::State& state) {
  exactCut(state, {.cells = scattered(state.range(0))});
}

double secondsOf(const auto& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// One cell in ten by clips, in turn with all cells at once.
void corefinedCells(benchmark::State& state) {
  const std::vector<Vec3f> points = scattered(state.range(0));
  const CorefinedCells baseline(source());
  std::vector<double> ratios;
  double apart = 0;
  std::int64_t done = 0;
  for (auto _ : state) {
    Pieces pieces;
    const double ours = secondsOf([&] { pieces = cutIntoMeshes(source(), {.cells = points}); });
    std::vector<double> volumes(points.size());
    for (const Piece& piece : pieces.pieces) volumes[*piece.cell] += piece.mass.volume;
    std::int64_t used = 0, clipped = 0;
    double theirs = 0;
    for (std::uint32_t i = 0; i < points.size(); ++i) {
      if (volumes[i] == 0 || used++ % 10 != 0) continue;
      double volume = 0;
      theirs += secondsOf([&] { volume = baseline.volumeOf(points, i); });
      apart = std::max(apart, std::abs(volume / volumes[i] - 1));
      ++clipped;
    }
    done += clipped;
    state.SetIterationTime(theirs);
    ratios.push_back(theirs / double(clipped) / (ours / double(used)));
  }
  std::sort(ratios.begin(), ratios.end());
  state.SetItemsProcessed(done);
  state.SetLabel(fmt::format("{:.0f} times as long per cell as exactCells; volumes differ by {:.0e}",
                             ratios[ratios.size() / 2], apart));
}

/// Splitting in turn with making the level set: from the level set and the knives to all pieces' level sets
/// as fields, one of whose values each is read; and once more with the volume of each.
void splitAgainstLevelSet(benchmark::State& state) {
  const Knives knives{.planes = blades(state.range(0))};
  level();
  const Vec3f middle = box().center();
  std::vector<double> ratios, processorRatios, withVolumes;
  std::size_t bytes = 0, count = 0;
  for (auto _ : state) {
    // Of all processors together, which other programs do not change much.
    const std::clock_t start = std::clock();
    const double made = secondsOf([&] {
      benchmark::DoNotOptimize(meshToLevelSet(source(), {.voxelSize = double(voxel())}).sampledBricks());
    });
    const std::clock_t between = std::clock();
    Pieces cut;
    const double split = secondsOf([&] {
      cut = cutIntoLevelSets(level(), lattice(), knives);
      for (const Piece& piece : cut.pieces) benchmark::DoNotOptimize(piece.level->field()(middle));
    });
    processorRatios.push_back(double(std::clock() - between) / double(between - start));
    const double measured = secondsOf([&] {
      for (const Piece& piece : cut.pieces) benchmark::DoNotOptimize(piece.level->volume());
    });
    withVolumes.push_back((split + measured) / made);
    bytes = 0, count = cut.pieces.size();
    for (const Piece& piece : cut.pieces) bytes += piece.level->memoryBytes();
    state.SetIterationTime(split);
    ratios.push_back(split / made);
  }
  std::sort(ratios.begin(), ratios.end());
  std::sort(processorRatios.begin(), processorRatios.end());
  std::sort(withVolumes.begin(), withVolumes.end());
  state.SetLabel(fmt::format(
      "{:.2f} times the level set ({:.2f} to {:.2f}), {:.2f} times its processor time ({:.2f} to {:.2f}), "
      "{:.2f} times with volumes, {} pieces as fields, {:.0f} MB",
      ratios[ratios.size() / 2], ratios.front(), ratios.back(), processorRatios[processorRatios.size() / 2],
      processorRatios.front(), processorRatios.back(), withVolumes[withVolumes.size() / 2], count,
      double(bytes) / 1e6));
}

/// A level set by linear cells, in turn with its marching cubes mesh, cut as a mesh.
void levelSetCells(benchmark::State& state, const Knives& knives) {
  const auto grid = toBricks(meshToLevelSet(source(), {.voxelSize = double(voxel())}));
  const auto trianglesOf = [](const Pieces& cut) {
    std::size_t count = 0;
    for (const Piece& piece : cut.pieces) count += piece.mesh.faceCount();
    return count;
  };
  Pieces cells, meshes;
  std::vector<double> ratios;
  for (auto _ : state) {
    const double ours = secondsOf([&] { cells = cutIntoMeshes(*grid, knives); });
    state.SetIterationTime(ours);
    ratios.push_back(ours / secondsOf([&] { meshes = cutIntoMeshes(marchingCubes(*grid), knives); }));
  }
  std::sort(ratios.begin(), ratios.end());
  state.SetItemsProcessed(state.iterations() * std::int64_t(cells.pieces.size()));
  state.SetLabel(fmt::format("{} pieces of {} triangles; {:.1f} times as long as marching cubes, cut: {}",
                             cells.pieces.size(), trianglesOf(cells), ratios[ratios.size() / 2],
                             trianglesOf(meshes)));
}

void levelSetCellsPlanes(benchmark::State& state) {
  levelSetCells(state, {.planes = blades(state.range(0))});
}

void levelSetCellsRough(benchmark::State& state) {
  levelSetCells(state, {.rough = rough(state.range(0))});
}

void planeCounts(benchmark::internal::Benchmark* bench) {
  for (const int count : {1, 2, 5, 10, 15, 20, 30, 40}) bench->Arg(count);
  bench->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();
}

BENCHMARK(levelSet)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(planes)->Apply(planeCounts);
BENCHMARK(roughPlanes)->Arg(5)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(cells)->Arg(12)->Arg(100)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(exactPlanes)->Apply(planeCounts);
BENCHMARK(exactRough)->Arg(1)->Arg(5)->Arg(20)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(exactBall)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(exactCells)->Arg(12)->Arg(100)->Arg(1000)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(corefinedCells)->Arg(100)->Unit(benchmark::kMillisecond)->UseManualTime();
BENCHMARK(levelSetCellsPlanes)->Arg(1)->Arg(20)->Unit(benchmark::kMillisecond)->UseManualTime();
BENCHMARK(levelSetCellsRough)->Arg(1)->Arg(5)->Unit(benchmark::kMillisecond)->UseManualTime();
BENCHMARK(splitAgainstLevelSet)->Arg(20)->Unit(benchmark::kMillisecond)->UseManualTime()->Iterations(15);

}  // namespace
}  // namespace nephele

BENCHMARK_MAIN();

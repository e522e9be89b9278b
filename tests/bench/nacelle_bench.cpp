// What a transfer's map costs, each beside what it is measured against: the fast map against plain nearest
// points, alignment, relaxation, and the warp field on a grid.
#include <benchmark/benchmark.h>

#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/mesh/exact_distance.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/levelset/warp/alignment.h"
#include "nephele/levelset/warp/mesh_warp.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/shape/shapes.h"
#include "tests/support/linked_tori.h"

namespace nephele {
namespace {

/// The object of the notes' figure 4.1, with about 60 000 triangles.
const Mesh& object() {
  constexpr float kVoxel = 1.0f / 47;
  static const Mesh mesh = marchingCubes(
      *bakeGrid(test::linkedToriAndCone(), {.voxelSize = kVoxel,
                                            .box = Box{{-1.6f, -1.2f, -1.2f}, {1.6f, 1.6f, 1.2f}},
                                            .band = Interval{-3 * kVoxel, 3 * kVoxel}}));
  return mesh;
}

const Mesh& reference() {
  constexpr float kVoxel = 1.0f / 30;
  static const Mesh mesh = marchingCubes(*bakeGrid(torus({.majorRadius = 0.9f, .minorRadius = 0.4f}),
                                                   {.voxelSize = kVoxel,
                                                    .box = Box{{-1.5f, -1.5f, -1.5f}, {1.5f, 1.5f, 1.5f}},
                                                    .band = Interval{-3 * kVoxel, 3 * kVoxel}}));
  return mesh;
}

/// The measure of "fast": a hierarchy over the reference and the nearest point of every corner.
void nearestOfCorners(benchmark::State& state) {
  const Mesh& mesh = object();
  for (auto _ : state) {
    const NearestOnMesh nearest(reference());
    std::vector<Vec3f> found(mesh.corners.size());
    parallelFor(found.size(), 1024, [&](std::size_t begin, std::size_t end) {
      for (std::size_t c = begin; c < end; ++c)
        found[c] =
            nearest.nearest(Vec3f(mesh.positions[mesh.corners[c]]), std::numeric_limits<float>::infinity())
                ->point;
    });
    benchmark::DoNotOptimize(found.data());
  }
  state.counters["corners/s"] =
      benchmark::Counter(double(mesh.corners.size()), benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(nearestOfCorners)->Unit(benchmark::kMillisecond)->UseRealTime();

void warp(benchmark::State& state, MeshWarpOptions options) {
  for (auto _ : state) benchmark::DoNotOptimize(warpMesh(reference(), object(), options).images.data());
  state.counters["corners/s"] =
      benchmark::Counter(double(object().corners.size()), benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK_CAPTURE(warp, fast, {.align = Alignment::none, .quality = WarpQuality::fast})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(warp, fastAligned, {.quality = WarpQuality::fast})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(warp, balanced, {})->Unit(benchmark::kMillisecond)->UseRealTime()->Iterations(1);
BENCHMARK_CAPTURE(warp, best, {.quality = WarpQuality::best})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->Iterations(1);

/// On one core.
void similarity(benchmark::State& state) {
  const ExactDistance to(reference()), from(object());
  for (auto _ : state) benchmark::DoNotOptimize(alignSimilarity(to, from).cost);
}
BENCHMARK(similarity)->Unit(benchmark::kMillisecond);

void lattice(benchmark::State& state) {
  const ExactDistance to(reference()), from(object());
  const Similarity aligned = alignSimilarity(to, from).similarity;
  for (auto _ : state) benchmark::DoNotOptimize(alignLattice(to, from, aligned).control.data());
}
BENCHMARK(lattice)->Unit(benchmark::kMillisecond);

/// The warp field baked in a band of three voxels around the object, longest side / 256.
void bakedMap(benchmark::State& state) {
  const MeshWarp warped =
      warpMesh(reference(), object(),
               {.align = Alignment::none, .quality = WarpQuality::fast, .gridded = state.range(0) != 0});
  const Box box = boundingBox(object());
  const float voxel = box.longestSide() / 256;
  const auto layout =
      bakeGrid(warped.object,
               {.voxelSize = voxel, .box = box.expanded(4 * voxel), .band = Interval{-3 * voxel, 3 * voxel}});
  const std::size_t bricks = layout->ranges().size() - 2;
  // What one brick of 8^3 asks for, on all of them.
  std::vector<Vec3i> places;
  for (std::size_t i = 0; i < layout->table().size(); ++i)
    if (layout->table()[i] >= 2) {
      const auto nx = std::size_t(layout->brickCount().x), ny = std::size_t(layout->brickCount().y);
      places.push_back(layout->firstBrick() + Vec3i{int(i % nx), int(i / nx % ny), int(i / nx / ny)});
    }
  for (auto _ : state) {
    parallelFor(places.size(), 4, [&](std::size_t begin, std::size_t end) {
      constexpr std::size_t kSamples = 512;
      std::vector<float> x(kSamples), y(kSamples), z(kSamples), u(kSamples), v(kSamples), w(kSamples);
      for (std::size_t b = begin; b < end; ++b) {
        for (int s = 0; s < int(kSamples); ++s) {
          const Vec3i at{places[b].x * 8 + (s & 7), places[b].y * 8 + (s >> 3 & 7),
                         places[b].z * 8 + (s >> 6)};
          x[std::size_t(s)] = float(at.x) * voxel;
          y[std::size_t(s)] = float(at.y) * voxel;
          z[std::size_t(s)] = float(at.z) * voxel;
        }
        warped.map.eval({x, y, z}, Spans<3>{{u, v, w}});
        benchmark::DoNotOptimize(u.data());
      }
    });
  }
  state.counters["voxels"] = double(512 * bricks);
  state.counters["voxels/s"] =
      benchmark::Counter(double(512 * places.size()), benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(bakedMap)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond)->UseRealTime()->ArgName("gridded");

/// The same on implicits: values and images of points around the object.
void implicitField(benchmark::State& state) {
  const VectorField map = nacelle(test::linkedToriAndCone(), sphere({0, 0, 0}, 1),
                                  {.order = int(state.range(0)), .voxel = 1.0f / 30, .band = {-10, 1}});
  constexpr std::size_t kCount = 1 << 16;
  std::vector<float> x(kCount), y(kCount), z(kCount), u(kCount), v(kCount), w(kCount);
  for (std::size_t i = 0; i < kCount; ++i) {
    x[i] = float(i % 64) / 20 - 1.6f;
    y[i] = float(i / 64 % 32) / 12 - 1.2f;
    z[i] = float(i / 2048) / 14 - 1.2f;
  }
  for (auto _ : state) {
    map.eval({x, y, z}, Spans<3>{{u, v, w}});
    benchmark::DoNotOptimize(u.data());
  }
  state.counters["points/s"] =
      benchmark::Counter(double(kCount), benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(implicitField)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->ArgName("order");

}  // namespace
}  // namespace nephele

BENCHMARK_MAIN();

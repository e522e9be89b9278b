// Dots per second that are added up on a grid, small and large, at rest and smeared, and grown as wisps;
// against OpenVDB's trilinear rasterisation of points, which needs a grid of points made first, and its
// rasterisation of particles as spheres of a level set. The argument is the number of threads.
#include <benchmark/benchmark.h>
#include <openvdb/openvdb.h>
#include <openvdb/points/PointConversion.h>
#include <openvdb/points/PointRasterizeTrilinear.h>
#include <openvdb/tools/ParticlesToLevelSet.h>
#include <tbb/global_control.h>

#include <cmath>

#include "nephele/levelset/cloud/dot_volume.h"
#include "nephele/levelset/cloud/wisp_volume.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/base/random_stream.h"

namespace nephele {
namespace {

constexpr std::size_t kDots = 4000000;
constexpr float kVoxel = 1.0f / 256;

/// One wisp of kDots dots, about 256 voxels wide, in the order in which wisps are grown.
const Dots& wisp() {
  static const Dots dots = [] {
    const WispGuide guide{.size = 0.3f};
    return growWisps({&guide, 1}, {.dots = kDots, .seed = 3});
  }();
  return dots;
}

void add(benchmark::State& state, const DotSpans& dots, const DotVolumeOptions& options) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(state.range(0)));
  std::size_t bricks = 0;
  for (auto _ : state) {
    DotVolume volume(options);
    volume.add(dots);
    bricks = volume.brickCount();
  }
  state.SetItemsProcessed(state.iterations() * std::int64_t(dots.size()));
  state.counters["bricks"] = double(bricks);
}

void smallDots(benchmark::State& state) {
  add(state, wisp(), {.voxelSize = kVoxel});
}
void coloredDots(benchmark::State& state) {
  Dots dots = wisp();
  dots.colors.assign(dots.size(), {1, 0.5f, 0.25f});
  add(state, dots, {.voxelSize = kVoxel, .withColor = true});
}
void twoVoxelDots(benchmark::State& state) {
  add(state, DotSpans(wisp()).part(0, kDots / 8), {.voxelSize = kVoxel, .radius = 2 * kVoxel});
}
void smearedDots(benchmark::State& state) {
  Dots dots = wisp();
  dots.velocities.assign(dots.size(), {4 * kVoxel, 0, 0});
  add(state, DotSpans(dots).part(0, kDots / 4),
      {.voxelSize = kVoxel, .shutterOpen = -0.5f, .shutterClose = 0.5f});
}
/// From guides to grids ready to be written.
void wispsToGrids(benchmark::State& state) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(state.range(0)));
  const WispGuide guide{.size = 0.3f};
  const std::vector<WispGuide> guides(4, guide);
  for (auto _ : state) {
    const DotVolume volume = bakeWisps(guides, {.wisps = {.dots = kDots / 4}, .dots = {.voxelSize = kVoxel}});
    benchmark::DoNotOptimize(toVdb(volume.densityGrid(), {"density", VdbGridInfo::Class::fogVolume}));
  }
  state.SetItemsProcessed(state.iterations() * std::int64_t(kDots));
}

/// OpenVDB: `withGrid` counts the making of its grid of points, too, which it cannot do without.
void vdbTrilinear(benchmark::State& state, bool withGrid) {
  openvdb::initialize();
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(state.range(0)));
  std::vector<openvdb::Vec3f> positions;
  for (const Vec3f& p : wisp().positions) positions.emplace_back(p.x, p.y, p.z);
  const std::vector<float> masses = wisp().masses;
  const auto transform = openvdb::math::Transform::createLinearTransform(double(kVoxel));
  const auto pointGrid = [&] {
    const openvdb::points::PointAttributeVector<openvdb::Vec3f> wrapper(positions);
    const auto index =
        openvdb::tools::createPointIndexGrid<openvdb::tools::PointIndexGrid>(wrapper, *transform);
    auto grid =
        openvdb::points::createPointDataGrid<openvdb::points::NullCodec, openvdb::points::PointDataGrid>(
            *index, wrapper, *transform);
    openvdb::points::appendAttribute<float>(grid->tree(), "mass");
    const openvdb::points::PointAttributeVector<float> values(masses);
    openvdb::points::populateAttribute<openvdb::points::PointDataTree, openvdb::tools::PointIndexTree,
                                       openvdb::points::PointAttributeVector<float>>(
        grid->tree(), index->tree(), "mass", values);
    return grid;
  };
  openvdb::points::PointDataGrid::Ptr ready = pointGrid();
  for (auto _ : state) {
    if (withGrid) ready = pointGrid();
    benchmark::DoNotOptimize(openvdb::points::rasterizeTrilinear<false, float>(ready->tree(), "mass"));
  }
  state.SetItemsProcessed(state.iterations() * std::int64_t(positions.size()));
}

/// What OpenVDB's ParticlesToLevelSet reads.
struct Particles {
  using PosType = openvdb::Vec3R;
  std::size_t count;
  float radius;
  std::size_t size() const { return count; }
  void getPos(std::size_t i, openvdb::Vec3R& at) const {
    const Vec3f& p = wisp().positions[i];
    at = openvdb::Vec3R(double(p.x), double(p.y), double(p.z));
  }
  void getPosRad(std::size_t i, openvdb::Vec3R& at, openvdb::Real& r) const {
    getPos(i, at);
    r = double(radius);
  }
};

void vdbSpheres(benchmark::State& state) {
  openvdb::initialize();
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(state.range(0)));
  const Particles particles{kDots / 8, 2 * kVoxel};
  for (auto _ : state) {
    const auto grid = openvdb::createLevelSet<openvdb::FloatGrid>(double(kVoxel), 2.0);
    openvdb::tools::ParticlesToLevelSet<openvdb::FloatGrid> rasteriser(*grid);
    rasteriser.setRmin(0.5);
    rasteriser.rasterizeSpheres(particles);
    rasteriser.finalize();
    benchmark::DoNotOptimize(grid->activeVoxelCount());
  }
  state.SetItemsProcessed(state.iterations() * std::int64_t(particles.count));
}

BENCHMARK(smallDots)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(coloredDots)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(twoVoxelDots)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(smearedDots)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(wispsToGrids)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(vdbTrilinear, points, true)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(vdbTrilinear, rasterOnly, false)
    ->Arg(1)
    ->Arg(2)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK(vdbSpheres)->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace nephele

BENCHMARK_MAIN();

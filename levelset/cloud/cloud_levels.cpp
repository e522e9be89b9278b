// Densities of a cloud whose levels are there already.
//
// A voxel whose estimate lies beyond the edge by more than the estimate's error is settled, and so is one
// whose level lies beyond the edge: the two differ only where the estimate was misjudged, which is kept.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>

#include "nephele/levelset/cloud/cloud_density.h"
#include "nephele/levelset/cloud/detail/level_blocks.h"
#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {
namespace {

using detail::BrickLevels;
using detail::LevelBlock;

/// Bricks along a cube that fields are restricted to.
constexpr int kBlock = 4;

int floorOf(int brick) {
  return (brick >= 0 ? brick : brick - (kBlock - 1)) / kBlock;
}

template <class Rule>
class LevelsToGrid {
 public:
  LevelsToGrid(const CloudLevels& cloud, const Rule& rule, const ScalarField& factor)
      : cloud_(cloud), voxel_(float(cloud.levels.voxelSize())), rule_(rule), factor_(factor) {}

  VoxelGrid<float> build(const std::string& maker, const Progress& progress) const {
    std::set<std::array<int, 3>> corners;
    cloud_.levels.forEachBrick([&](const Vec3i& brick, std::int32_t) {
      corners.insert({floorOf(brick.z), floorOf(brick.y), floorOf(brick.x)});
    });
    const std::vector<std::array<int, 3>> all(corners.begin(), corners.end());
    VoxelGrid<float> grid(maker, double(voxel_), rule_.background());
    constexpr std::size_t kTogether = 512;
    for (std::size_t first = 0; first < all.size(); first += kTogether) {
      std::vector<LevelBlock> blocks(std::min(kTogether, all.size() - first));
      parallelFor(blocks.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t b = begin; b < end; ++b) {
          progress.check();
          const auto& [z, y, x] = all[first + b];
          addBlock(Vec3i{x, y, z} * kBlock, blocks[b]);
        }
      });
      detail::moveBlocks(blocks, grid);
      progress.advance(double(first + blocks.size()) / double(all.size()));
    }
    return grid;
  }

 private:
  Box boxOf(const Vec3i& firstBrick, int bricks) const {
    const Vec3i first = firstBrick * kBrickSide, last = first + Vec3i{1, 1, 1} * (bricks * kBrickSide - 1);
    return {Vec3f(first) * voxel_, Vec3f(last) * voxel_};
  }

  void addBlock(const Vec3i& corner, LevelBlock& block) const {
    const Box box = boxOf(corner, kBlock);
    const Rule rule = rule_.restrictedTo(box);
    const ScalarField factor = factor_.restrictedTo(box);
    for (int z = 0; z < kBlock; ++z)
      for (int y = 0; y < kBlock; ++y)
        for (int x = 0; x < kBlock; ++x) addBrick(corner + Vec3i{x, y, z}, rule, factor, block);
  }

  void addBrick(const Vec3i& brick, const Rule& rule, const ScalarField& factor, LevelBlock& block) const {
    const std::int32_t entry = cloud_.levels.entryAt(brick);
    BrickLevels l;
    cloud_.levels.read(entry, l.data());
    if (entry < 0 && l[0] <= cloud_.levels.background()) return;
    const Box box = boxOf(brick, 1);
    const Interval range = factor.range(box), band = rule.band(box);
    if (range == Interval::of(0)) return;
    settleMisjudged(brick, band, l);
    BrickLevels px, py, pz;
    const Vec3i first = brick * kBrickSide;
    for (int i = 0; i < int(l.size()); ++i) {
      px[std::size_t(i)] = float(first.x + (i & 7)) * voxel_;
      py[std::size_t(i)] = float(first.y + (i >> 3 & 7)) * voxel_;
      pz[std::size_t(i)] = float(first.z + (i >> 6)) * voxel_;
    }
    detail::addBrick(rule, brick, {px, py, pz}, l, band, {factor, range}, block);
  }

  void settleMisjudged(const Vec3i& brick, const Interval& band, BrickLevels& l) const {
    const std::int32_t entry = cloud_.estimates.entryAt(brick);
    if (entry < 0) return;
    const float* estimates = cloud_.estimates.samples(entry);
    for (std::size_t i = 0; i < l.size(); ++i)
      if (estimates[i] <= band.min - cloud_.estimateError || estimates[i] >= band.max + cloud_.estimateError)
        l[i] = estimates[i];
  }

  const CloudLevels& cloud_;
  float voxel_;
  Rule rule_;
  ScalarField factor_;
};

}  // namespace

VoxelGrid<float> cloudDensity(const CloudLevels& cloud, const CloudDensityOptions& options,
                              const Progress& progress) {
  detail::requireDensity(options, cloud.box);
  require(options.voxelSize == float(cloud.levels.voxelSize()),
          fmt::format("cloudDensity: the levels have voxels of {}, not {}", cloud.levels.voxelSize(),
                      options.voxelSize));
  const float edge = options.edgeThickness.range(Box::everywhere()).max / 2;
  require(edge <= cloud.halfWidth,
          fmt::format("cloudDensity: the levels reach {} from the surface, and the edge {}", cloud.halfWidth,
                      edge));
  progress.begin("density");
  detail::releaseFreed();
  const detail::DensityRule rule(options.edgeThickness, options.edgeExponent);
  return LevelsToGrid(cloud, rule, options.factor).build("density", progress);
}

VoxelGrid<float> cloudSurface(const CloudLevels& cloud, const Progress& progress) {
  const float halfWidth = kCloudSurfaceVoxels * float(cloud.levels.voxelSize());
  require(halfWidth <= cloud.halfWidth,
          fmt::format("cloudSurface: the levels reach {} from the surface, and should reach {}",
                      cloud.halfWidth, halfWidth));
  progress.begin("surface");
  return LevelsToGrid(cloud, detail::LevelSetRule(halfWidth), ScalarField(1.0f)).build("surface", progress);
}

}  // namespace nephele

// Works strip by strip, each an octree from blocks of 32^3 voxels down to leaves of 8^3. A sampled estimate
// of the surface settles most of it: a cell whose range lies beyond the edge by more than the estimate's
// error is constant, and so is such a voxel; only voxels that are near the edge are read from the exact sum.
//
// Limits: at a crease of the surface the estimate can be off by more than its stated error; the voxels
// concerned then differ by less than an edge thickness in position.
#include "nephele/levelset/cloud/cloud_density.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "nephele/levelset/cloud/detail/level_blocks.h"
#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/base/printable.h"

namespace nephele {

namespace {

using detail::addBrick;
using detail::DensityRule;
using detail::LevelSetRule;
using detail::moveBlocks;
using Block = detail::LevelBlock;

constexpr int kBrick = kBrickSide;
constexpr std::size_t kCount = kBrickSamples;
constexpr int kBlock = 32;
/// A level that is off by less than this share of the estimated error was not misjudged, with any rounding.
constexpr float kNearlyAll = 0.98f;

template <class Rule>
class GridBuilder {
 public:
  GridBuilder(const GriddedCumulo& cloud, float voxelSize, const Rule& rule, const ScalarField& factor)
      : cloud_(cloud),
        voxel_(voxelSize),
        rule_(rule),
        factor_(factor),
        box_(cloud.box.expanded(rule.band(Box::everywhere()).max)) {}

  /// What the next grid misjudges is kept.
  const std::vector<Block::Misjudged>& keepMisjudged() {
    keepsMisjudged_ = true;
    return misjudged_;
  }

  VoxelGrid<float> build(const std::string& maker, const Progress& progress) {
    VoxelGrid<float> grid(maker, double(voxel_), rule_.background());
    fill(
        grid, [] {}, progress);
    return grid;
  }

  /// Calls `afterStrip` whenever bricks have been added.
  template <class AfterStrip>
  void fill(VoxelGrid<float>& grid, const AfterStrip& afterStrip, const Progress& progress) {
    const auto blockOf = [&](float x, int shift) { return int(std::floor(x / voxel_ / kBlock)) + shift; };
    const Vec3f low = box_.min, high = box_.max;
    const Vec3i first{blockOf(low.x, 0), blockOf(low.y, 0), blockOf(low.z, 0)};
    const Vec3i count = Vec3i{blockOf(high.x, 1), blockOf(high.y, 1), blockOf(high.z, 1)} - first;
    const int width = stripWidth(), strips = (count.y + width - 1) / width;
    for (int i = 0; i < count.z * strips; ++i) {
      const int y = i % strips * width;
      const Vec3i strip{count.x, std::min(width, count.y - y), 1};
      addStrip(first + Vec3i{0, y, i / strips}, strip, grid, progress);
      afterStrip();
      progress.advance(double(i + 1) / (count.z * strips));
    }
  }

 private:
  /// Blocks along y whose estimate is sampled at a time: so many that little of it is sampled twice.
  int stripWidth() const {
    constexpr float kBricks = 16;
    return std::max(
        1, int(std::ceil(kBricks * BrickGrid::kBrick * cloud_.estimateVoxelSize / (float(kBlock) * voxel_))));
  }

  /// Adds the blocks from `corner` on.
  void addStrip(const Vec3i& corner, const Vec3i& count, VoxelGrid<float>& grid, const Progress& progress) {
    const ScalarField estimate = sampledEstimate(corner, count);
    std::vector<Block> blocks(std::size_t(count.x) * std::size_t(count.y));
    parallelFor(blocks.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t b = begin; b < end; ++b) {
        progress.check();
        const Vec3i block = (corner + Vec3i{int(b) % count.x, int(b) / count.x, 0}) * kBlock;
        const Box box = boxOfVoxels(block, {kBlock, kBlock, kBlock});
        split(block, kBlock, {estimate, factor_.restrictedTo(box), rule_.restrictedTo(box)}, blocks[b]);
      }
    });
    moveBlocks(blocks, grid);
    for (const Block& block : blocks)
      for (const Block::Misjudged& m : block.misjudged) misjudged_.push_back(m);
  }

  Box boxOfVoxels(const Vec3i& first, const Vec3i& count) const {
    return {Vec3f(first) * voxel_, Vec3f(first + count - Vec3i{1, 1, 1}) * voxel_};
  }

  /// The estimate over some blocks, on a grid: one strip at a time keeps it small beside the cloud's own
  /// grids.
  ScalarField sampledEstimate(const Vec3i& firstBlock, const Vec3i& blocks) const {
    const float margin = 2 * cloud_.estimateVoxelSize;
    // A voxel more than the blocks' own, so that even a cloud that lies between two voxels leaves some box.
    const Box around = boxOfVoxels(firstBlock * kBlock, blocks * kBlock).expanded(margin + voxel_);
    const Interval settled = settledBand(rule_.band(around));
    return bake(cloud_.estimate, {.voxelSize = cloud_.estimateVoxelSize,
                                  .box = around.intersection(box_.expanded(margin)),
                                  .band = {settled.min - margin, settled.max + margin}});
  }

  /// Estimates beyond whose ends the exact value of l lies beyond those of `band`.
  Interval settledBand(const Interval& band) const {
    return {band.min - cloud_.estimateError, band.max + cloud_.estimateError};
  }

  /// What blocks are read from.
  struct Source {
    ScalarField estimate, factor;
    Rule rule;
  };

  void split(const Vec3i& first, int width, const Source& source, Block& block) const {
    const Box box = boxOfVoxels(first, {width, width, width});
    const Interval l = source.estimate.range(box), band = source.rule.band(box), settled = settledBand(band);
    if (l.max <= settled.min) return;
    const Interval factor = source.factor.range(box);
    if (factor == Interval::of(0)) return;
    if (l.min >= settled.max && factor.isPoint()) {
      for (int z = 0; z < width; z += kBrick)
        for (int y = 0; y < width; y += kBrick)
          for (int x = 0; x < width; x += kBrick)
            block.constants.push_back({brickOf(first + Vec3i{x, y, z}), rule_.inside() * factor.min});
      return;
    }
    if (width == kBrick) return evaluate(first, source, {band, settled, l.min >= settled.max, factor}, block);
    const int half = width / 2;
    for (int i = 0; i < 8; ++i)
      split(first + Vec3i{i & 1 ? half : 0, i & 2 ? half : 0, i & 4 ? half : 0}, half, source, block);
  }

  /// What is known about a brick by ranges.
  struct Known {
    Interval band, settled;
    bool isInside;
    Interval factor;
  };

  void evaluate(const Vec3i& first, const Source& source, const Known& known, Block& block) const {
    std::array<float, kCount> x, y, z, l;
    for (int i = 0; i < int(kCount); ++i) {
      x[std::size_t(i)] = float(first.x + (i & 7)) * voxel_;
      y[std::size_t(i)] = float(first.y + (i >> 3 & 7)) * voxel_;
      z[std::size_t(i)] = float(first.z + (i >> 6)) * voxel_;
    }
    if (known.isInside)
      l.fill(known.settled.max);
    else
      source.estimate.eval({x, y, z}, std::span<float>(l));

    std::array<float, kCount> nearX, nearY, nearZ, exact;
    std::array<std::size_t, kCount> place;
    std::size_t count = 0;
    for (std::size_t i = 0; i < kCount; ++i) {
      if (l[i] <= known.settled.min || l[i] >= known.settled.max) continue;
      nearX[count] = x[i];
      nearY[count] = y[i];
      nearZ[count] = z[i];
      place[count++] = i;
    }
    if (count > 0) {
      const auto part = [&](std::array<float, kCount>& a) { return std::span<float>(a).first(count); };
      cloud_.surface.eval({part(nearX), part(nearY), part(nearZ)}, part(exact));
      for (std::size_t i = 0; i < count; ++i) {
        const std::size_t p = place[i];
        if (keepsMisjudged_ && !(std::abs(l[p] - exact[i]) <= kNearlyAll * cloud_.estimateError))
          block.misjudged.push_back({first + Vec3i{int(p & 7), int(p >> 3 & 7), int(p >> 6)}, l[p]});
        l[p] = exact[i];
      }
    }

    addBrick(source.rule, brickOf(first), {x, y, z}, l, known.band, {source.factor, known.factor}, block);
  }

  const GriddedCumulo& cloud_;
  float voxel_;
  Rule rule_;
  ScalarField factor_;
  /// Where the edge can be.
  Box box_;
  bool keepsMisjudged_ = false;
  std::vector<Block::Misjudged> misjudged_;
};

}  // namespace

namespace detail {

void requireDensity(const CloudDensityOptions& options, const Box& box) {
  require(options.voxelSize > 0, "cloudDensity: voxelSize must be > 0, got " + numberText(options.voxelSize));
  const Interval edge = options.edgeThickness.range(Box::everywhere());
  require(edge.min > 0 && std::isfinite(edge.max),
          "cloudDensity: edgeThickness must be > 0 and finite, got " +
              numberText(edge.min > 0 ? edge.max : edge.min));
  require(!options.edgeExponent || (*options.edgeExponent > 0 && std::isfinite(*options.edgeExponent)),
          "cloudDensity: edgeExponent must be > 0, got " + numberText(options.edgeExponent.value_or(0)));
  const Interval factor = options.factor.range(box);
  require(factor.min >= 0,
          "cloudDensity: the factor must not be negative, got values from " + numberText(factor.min));
}

}  // namespace detail

VoxelGrid<float> cloudDensity(const GriddedCumulo& cloud, const CloudDensityOptions& options,
                              const Progress& progress) {
  detail::requireDensity(options, cloud.box);
  progress.begin("density");
  detail::releaseFreed();
  const DensityRule rule(options.edgeThickness, options.edgeExponent);
  return GridBuilder(cloud, options.voxelSize, rule, options.factor).build("density", progress);
}

VoxelGrid<float> cloudSurface(const GriddedCumulo& cloud, float voxelSize, const Progress& progress) {
  require(voxelSize > 0, "cloudSurface: voxelSize must be > 0, got " + numberText(voxelSize));
  progress.begin("surface");
  detail::releaseFreed();
  return GridBuilder(cloud, voxelSize, LevelSetRule(kCloudSurfaceVoxels * voxelSize), 1.0f)
      .build("surface", progress);
}

CloudLevels cloudLevels(const GriddedCumulo& cloud, float voxelSize, float halfWidth,
                        const Progress& progress) {
  require(voxelSize > 0 && halfWidth > 0, "cloudLevels: voxelSize and halfWidth must be > 0, got " +
                                              numberText(voxelSize) + " and " + numberText(halfWidth));
  progress.begin("levels");
  detail::releaseFreed();
  GridBuilder builder(cloud, voxelSize, LevelSetRule(halfWidth), 1.0f);
  const std::vector<Block::Misjudged>& misjudged = builder.keepMisjudged();
  CloudLevels result{
      NarrowBand(VoxelGrid<float>("levels", double(voxelSize), -halfWidth), -halfWidth, halfWidth),
      VoxelGrid<float>("estimates", double(voxelSize), 0.0f)};
  builder.fill(
      result.levels.unfinished(), [&] { result.levels.takeOver(false); }, progress);
  result.levels.takeOver(true);
  for (const Block::Misjudged& m : misjudged) {
    const Vec3i brick = brickOf(m.voxel);
    std::int32_t entry = result.estimates.entryAt(brick);
    if (entry < 0) {
      std::fill_n(result.estimates.add(brick), kCount, 0.0f);
      entry = result.estimates.entryAt(brick);
    }
    const Vec3i in{insideBrick(m.voxel.x), insideBrick(m.voxel.y), insideBrick(m.voxel.z)};
    result.estimates.samples(entry)[(in.z * kBrick + in.y) * kBrick + in.x] = m.estimate;
  }
  result.halfWidth = halfWidth;
  result.estimateError = cloud.estimateError;
  result.box = cloud.box;
  result.layers = cloud.layers;
  return result;
}

}  // namespace nephele

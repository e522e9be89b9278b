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

#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {

namespace {

constexpr int kBrick = kBrickSide;
constexpr std::size_t kCount = kBrickSamples;
constexpr int kBlock = 32;
constexpr int kLevelSetHalfWidth = 3;

/// What values of l become in the grid.
class DensityRule {
 public:
  DensityRule(const ScalarField& edge, std::optional<float> exponent) : edge_(edge), exponent_(exponent) {}
  /// Values of l in `box` at and beyond whose ends the grid's values do not change.
  Interval band(const Box& box) const {
    const float edge = edge_.range(box).max;
    return {-edge / 2, edge / 2};
  }
  DensityRule restrictedTo(const Box& box) const { return {edge_.restrictedTo(box), exponent_}; }
  void apply(const PointSpans& points, std::span<float> l) const {
    std::array<float, kCount> edge;
    edge_.eval(points, std::span<float>(edge));
    for (std::size_t i = 0; i < l.size(); ++i) l[i] = value(l[i], edge[i]);
  }
  float background() const { return 0; }
  float inside() const { return 1; }

 private:
  float value(float l, float edge) const {
    const float t = std::clamp(l / edge + 0.5f, 0.0f, 1.0f);
    if (exponent_) return *exponent_ == 1 ? t : std::pow(t, *exponent_);
    return t * t * (3 - 2 * t);
  }

  ScalarField edge_;
  std::optional<float> exponent_;
};

class LevelSetRule {
 public:
  explicit LevelSetRule(float halfWidth) : halfWidth_(halfWidth) {}
  Interval band(const Box&) const { return {-halfWidth_, halfWidth_}; }
  LevelSetRule restrictedTo(const Box&) const { return *this; }
  void apply(const PointSpans&, std::span<float> l) const {
    for (float& value : l) value = std::clamp(value, -halfWidth_, halfWidth_);
  }
  float background() const { return -halfWidth_; }
  float inside() const { return halfWidth_; }

 private:
  float halfWidth_;
};

/// What one block of the octree came to.
struct Block {
  struct Constant {
    Vec3i brick;
    float value;
  };
  std::vector<Vec3i> bricks;
  /// Of all bricks, one after the other.
  std::vector<float> samples;
  std::vector<Constant> constants;
};

template <class Rule>
class GridBuilder {
 public:
  GridBuilder(const GriddedCumulo& cloud, float voxelSize, const Rule& rule, const ScalarField& factor)
      : cloud_(cloud),
        voxel_(voxelSize),
        rule_(rule),
        factor_(factor),
        box_(cloud.box.expanded(rule.band(Box::everywhere()).max)) {}

  VoxelGrid<float> build(const std::string& maker, const Progress& progress) const {
    const auto blockOf = [&](float x, int shift) { return int(std::floor(x / voxel_ / kBlock)) + shift; };
    const Vec3f low = box_.min, high = box_.max;
    const Vec3i first{blockOf(low.x, 0), blockOf(low.y, 0), blockOf(low.z, 0)};
    const Vec3i count = Vec3i{blockOf(high.x, 1), blockOf(high.y, 1), blockOf(high.z, 1)} - first;
    VoxelGrid<float> grid(maker, double(voxel_), rule_.background());
    const int width = stripWidth(), strips = (count.y + width - 1) / width;
    for (int i = 0; i < count.z * strips; ++i) {
      const int y = i % strips * width;
      const Vec3i strip{count.x, std::min(width, count.y - y), 1};
      addStrip(first + Vec3i{0, y, i / strips}, strip, grid, progress);
      progress.advance(double(i + 1) / (count.z * strips));
    }
    return grid;
  }

 private:
  /// Blocks along y whose estimate is sampled at a time: so many that little of it is sampled twice.
  int stripWidth() const {
    constexpr float kBricks = 16;
    return std::max(
        1, int(std::ceil(kBricks * BrickGrid::kBrick * cloud_.estimateVoxelSize / (float(kBlock) * voxel_))));
  }

  /// Adds the blocks from `corner` on.
  void addStrip(const Vec3i& corner, const Vec3i& count, VoxelGrid<float>& grid,
                const Progress& progress) const {
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
    move(blocks, grid);
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
      for (std::size_t i = 0; i < count; ++i) l[place[i]] = exact[i];
    }

    bool inside = true, outside = true;
    for (const float value : l) {
      inside &= value >= known.band.max;
      outside &= value <= known.band.min;
    }
    if (inside && known.factor.isPoint())
      block.constants.push_back({brickOf(first), rule_.inside() * known.factor.min});
    if ((inside && known.factor.isPoint()) || outside) return;
    source.rule.apply({x, y, z}, std::span<float>(l));
    std::array<float, kCount> factor;
    if (known.factor.isPoint())
      factor.fill(known.factor.min);
    else
      source.factor.eval({x, y, z}, std::span<float>(factor));
    block.bricks.push_back(brickOf(first));
    for (std::size_t i = 0; i < kCount; ++i) block.samples.push_back(l[i] * factor[i]);
  }

  /// Puts what `blocks` hold into `grid`.
  void move(const std::vector<Block>& blocks, VoxelGrid<float>& grid) const {
    std::vector<float*> targets;
    std::vector<std::size_t> starts;
    for (const Block& block : blocks) {
      for (const Block::Constant& constant : block.constants)
        grid.setConstant(constant.brick, constant.value);
      starts.push_back(targets.size());
      for (const Vec3i& brick : block.bricks) targets.push_back(grid.add(brick));
    }
    parallelFor(blocks.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t b = begin; b < end; ++b)
        for (std::size_t i = 0; i < blocks[b].bricks.size(); ++i)
          std::copy_n(blocks[b].samples.data() + i * kCount, kCount, targets[starts[b] + i]);
    });
  }

  const GriddedCumulo& cloud_;
  float voxel_;
  Rule rule_;
  ScalarField factor_;
  /// Where the edge can be.
  Box box_;
};

}  // namespace

VoxelGrid<float> cloudDensity(const GriddedCumulo& cloud, const CloudDensityOptions& options,
                              const Progress& progress) {
  require(options.voxelSize > 0,
          "cloudDensity: voxelSize must be > 0, got " + std::to_string(options.voxelSize));
  const Interval edge = options.edgeThickness.range(Box::everywhere());
  require(edge.min > 0 && std::isfinite(edge.max),
          "cloudDensity: edgeThickness must be > 0 and finite, got " +
              std::to_string(edge.min > 0 ? edge.max : edge.min));
  require(!options.edgeExponent || (*options.edgeExponent > 0 && std::isfinite(*options.edgeExponent)),
          "cloudDensity: edgeExponent must be > 0, got " + std::to_string(options.edgeExponent.value_or(0)));
  const Interval factor = options.factor.range(cloud.box);
  require(factor.min >= 0,
          "cloudDensity: the factor must not be negative, got values from " + std::to_string(factor.min));
  progress.begin("density");
  detail::releaseFreed();
  const DensityRule rule(options.edgeThickness, options.edgeExponent);
  return GridBuilder(cloud, options.voxelSize, rule, options.factor).build("density", progress);
}

VoxelGrid<float> cloudSurface(const GriddedCumulo& cloud, float voxelSize, const Progress& progress) {
  require(voxelSize > 0, "cloudSurface: voxelSize must be > 0, got " + std::to_string(voxelSize));
  progress.begin("surface");
  detail::releaseFreed();
  return GridBuilder(cloud, voxelSize, LevelSetRule(kLevelSetHalfWidth * voxelSize), 1.0f)
      .build("surface", progress);
}

}  // namespace nephele

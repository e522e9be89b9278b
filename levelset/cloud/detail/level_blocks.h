#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "nephele/levelset/cloud/cloud_density.h"
#include "nephele/levelset/grid/voxel_grid.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/field/field.h"

/// How the level set of a cloud becomes a grid, brick by brick.
namespace nephele::detail {

/// @throws Error for options of a density in `box` that are out of range.
void requireDensity(const CloudDensityOptions& options, const Box& box);

/// What a cube of bricks came to.
struct LevelBlock {
  struct Constant {
    Vec3i brick;
    float value;
  };
  /// Where the estimate of a level is off by more than it says.
  struct Misjudged {
    Vec3i voxel;
    float estimate;
  };
  std::vector<Vec3i> bricks;
  /// Of all bricks, one after the other.
  std::vector<float> samples;
  std::vector<Constant> constants;
  std::vector<Misjudged> misjudged;
};

/// What values are multiplied by, and its range in a brick.
struct BrickFactor {
  const ScalarField& field;
  Interval range;
};

/// The values of l in a brick.
using BrickLevels = std::array<float, kBrickSamples>;

/// Adds a brick to `block` by a rule that says what values of l become.
template <class Rule>
void addBrick(const Rule& rule, const Vec3i& brick, const PointSpans& points, BrickLevels& l,
              const Interval& band, const BrickFactor& factor, LevelBlock& block) {
  bool inside = true, outside = true;
  for (const float value : l) {
    inside &= value >= band.max;
    outside &= value <= band.min;
  }
  if (inside && factor.range.isPoint()) block.constants.push_back({brick, rule.inside() * factor.range.min});
  if ((inside && factor.range.isPoint()) || outside) return;
  rule.apply(points, std::span<float>(l));
  BrickLevels factors;
  if (factor.range.isPoint())
    factors.fill(factor.range.min);
  else
    factor.field.eval(points, std::span<float>(factors));
  block.bricks.push_back(brick);
  for (std::size_t i = 0; i < kBrickSamples; ++i) block.samples.push_back(l[i] * factors[i]);
}

/// Densities that rise over an edge.
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
    BrickLevels edge;
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

/// l itself, as far as a half width.
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

/// Puts what `blocks` hold into `grid`, but what was misjudged.
inline void moveBlocks(const std::vector<LevelBlock>& blocks, VoxelGrid<float>& grid) {
  std::vector<float*> targets;
  std::vector<std::size_t> starts;
  for (const LevelBlock& block : blocks) {
    for (const LevelBlock::Constant& constant : block.constants)
      grid.setConstant(constant.brick, constant.value);
    starts.push_back(targets.size());
    for (const Vec3i& brick : block.bricks) targets.push_back(grid.add(brick));
  }
  parallelFor(blocks.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b)
      for (std::size_t i = 0; i < blocks[b].bricks.size(); ++i)
        std::copy_n(blocks[b].samples.data() + i * kBrickSamples, kBrickSamples, targets[starts[b] + i]);
  });
}

}  // namespace nephele::detail

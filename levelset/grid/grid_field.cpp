// A bricked grid as a node of field expressions. Values and gradients are the kernels of grid_kernels.h. The
// range of a box is the hull of the samples that its bricks store, taken from a pyramid, and widened by what
// interpolation can add: nothing but rounding for trilinear blends, the negative weights for Catmull-Rom (the
// weights of one axis sum to at most 5/4 in absolute value, so values leave the middle of the samples by at
// most (5/4)^3 times their half spread). Where every stored sample around a box is one number, restriction
// yields that constant.

#include "nephele/levelset/grid/grid_field.h"

#include <cmath>

#include "nephele/levelset/grid/brick_ranges.h"
#include "nephele/levelset/grid/grid_kernels.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/constant_node.h"

namespace nephele {

namespace {

/// Rounding of an interpolated value, relative to the largest sample.
constexpr float kTrilinearRounding = 2e-6f;
constexpr float kTricubicRounding = 1e-5f;
/// Rounding of index coordinates, relative to the largest term of the map.
constexpr double kIndexRounding = 1e-6;

/// What values interpolated between samples of range `r` can be.
Interval interpolated(const Interval& r, Interpolation interpolation) {
  const float magnitude = r.magnitude();
  if (r.isPoint() || !std::isfinite(magnitude)) return r;
  if (interpolation == Interpolation::tricubic) {
    const float beyond = 0.9532f * (0.5f * r.max - 0.5f * r.min) + kTricubicRounding * magnitude;
    return {r.min - beyond, r.max + beyond};
  }
  // Rounded blends of numbers of one sign keep it, so a bound of 0 stays.
  const float beyond = kTrilinearRounding * magnitude;
  const float low = r.min - beyond, high = r.max + beyond;
  return {r.min >= 0 && low < 0 ? 0.0f : low, r.max <= 0 && high > 0 ? 0.0f : high};
}

/// Ranges of what is interpolated between the samples of a grid.
class GridRanges {
 public:
  GridRanges(std::shared_ptr<const BrickLayout> layout, Interpolation interpolation)
      : layout_(std::move(layout)), ranges_(*layout_), interpolation_(interpolation) {}

  const BrickLayout& layout() const { return *layout_; }

  Interval range(const Box& box) const {
    if (box.isEmpty() || layout_->table().empty()) return Interval::of(layout_->background());
    const Mat3f& m = layout_->worldToIndex().linear;
    Vec3i first, last;
    for (int axis = 0; axis < 3; ++axis) {
      double low = layout_->worldToIndex().translation[axis], high = low, size = std::abs(low);
      for (int c = 0; c < 3; ++c) {
        if (m(axis, c) == 0) continue;
        const double a = double(m(axis, c)) * box.min[c], b = double(m(axis, c)) * box.max[c];
        low += std::fmin(a, b);
        high += std::fmax(a, b);
        size += std::fmax(std::abs(a), std::abs(b));
      }
      first[axis] = brickAt(low - kIndexRounding * size, axis, false);
      last[axis] = brickAt(high + kIndexRounding * size, axis, true);
    }
    return interpolated(ranges_.over(first, last), interpolation_);
  }

 private:
  /// Brick coordinate of an index coordinate, at most one brick outside the table; NaN goes to the far side.
  int brickAt(double q, int axis, bool upward) const {
    const double below = layout_->firstBrick()[axis] - 1.0, above = below + layout_->brickCount()[axis] + 1.0;
    const double b = std::floor(q / BrickGrid::kBrick);
    if (std::isnan(b)) return int(upward ? above : below);
    return int(b < below ? below : b > above ? above : b);
  }

  std::shared_ptr<const BrickLayout> layout_;
  BrickRanges ranges_;
  Interpolation interpolation_;
};

template <class Grid>
std::shared_ptr<const Grid> notNull(std::shared_ptr<const Grid> grid) {
  require(grid != nullptr, "gridField: the grid must not be null");
  return grid;
}

/// One grid, its ranges, and how to read it.
template <class Grid>
class Sampler {
 public:
  Sampler(std::shared_ptr<const Grid> grid, Interpolation interpolation)
      : grid_(notNull(std::move(grid))), ranges_(grid_, interpolation), interpolation_(interpolation) {}

  const std::shared_ptr<const Grid>& grid() const { return grid_; }

  void eval(const PointBlock& points, float* values) const {
    if (interpolation_ == Interpolation::trilinear)
      sampleTrilinear(*grid_, points, values);
    else
      sampleTricubic(*grid_, points, values);
  }

  void evalGrad(const PointBlock& points, float* values, const BlockLanes<3>& grads) const {
    if (interpolation_ == Interpolation::trilinear)
      sampleTrilinearGrad(*grid_, points, values, grads);
    else
      sampleTricubicGrad(*grid_, points, values, grads);
  }

  Interval range(const Box& box) const { return ranges_.range(box); }

 private:
  std::shared_ptr<const Grid> grid_;
  GridRanges ranges_;
  Interpolation interpolation_;
};

template <class Grid>
class GridNode final : public FieldNode<float> {
 public:
  GridNode(std::shared_ptr<const Grid> grid, Interpolation interpolation)
      : sampler_(std::move(grid), interpolation) {}

  const std::shared_ptr<const Grid>& grid() const { return sampler_.grid(); }

  void eval(const PointBlock& points, const BlockLanes<1>& values, Scratch&) const override {
    sampler_.eval(points, values[0]);
  }
  void evalGrad(const PointBlock& points, const BlockLanes<1>& values, const BlockLanes<3>& grads,
                Scratch&) const override {
    sampler_.evalGrad(points, values[0], grads);
  }
  Interval range(const Box& box, RangeMemo&) const override { return sampler_.range(box); }
  NodePtr<float> restricted(Restriction& restriction) const override {
    return detail::constantFrom<float>(range(restriction.box, restriction.memo.ranges));
  }
  float differenceStep() const override { return grid()->voxelSize(); }

 private:
  Sampler<Grid> sampler_;
};

class RangedNode final : public FieldNode<float> {
 public:
  RangedNode(std::shared_ptr<const GridRanges> ranges, NodePtr<float> field)
      : ranges_(std::move(ranges)), field_(std::move(field)) {}

  void eval(const PointBlock& points, const BlockLanes<1>& values, Scratch& scratch) const override {
    field_->eval(points, values, scratch);
  }
  void evalGrad(const PointBlock& points, const BlockLanes<1>& values, const BlockLanes<3>& grads,
                Scratch& scratch) const override {
    field_->evalGrad(points, values, grads, scratch);
  }
  Interval range(const Box& box, RangeMemo&) const override { return ranges_->range(box); }
  NodePtr<float> restricted(Restriction& restriction) const override {
    const NodePtr<float> field = restrictNode(field_, restriction);
    return field == field_ ? nullptr : std::make_shared<RangedNode>(ranges_, field);
  }
  float differenceStep() const override { return field_->differenceStep(); }

 private:
  std::shared_ptr<const GridRanges> ranges_;
  NodePtr<float> field_;
};

class VectorGridNode final : public FieldNode<Vec3f> {
 public:
  VectorGridNode(VectorGrids grids, Interpolation interpolation)
      : samplers_{Sampler<BrickGrid>(std::move(grids[0]), interpolation),
                  Sampler<BrickGrid>(std::move(grids[1]), interpolation),
                  Sampler<BrickGrid>(std::move(grids[2]), interpolation)} {}

  VectorGrids grids() const { return {samplers_[0].grid(), samplers_[1].grid(), samplers_[2].grid()}; }

  void eval(const PointBlock& points, const BlockLanes<3>& values, Scratch&) const override {
    for (int c = 0; c < 3; ++c) samplers_[c].eval(points, values[c]);
  }
  void evalGrad(const PointBlock& points, const BlockLanes<3>& values, const BlockLanes<9>& grads,
                Scratch&) const override {
    for (int c = 0; c < 3; ++c)
      samplers_[c].evalGrad(points, values[c], {grads[3 * c], grads[3 * c + 1], grads[3 * c + 2]});
  }
  RangeOf<Vec3f> range(const Box& box, RangeMemo&) const override {
    return {samplers_[0].range(box), samplers_[1].range(box), samplers_[2].range(box)};
  }
  NodePtr<Vec3f> restricted(Restriction& restriction) const override {
    return detail::constantFrom<Vec3f>(range(restriction.box, restriction.memo.ranges));
  }
  float differenceStep() const override {
    return std::fmin(samplers_[0].grid()->voxelSize(),
                     std::fmin(samplers_[1].grid()->voxelSize(), samplers_[2].grid()->voxelSize()));
  }

 private:
  std::array<Sampler<BrickGrid>, 3> samplers_;
};

}  // namespace

ScalarField gridField(std::shared_ptr<const BrickGrid> grid, Interpolation interpolation) {
  return ScalarField(std::make_shared<GridNode<BrickGrid>>(std::move(grid), interpolation));
}

ScalarField gridField(std::shared_ptr<const PackedGrid> grid, Interpolation interpolation) {
  return ScalarField(std::make_shared<GridNode<PackedGrid>>(std::move(grid), interpolation));
}

VectorField gridField(VectorGrids grids, Interpolation interpolation) {
  return VectorField(std::make_shared<VectorGridNode>(std::move(grids), interpolation));
}

ScalarField withRangesOf(const BrickLayout& grid, const ScalarField& field) {
  return ScalarField(std::make_shared<RangedNode>(
      std::make_shared<GridRanges>(std::make_shared<BrickLayout>(grid), Interpolation::trilinear),
      field.node()));
}

std::shared_ptr<const BrickGrid> gridOf(const ScalarField& field) {
  const auto* node = dynamic_cast<const GridNode<BrickGrid>*>(field.node().get());
  return node ? node->grid() : nullptr;
}

VectorGrids gridsOf(const VectorField& field) {
  const auto* node = dynamic_cast<const VectorGridNode*>(field.node().get());
  return node ? node->grids() : VectorGrids{};
}

}  // namespace nephele

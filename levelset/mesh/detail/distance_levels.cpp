// A point is evaluated at the levels that have a say there: a look at the nearest sample, from coarse to
// fine, tells which is the first. What it says is what all levels in turn would give, bit for bit.
#include "nephele/levelset/mesh/detail/distance_levels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "nephele/levelset/grid/grid_kernels.h"
#include "nephele/modeling/field/field_node.h"

namespace nephele::detail {

namespace {

constexpr int kBrick = BrickGrid::kBrick;

/// The levels first .. last of a distance.
class MeshDistanceNode final : public FieldNode<float> {
 public:
  MeshDistanceNode(std::shared_ptr<const DistanceLevels> levels, std::size_t first, std::size_t last)
      : levels_(std::move(levels)), first_(first), last_(last) {}

  void eval(const PointBlock& points, const BlockLanes<1>& values, Scratch& scratch) const override {
    evalLevels(points, values[0], nullptr, scratch);
    clampValues(points.count, values[0], nullptr);
  }

  void evalGrad(const PointBlock& points, const BlockLanes<1>& values, const BlockLanes<3>& grads,
                Scratch& scratch) const override {
    evalLevels(points, values[0], &grads, scratch);
    clampValues(points.count, values[0], &grads);
  }

  Interval range(const Box& box, RangeMemo&) const override {
    const Interval everything{-levels_->exteriorBand, levels_->interiorBand};
    if (box.isEmpty() || !isFinite(box.min) || !isFinite(box.max)) return everything;
    // Distance changes by no more than the way from the middle of each eighth; interpolation adds less than a
    // voxel of the level at either end.
    const Vec3f centre = box.center();
    const Vec3f quarter = 0.5f * (box.max - centre);
    const float way = length(quarter) * 1.0001f + 1e-5f * length(centre);
    float low = std::numeric_limits<float>::infinity(), high = -low;
    for (const float middle : valuesInEighths(centre, quarter)) {
      const float error = 2.0f * coarsestVoxel(std::abs(middle) + way);
      low = std::min(low, middle - way - error);
      high = std::max(high, middle + way + error);
    }
    Interval result{low, high};
    if (result.magnitude() < levels_->all[0].nextStart) {
      const Interval bricks = fineRange(box);
      result = {std::max(result.min, bricks.min), std::min(result.max, bricks.max)};
    }
    return {std::clamp(result.min, everything.min, everything.max),
            std::clamp(result.max, everything.min, everything.max)};
  }

  NodePtr<float> restricted(Restriction& restriction) const override {
    const Interval values = range(restriction.box, restriction.memo.ranges);
    const float most = values.magnitude();
    const float least = values.contains(0.0f) ? 0.0f : std::min(std::abs(values.min), std::abs(values.max));
    std::size_t first = first_, last = last_;
    // A level is left out only if no value lies within a voxel of where it has a say.
    while (first < last &&
           least > levels_->all[first].nextStart + levels_->all[first].nextBlend + voxelOf(first + 1))
      ++first;
    while (last > first && most + voxelOf(last) < levels_->all[last - 1].nextStart) --last;
    if (first == first_ && last == last_) return nullptr;
    return std::make_shared<MeshDistanceNode>(levels_, first, last);
  }

  float differenceStep() const override { return levels_->voxelSize; }

 private:
  float voxelOf(std::size_t level) const { return levels_->all[level].grid->voxelSize(); }

  float coarsestVoxel(float distance) const {
    std::size_t level = first_;
    while (level < last_ && distance > levels_->all[level].nextStart) ++level;
    return voxelOf(level);
  }

  /// Before they are cut off at the bands. Beyond what the levels hold, any number beyond the bands.
  std::array<float, 8> valuesInEighths(const Vec3f& centre, const Vec3f& quarter) const {
    Scratch& scratch = Scratch::local();
    Scratch::Frame frame(scratch);
    const BlockLanes<3> xyz = frame.lanes<3>();
    for (std::size_t c = 0; c < 3; ++c)
      for (int i = 0; i < 8; ++i)
        xyz[c][i] = centre[int(c)] + ((i >> c & 1) != 0 ? quarter[int(c)] : -quarter[int(c)]);
    float* values = frame.lane();
    evalLevels(scratch.pointBlock(xyz, 8), values, nullptr, scratch);
    std::array<float, 8> result;
    std::copy_n(values, 8, result.begin());
    return result;
  }

  /// Hull of the fine bricks that a box touches.
  Interval fineRange(const Box& box) const {
    const PackedGrid& grid = *levels_->all[0].grid;
    const auto brickBelow = [&](float v) { return int(std::floor(v / grid.voxelSize() / kBrick)); };
    Interval result{std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()};
    constexpr float kSlack = 1e-5f;
    const Box wide = box.expanded(kSlack * (std::abs(box.max.x) + std::abs(box.max.y) + std::abs(box.max.z)));
    for (int z = brickBelow(wide.min.z); z <= brickBelow(wide.max.z); ++z)
      for (int y = brickBelow(wide.min.y); y <= brickBelow(wide.max.y); ++y)
        for (int x = brickBelow(wide.min.x); x <= brickBelow(wide.max.x); ++x)
          result = result.hull(grid.ranges()[std::size_t(grid.poolIndex({x, y, z}))]);
    return result;
  }

  void clampValues(int count, float* values, const BlockLanes<3>* grads) const {
    const float low = -levels_->exteriorBand, high = levels_->interiorBand;
    for (int i = 0; i < count; ++i) {
      const bool beyond = values[i] <= low || values[i] >= high;
      if (grads && beyond)
        for (float* g : *grads) g[i] = 0.0f;
      values[i] = std::min(std::max(values[i], low), high);
    }
  }

  void sample(std::size_t index, const PointBlock& points, float* values, const BlockLanes<3>* grads) const {
    const PackedGrid& grid = *levels_->all[index].grid;
    if (index == 0)
      grads ? sampleTrilinearGrad(grid, points, values, *grads) : sampleTrilinear(grid, points, values);
    else
      grads ? sampleTricubicGrad(grid, points, values, *grads) : sampleTricubic(grid, points, values);
  }

  /// Values (and gradients) wanted at a block of points, and the level that each starts from.
  struct Asked {
    const PointBlock& points;
    float* values;
    const BlockLanes<3>* grads;
    /// The points that start from level k are order[begin[k]] .. order[begin[k + 1] - 1].
    std::array<int, kMostDistanceLevels + 1> begin;
    std::array<std::uint8_t, kBlockSize> order;

    Asked(const PointBlock& block, float* to, const BlockLanes<3>* gradsTo)
        : points(block), values(to), grads(gradsTo) {}

    int startingAt(std::size_t level) const { return begin[level + 1] - begin[level]; }
    int startingAfter(std::size_t level) const { return points.count - begin[level + 1]; }
    void sortByStart(const std::int32_t* start) {
      std::int32_t differing = 0;
      for (int i = 0; i < points.count; ++i) differing += std::int32_t(start[i] != start[0]);
      if (differing == 0) {
        for (int level = 0; level < int(begin.size()); ++level)
          begin[std::size_t(level)] = level <= start[0] ? 0 : points.count;
        return;
      }
      std::array<int, kMostDistanceLevels + 1> next{};
      for (int i = 0; i < points.count; ++i) ++next[std::size_t(start[i])];
      int sum = 0;
      for (std::size_t level = 0; level < next.size(); ++level) {
        const int count = next[level];
        begin[level] = next[level] = sum;
        sum += count;
      }
      for (int i = 0; i < points.count; ++i)
        order[std::size_t(next[std::size_t(start[i])]++)] = std::uint8_t(i);
    }
  };

  /// Points that one level leaves to the next, and where they stand in its block.
  struct Far {
    BlockLanes<3> points;
    std::array<std::uint8_t, kBlockSize> source;
    int count = 0;

    explicit Far(Scratch::Frame& frame) : points(frame.lanes<3>()) {}
  };

  void evalLevels(const PointBlock& points, float* values, const BlockLanes<3>* grads,
                  Scratch& scratch) const {
    if (first_ == last_) return sample(last_, points, values, grads);
    Scratch::Frame frame(scratch);
    std::array<std::int32_t, kBlockSize> start;
    findStarts(points, start.data(), scratch);
    Asked asked(points, values, grads);
    asked.sortByStart(start.data());
    evalFrom(first_, asked, Far(frame), nullptr, nullptr, scratch);
  }

  /// For each point the first level that has a say there, or one before it.
  void findStarts(const PointBlock& points, std::int32_t* start, Scratch& scratch) const {
    constexpr int kFew = 16;
    std::size_t coarsest = last_;
    if (points.count > 2 * kFew) {
      // A few points tell where to look.
      Scratch::Frame frame(scratch);
      const BlockLanes<3> few = frame.lanes<3>();
      for (int k = 0; k < kFew; ++k) {
        const int i = (2 * k + 1) * points.count / (2 * kFew);
        few[0][k] = points.x[i];
        few[1][k] = points.y[i];
        few[2][k] = points.z[i];
      }
      findStartsFrom(last_, scratch.pointBlock(few, kFew), start, scratch);
      const auto most = std::size_t(*std::max_element(start, start + kFew));
      coarsest = most > first_ ? std::min(most + 1, last_) : first_;
    }
    findStartsFrom(coarsest, points, start, scratch);
  }

  /// Values between these bounds are a level's own; beyond them it says nothing.
  struct Bounds {
    float outside, inside;

    Bounds(const DistanceLevel& level, float beyond)
        : outside(level.continuesOutside ? -beyond : -std::numeric_limits<float>::infinity()),
          inside(level.continuesInside ? beyond : std::numeric_limits<float>::infinity()) {}
    /// 1 beyond them, else 0; by numbers, for loops of whole vectors.
    std::int32_t leave(float value) const {
      return std::int32_t(value < outside) | std::int32_t(value > inside);
    }
  };

  /// From coarse to fine, as most points far out need few looks then. The nearest sample of a level tells
  /// whether all finer ones leave a point to it wholly, and whether it leaves the point to the next one.
  void findStartsFrom(std::size_t coarsest, const PointBlock& points, std::int32_t* start,
                      Scratch& scratch) const {
    // What lies between a point and its nearest sample, and the errors of interpolation there, voxels: by the
    // level itself, and by those that are finer.
    constexpr float kOwnVoxels = 1.25f, kFinerVoxels = 1.75f;
    const auto none = std::int32_t(first_);
    std::fill_n(start, points.count, none);
    Scratch::Frame frame(scratch);
    float* nearest = frame.lane();
    int left = points.count;
    for (std::size_t level = coarsest; level > first_ && left > 0; --level) {
      const DistanceLevel &own = levels_->all[level], &finer = levels_->all[level - 1];
      sampleNearest(*own.grid, points, nearest);
      const Bounds ofFiner(finer, finer.nextStart + finer.nextBlend + kFinerVoxels * voxelOf(level));
      const Bounds ofOwn(own, own.nextStart + own.nextBlend + kOwnVoxels * voxelOf(level));
      const std::int32_t here = std::int32_t(level) - none, next = level < last_ ? 1 : 0;
      left = 0;
      for (int i = 0; i < points.count; ++i) {
        const std::int32_t taken = std::int32_t(start[i] == none) & ofFiner.leave(nearest[i]);
        start[i] += taken * here + (taken & ofOwn.leave(nearest[i]) & next);
        left += std::int32_t(start[i] == none);
      }
    }
  }

  /// Writes the values of the asked points that start from level `index` or later, and those of the points
  /// that the level before leaves to it to `values` and `grads`.
  void evalFrom(std::size_t index, const Asked& asked, const Far& left, float* values,
                const BlockLanes<3>* grads, Scratch& scratch) const {
    while (left.count == 0 && asked.startingAt(index) == 0) ++index;
    const int starting = asked.startingAt(index), count = left.count + starting;
    Scratch::Frame frame(scratch);
    if (starting == asked.points.count) {
      sample(index, asked.points, asked.values, asked.grads);
      if (index < last_) blendWithNext(index, asked, asked.points, asked.values, asked.grads, scratch);
      return;
    }
    const BlockLanes<3> here = frame.lanes<3>();
    const std::array<const float*, 3> from{asked.points.x, asked.points.y, asked.points.z};
    const std::uint8_t* order = asked.order.data() + asked.begin[index];
    for (std::size_t c = 0; c < 3; ++c) {
      float* to = std::copy_n(left.points[c], left.count, here[c]);
      for (int k = 0; k < starting; ++k) to[k] = from[c][order[k]];
    }
    float* hereValues = frame.lane();
    const BlockLanes<3> hereGradLanes = frame.lanes<3>();
    const BlockLanes<3>* hereGrads = asked.grads ? &hereGradLanes : nullptr;
    const PointBlock points = scratch.pointBlock(here, count);
    sample(index, points, hereValues, hereGrads);
    if (index < last_) blendWithNext(index, asked, points, hereValues, hereGrads, scratch);
    const auto hand = [&](const float* lane, float* toLeft, float* toAsked) {
      if (left.count > 0) std::copy_n(lane, left.count, toLeft);
      for (int k = 0; k < starting; ++k) toAsked[order[k]] = lane[left.count + k];
    };
    hand(hereValues, values, asked.values);
    if (!asked.grads) return;
    for (std::size_t c = 0; c < 3; ++c)
      hand(hereGradLanes[c], grads ? (*grads)[c] : nullptr, (*asked.grads)[c]);
  }

  /// Blends what level `index` says at `points` with the levels after it where those have a say, and
  /// evaluates the points that start there.
  void blendWithNext(std::size_t index, const Asked& asked, const PointBlock& points, float* values,
                     const BlockLanes<3>* grads, Scratch& scratch) const {
    const DistanceLevel& level = levels_->all[index];
    const Bounds own(level, level.nextStart);
    std::int32_t farCount = 0;
    for (int i = 0; i < points.count; ++i) farCount += own.leave(values[i]);
    if (farCount == 0 && asked.startingAfter(index) == 0) return;
    Scratch::Frame frame(scratch);
    Far far(frame);
    if (farCount > 0) {
      for (int i = 0; i < points.count; ++i) {
        far.source[std::size_t(far.count)] = std::uint8_t(i);
        far.count += own.leave(values[i]);
      }
      const std::array<const float*, 3> from{points.x, points.y, points.z};
      for (std::size_t c = 0; c < 3; ++c)
        for (int k = 0; k < far.count; ++k) far.points[c][k] = from[c][far.source[std::size_t(k)]];
    }
    float* farValues = frame.lane();
    const BlockLanes<3> farGrads = frame.lanes<3>();
    evalFrom(index + 1, asked, far, farValues, grads ? &farGrads : nullptr, scratch);
    const float perBlend = 1.0f / level.nextBlend;
    for (int k = 0; k < far.count; ++k) {
      const int i = far.source[std::size_t(k)];
      const float v = values[i];
      const float t = (std::abs(v) - level.nextStart) * perBlend;
      const float step = farValues[k] - v;
      values[i] = t < 1.0f ? v + t * step : farValues[k];
      if (!grads) continue;
      const float slope = std::copysign(perBlend, v) * step;
      for (std::size_t c = 0; c < 3; ++c) {
        float& g = (*grads)[c][i];
        g = t < 1.0f ? g + (t * (farGrads[c][k] - g) + slope * g) : farGrads[c][k];
      }
    }
  }

  std::shared_ptr<const DistanceLevels> levels_;
  std::size_t first_, last_;
};

}  // namespace

ScalarField distanceOfLevels(std::shared_ptr<const DistanceLevels> levels) {
  const std::size_t last = levels->all.size() - 1;
  return ScalarField(std::make_shared<MeshDistanceNode>(std::move(levels), 0, last));
}

}  // namespace nephele::detail

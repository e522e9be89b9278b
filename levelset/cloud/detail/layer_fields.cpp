#include "nephele/levelset/cloud/detail/layer_fields.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "nephele/modeling/cloud/surface_point.h"

namespace nephele::detail {
namespace {

class GrownNode final : public FieldNode<float> {
 public:
  GrownNode(const ScalarField& before, const ScalarField& level, const ScalarField& displacement)
      : before_(before.node()), level_(level.node()), displacement_(displacement.node()) {}

  void eval(const PointBlock& points, const BlockLanes<1>& values, Scratch& scratch) const override {
    Scratch::Frame frame(scratch);
    float* grown = frame.lane();
    displacement_->eval(points, {grown}, scratch);
    if (before_ == level_) {
      level_->eval(points, values, scratch);
      for (int i = 0; i < points.count; ++i) values[0][i] += std::abs(grown[i]);
      return;
    }
    const BlockLanes<3> where = frame.lanes<3>();
    std::array<std::uint8_t, kBlockSize> origin;
    int count = 0;
    for (int i = 0; i < points.count; ++i) {
      if (grown[i] == 0) continue;
      where[0][count] = points.x[i];
      where[1][count] = points.y[i];
      where[2][count] = points.z[i];
      origin[count++] = static_cast<std::uint8_t>(i);
    }
    if (count < points.count) level_->eval(points, values, scratch);
    if (count == 0) return;
    float* before = frame.lane();
    before_->eval(scratch.pointBlock(where, count), {before}, scratch);
    for (int i = 0; i < count; ++i) values[0][origin[i]] = before[i] + std::abs(grown[origin[i]]);
  }

  Interval range(const Box& box, RangeMemo& memo) const override {
    const Interval grown = memo.of(displacement_, box);
    return (grown.isPoint() ? memo.of(level_, box) : memo.of(before_, box)) + abs(grown);
  }

 private:
  NodePtr<float> before_, level_, displacement_;
};

class NeededNode final : public FieldNode<float> {
 public:
  NeededNode(const CumuloStep& step, std::span<const CumuloLayer> asked, float further, float voxelSize)
      : displacement_(step.displacement.node()),
        level_(step.level.node()),
        reach_(step.reach),
        margin_(step.margin),
        voxelSize_(voxelSize),
        further_(further),
        leastReach_(further) {
    for (const CumuloLayer& layer : asked) {
      heights_.push_back({layer.amplitude.node(), layer.noise.range(Box::everywhere()).magnitude()});
      leastReach_ += layer.amplitude.range(Box::everywhere()).min * heights_.back().noiseBound;
    }
  }

  void eval(const PointBlock& points, const BlockLanes<1>& values, Scratch& scratch) const override {
    displacement_->eval(points, values, scratch);
  }

  Interval range(const Box& box, RangeMemo& memo) const override {
    const Interval range = memo.of(displacement_, box);
    if (range.isPoint()) return range;
    const Interval level = memo.of(level_, box);
    const float missing = -level.max - kOuterShare * margin_;
    // Wherever amplitudes are read from.
    if (level.max > 0 || leastReach_ >= missing) return range;
    // Levels rise from layer to layer: no later surface point is farther.
    const float depth = std::min(-level.min, reach_ + margin_);
    const Box near = box.expanded(farthestSurfacePoint(depth, voxelSize_));
    // Amplitudes in a box can take a search: the first often tell.
    float reach = further_;
    for (const Height& height : heights_) {
      reach += memo.of(height.amplitude, near).max * height.noiseBound;
      if (reach >= missing) return range;
    }
    return Interval::of(0);
  }

 private:
  struct Height {
    NodePtr<float> amplitude;
    float noiseBound;
  };

  NodePtr<float> displacement_, level_;
  std::vector<Height> heights_;
  float reach_, margin_, voxelSize_, further_;
  /// What the layers add at least where their noise is largest.
  float leastReach_;
};

bool isVarying(const CumuloLayer& layer) {
  return !layer.amplitude.range(Box::everywhere()).isPoint();
}

}  // namespace

ScalarField grownLevel(const ScalarField& before, const ScalarField& level, const ScalarField& displacement) {
  return ScalarField(std::make_shared<GrownNode>(before, level, displacement));
}

ScalarField neededDisplacement(const CumuloStep& step, std::span<const CumuloLayer> asked, float further,
                               float voxelSize) {
  if (std::ranges::none_of(asked, isVarying)) return step.displacement;
  return ScalarField(std::make_shared<NeededNode>(step, asked, further, voxelSize));
}

}  // namespace nephele::detail

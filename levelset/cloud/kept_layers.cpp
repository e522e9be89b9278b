#include "nephele/levelset/cloud/kept_layers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "nephele/levelset/grid/packed_grid.h"
#include "nephele/modeling/base/error.h"

namespace nephele {
namespace {

// No key contains it, so that keys side by side cannot be mistaken for others.
constexpr char kBetween = '\n';

}  // namespace

std::size_t KeptLayers::count(const std::vector<CumuloLayer>& layers, const Box& box, float voxelSize) {
  constexpr double kMostBricks = 4096;
  const auto bricks = [&](std::size_t index) {
    const float edge = float(BrickGrid::kBrick) * cumuloVoxelSize(layers, index, voxelSize);
    const Vec3f size = (box.max - box.min) * (1 / edge);
    return double(size.x) * double(size.y) * double(size.z);
  };
  std::size_t count = 0;
  while (count + 1 < layers.size() && bricks(count) <= kMostBricks) ++count;
  return count;
}

float KeptLayers::reach(const std::vector<CumuloLayer>& layers, std::size_t index, float voxelSize,
                        std::size_t count) {
  constexpr float kStepsPerBound = 4;
  float reach = displacementBound(layers, std::max(index, count));
  for (std::size_t i = count; i-- > index;) {
    const float bound = detail::layerBound(layers, i);
    const float step = std::max(bound, voxelSize) / kStepsPerBound;
    reach = bound + step * std::ceil(reach / step);
  }
  return reach;
}

bool KeptLayers::areLaterAsked(std::span<const CumuloLayer> layers) {
  return std::ranges::any_of(layers, [](const CumuloLayer& layer) {
    const Interval amplitude = layer.amplitude.range(Box::everywhere());
    return !amplitude.isPoint() && amplitude.min <= 0;
  });
}

ScalarField KeptLayers::distance(const std::string& numbers, bool isKept,
                                 const std::function<ScalarField()>& make) {
  const std::string key = keys_.shape + kBetween + numbers;
  taken_ = 0;
  if (distanceKey_ != key) {
    layers_.clear();
    layerKeys_.clear();
    distance_.reset();
    distanceKey_ = key;
  }
  if (distance_) return *distance_;
  ScalarField made = make();
  if (isKept) distance_ = made;
  return made;
}

std::string KeptLayers::keyOf(const CumuloStep& step, const std::vector<CumuloLayer>& layers,
                              const std::string& numbers) const {
  std::string key = keys_.layers.at(step.index) + kBetween + numbers;
  if (areLaterAsked(std::span(layers).subspan(step.index)))
    for (std::size_t i = step.index + 1; i < layers.size(); ++i) key += kBetween + keys_.layers.at(i);
  return key;
}

const KeptLayers::Layer* KeptLayers::find(const CumuloStep& step, const std::vector<CumuloLayer>& layers,
                                          const std::string& numbers) {
  require(keys_.layers.size() >= layers.size(),
          fmt::format("KeptLayers: expected a key for each of {} layers, got {}", layers.size(),
                      keys_.layers.size()));
  wanted_ = keyOf(step, layers, numbers);
  if (step.index < layers_.size() && layerKeys_[step.index] == wanted_) {
    ++taken_;
    return &layers_[step.index];
  }
  while (layers_.size() > step.index) layers_.pop_back();
  layerKeys_.resize(layers_.size());
  return nullptr;
}

void KeptLayers::keep(Layer layer) {
  layers_.push_back(std::move(layer));
  layerKeys_.push_back(std::move(wanted_));
}

}  // namespace nephele

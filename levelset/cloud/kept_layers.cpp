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

std::size_t bytesOf(const KeptLayers::Layer& layer) {
  return layer.displacement->memoryBytes() + (layer.level ? layer.level->memoryBytes() : 0);
}

}  // namespace

float KeptLayers::reach(const std::vector<CumuloLayer>& layers, std::size_t index, float voxelSize) {
  constexpr float kStepsPerBound = 4;
  float reach = 0;
  for (std::size_t i = layers.size(); i-- > index;) {
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

ScalarField KeptLayers::distance(const std::string& numbers, const std::function<ScalarField()>& make) {
  const std::string key = keys_.shape + kBetween + numbers;
  taken_ = 0;
  if (distanceKey_ != key) {
    layers_.clear();
    layerKeys_.clear();
    distance_.reset();
    distanceKey_ = key;
  }
  if (!distance_) distance_ = make();
  return *distance_;
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
  wantedIndex_ = step.index;
  if (step.index < layers_.size() && layerKeys_[step.index] == wanted_) {
    ++taken_;
    return &layers_[step.index];
  }
  while (layers_.size() > step.index) layers_.pop_back();
  layerKeys_.resize(layers_.size());
  return nullptr;
}

void KeptLayers::keep(Layer layer) {
  std::size_t bytes = bytesOf(layer);
  for (const Layer& before : layers_) bytes += bytesOf(before);
  if (wantedIndex_ != layers_.size() || bytes > kMostBytes) {
    distance_.reset();
    return;
  }
  layers_.push_back(std::move(layer));
  layerKeys_.push_back(std::move(wanted_));
}

}  // namespace nephele

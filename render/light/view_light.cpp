#include "nephele/render/light/view_light.h"

#include <algorithm>
#include <map>
#include <utility>

#include "nephele/render/light/baked_light.h"

namespace nephele::detail {

ViewLight::ViewLight(const BakedLight& lit, const Viewpoint& viewpoint) {
  const bool once = lit.octaves.count == 1;
  std::vector<const ScatteredLight*> lights;
  for (const auto* list : {&lit.scattered, &lit.glow})
    for (const std::shared_ptr<const ScatteredLight>& light : *list)
      if (light && std::ranges::find(lights, light.get()) == lights.end()) lights.push_back(light.get());
  std::vector<std::vector<float>> sent;
  if (once)
    for (const ScatteredLight* light : lights) sent.push_back(light->mean());
  else
    sent = ScatteredLight::towards(lights, viewpoint);
  // Colours and lights that are alike share what is made.
  std::map<std::pair<const ScatteredLight*, float>, Values> made;
  const auto valuesOf = [&](const std::shared_ptr<const ScatteredLight>& light, int colour) -> Values {
    if (!light) return nullptr;
    const float mean = lit.meanAlbedo[colour], own = lit.medium.albedo[colour],
                share = once       ? own
                        : mean > 0 ? own / mean
                                   : 0.0f;
    Values& values = made[{light.get(), share}];
    if (!values) {
      std::vector<float> its = sent[std::size_t(std::ranges::find(lights, light.get()) - lights.begin())];
      if (share != 1)
        for (float& value : its) value *= share;
      values = std::make_shared<const std::vector<float>>(std::move(its));
    }
    return values;
  };
  // The parts of a sky are colours, but where all colours are alike.
  for (std::size_t i = 0; i != lit.scattered.size(); ++i)
    scattered_.push_back(valuesOf(lit.scattered[i], int(i % std::size_t(lit.scene.colours))));
  for (std::size_t c = 0; c != lit.glow.size(); ++c) glow_.push_back(valuesOf(lit.glow[c], int(c)));
}

void ViewLight::bind(MarchScene& scene) const {
  scene.scattered.clear();
  bool some = false;
  for (const Values& values : scattered_) {
    scene.scattered.push_back(values ? values->data() : nullptr);
    some = some || values;
  }
  if (!some) scene.scattered.clear();
  for (std::size_t c = 0; c != glow_.size(); ++c) scene.glow[c] = glow_[c] ? glow_[c]->data() : nullptr;
}

}  // namespace nephele::detail

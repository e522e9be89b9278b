#include "nephele/render/light/view_light.h"

#include <map>
#include <utility>

#include "nephele/render/light/baked_light.h"

namespace nephele::detail {

ViewLight::ViewLight(const BakedLight& lit, const Viewpoint& viewpoint) {
  // Colours and lights that are alike share what is made.
  std::map<std::pair<const ScatteredLight*, float>, Values> made;
  const auto valuesOf = [&](const std::shared_ptr<const ScatteredLight>& light, int colour) -> Values {
    if (!light) return nullptr;
    const bool once = lit.octaves.count == 1;
    const float mean = lit.meanAlbedo[colour], own = lit.medium.albedo[colour],
                share = once       ? own
                        : mean > 0 ? own / mean
                                   : 0.0f;
    Values& values = made[{light.get(), share}];
    if (!values) {
      std::vector<float> sent = once ? light->mean() : light->towards(viewpoint);
      if (share != 1)
        for (float& value : sent) value *= share;
      values = std::make_shared<const std::vector<float>>(std::move(sent));
    }
    return values;
  };
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

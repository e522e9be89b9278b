#include "nephele/render/light/view_light.h"

#include <algorithm>

#include "nephele/modeling/base/parallel.h"
#include "nephele/render/light/baked_light.h"

namespace nephele::detail {

ViewLight::ViewLight(const BakedLight& lit, const Viewpoint& viewpoint) {
  const bool once = lit.octaves.count == 1;
  // Colours and lights that are alike share what is sent.
  std::vector<const ScatteredLight*> lights;
  struct Sent {
    std::size_t light;
    MarchScene::Scattered::Kind kind;
    float share;
  };
  std::vector<Sent> all;
  const auto add = [&](const ScatteredLight* light, int from, int part) {
    if (!light) return;
    const int colour = lit.scene.colours == 1 ? 0 : part;
    const auto place = std::size_t(std::ranges::find(lights, light) - lights.begin());
    if (place == lights.size()) lights.push_back(light);
    const float mean = lit.meanAlbedo[colour], own = lit.medium.albedo[colour];
    all.push_back({place, {from, part}, once ? own : mean > 0 ? own / mean : 0.0f});
  };
  // Where all colours are alike, a sky may have more parts than one.
  const int colours = lit.scene.colours, ofLights = colours * int(lit.scene.lightCount());
  for (int i = 0; i != int(lit.scattered.size()); ++i) {
    const ScatteredLight* light = lit.scattered[std::size_t(i)].get();
    if (i < ofLights)
      add(light, i / colours, i % colours);
    else
      add(light, MarchScene::Scattered::kSky, i - ofLights);
  }
  for (std::size_t c = 0; c != lit.glow.size(); ++c)
    add(lit.glow[c].get(), MarchScene::Scattered::kGlow, int(c));

  std::vector<std::vector<float>> sent;
  if (once)
    for (const ScatteredLight* light : lights) sent.push_back(light->mean());
  else
    sent = ScatteredLight::towards(lights, viewpoint);
  for (std::size_t i = 0; i < all.size(); i += 2) {
    const Sent &first = all[i], &second = all[std::min(i + 1, all.size() - 1)];
    const std::vector<float>&values = sent[first.light], &beside = sent[second.light];
    std::vector<float>& nodes = nodes_.emplace_back(2 * values.size());
    parallelFor(values.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n != end; ++n) {
        nodes[2 * n] = values[n] * first.share;
        nodes[2 * n + 1] = beside[n] * second.share;
      }
    });
    scattered_.push_back({nodes.data(), &first == &second ? 1 : 2, {first.kind, second.kind}});
  }
}

}  // namespace nephele::detail

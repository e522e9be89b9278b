#include "apps/options/picture/light_key.h"

#include <fmt/format.h>

#include <vector>

#include "apps/options_digest.h"

namespace nephele::apps {
namespace {

constexpr std::string_view kOfCamera[]{"size",           "crop",
                                       "view",           "camera-position",
                                       "look-at",        "up",
                                       "camera",         "rotation-order",
                                       "frame",          "fov",
                                       "focal-length",   "film-width",
                                       "projection",     "orthographic-width",
                                       "f-stop",         "lens-radius",
                                       "focus-distance", "step",
                                       "samples",        "adaptive",
                                       "integrator",     "scatterings",
                                       "seed",           "aov",
                                       "holdout",        "background",
                                       "backdrop",       "aerial-perspective"};
constexpr std::string_view kOfScreen[]{"view-transform", "ocio-config", "exposure"};
constexpr std::string_view kOfCalls[]{"frames", "only", "shard", "wedge"};

}  // namespace

std::span<const std::string_view> cameraOptions() {
  return kOfCamera;
}

std::span<const std::string_view> screenOptions() {
  return kOfScreen;
}

std::string lightKey(const CLI::App& app, const SceneOptions& scene, const PictureOptions& picture,
                     Run& run) {
  if (picture.pathTraced || isScript(scene.inputs) || !picture.light.writtenShadows.empty()) return "";
  std::vector<std::string_view> others(std::begin(kOfCalls), std::end(kOfCalls));
  others.insert(others.end(), std::begin(kOfCamera), std::end(kOfCamera));
  others.insert(others.end(), std::begin(kOfScreen), std::end(kOfScreen));
  // Expressions may know the frame. Layers decide what of the volume is kept.
  ContentHash more;
  if (!picture.volumes.color.empty()) more.add(std::to_string(run.frame().value_or(0)));
  more.add(fmt::format("{} {}", picture.readsCodes(), picture.needsSamples()));
  if (run.part && run.part->range) more.add(run.part->range->text());
  return optionsDigest(app, others, more.text(), run.files);
}

}  // namespace nephele::apps

#include "apps/options/picture/picture_keys.h"

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
constexpr std::string_view kOfLights[]{
    "sun", "point",         "spot",         "light-decay",   "shadow-multiplier",
    "sky", "ground-albedo", "sky-rotation", "sky-intensity", "sky-encoding"};
constexpr std::string_view kOfMedium[]{"shadows",          "shadow-detail",
                                       "shadow-tolerance", "read-deep-shadow",
                                       "extinction",       "albedo",
                                       "extinction-color", "phase",
                                       "octaves",          "scale",
                                       "quality",          "light-quality",
                                       "object",           "holdout-object",
                                       "object-color",     "checker",
                                       "texture",          "texture-encoding",
                                       "ground",           "ground-height",
                                       "ground-color"};
constexpr std::string_view kOfScreen[]{"view-transform", "ocio-config", "exposure"};
constexpr std::string_view kOfCalls[]{"frames", "only", "shard", "wedge"};

}  // namespace

std::span<const std::string_view> cameraOptions() {
  return kOfCamera;
}

std::span<const std::string_view> screenOptions() {
  return kOfScreen;
}

std::span<const std::string_view> lightOptions() {
  return kOfLights;
}

std::span<const std::string_view> mediumOptions() {
  return kOfMedium;
}

PictureStages::Keys pictureKeys(const CLI::App& app, const SceneOptions& scene, const PictureOptions& picture,
                                Run& run) {
  if (picture.pathTraced || isScript(scene.inputs) || !picture.light.writtenShadows.empty()) return {};
  // Expressions may know the frame and the seed. Layers and surfaces decide what of the volume is kept.
  ContentHash more;
  if (!picture.volumes.color.empty()) more.add(fmt::format("{} {}", picture.time(run), picture.seed));
  more.add(fmt::format("{} {} {}", picture.readsCodes(), picture.needsSamples(), scene.objects.any()));
  if (run.part && run.part->range) more.add(run.part->range->text());
  const std::string text = more.text();
  std::vector<std::string_view> others(std::begin(kOfCalls), std::end(kOfCalls));
  const auto digestWithout = [&](std::span<const std::string_view> names) {
    others.insert(others.end(), names.begin(), names.end());
    return optionsDigest(app, others, text, run.files);
  };
  others.insert(others.end(), std::begin(kOfScreen), std::end(kOfScreen));
  PictureStages::Keys keys;
  keys.lights = digestWithout(kOfCamera);
  keys.medium = digestWithout(kOfLights);
  keys.volume = digestWithout(kOfMedium);
  return keys;
}

}  // namespace nephele::apps

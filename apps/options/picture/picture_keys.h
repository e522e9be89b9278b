#pragma once

#include <span>
#include <string_view>

#include "apps/options/picture/scene_options.h"
#include "nephele/render/session/picture_stages.h"

namespace nephele::apps {

/// Options that say from where a volume is looked at, and how finely; the light in it does not depend on
/// them.
std::span<const std::string_view> cameraOptions();
/// Options that say how pictures are shown; their linear pixels do not depend on them.
std::span<const std::string_view> screenOptions();

/// Options that say what shines.
std::span<const std::string_view> lightOptions();
/// Options that say what becomes of light beside the volume: its medium, and surfaces.
std::span<const std::string_view> mediumOptions();

/// Says what the steps to a picture of volumes depend on, `app` having read its options: pictures of equal
/// keys are of one volume in one light. Empty where every picture has its own: of scripts, which are sampled
/// for the camera, of paths, and of those that write deep shadows.
PictureStages::Keys pictureKeys(const CLI::App& app, const SceneOptions& scene, const PictureOptions& picture,
                                Run& run);

}  // namespace nephele::apps

#pragma once

#include <span>
#include <string>
#include <string_view>

#include "apps/options/picture/scene_options.h"

namespace nephele::apps {

/// Options that say from where a volume is looked at, and how finely; the light in it does not depend on
/// them.
std::span<const std::string_view> cameraOptions();
/// Options that say how pictures are shown; their linear pixels do not depend on them.
std::span<const std::string_view> screenOptions();

/// Says what the light in the volumes of a picture depends on, `app` having read its options: pictures of
/// equal keys are of one volume in one light. "" where every picture has its own: of scripts, which are
/// sampled for the camera, of paths, and of those that write deep shadows.
std::string lightKey(const CLI::App& app, const SceneOptions& scene, const PictureOptions& picture, Run& run);

}  // namespace nephele::apps

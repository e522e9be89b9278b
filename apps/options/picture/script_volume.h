#pragma once

#include <string>
#include <utility>
#include <vector>

#include "apps/options/picture/render_options.h"

namespace nephele::apps {

/// How a script that stands for a volume is looked at.
struct ScriptOptions {
  enum class Detail {
    /// Sampled as finely as the picture shows it.
    camera,
    /// Asked by every ray; no grid stands between the script and the picture.
    exact
  };
  Detail detail = Detail::camera;
  /// Parameters of the script, as NAME=VALUE.
  std::vector<std::string> settings;
};

/// Declares --detail and --set on `app`.
void addScriptOptions(CLI::App& app, ScriptOptions& options);

/// Whether the input is a script: one file, whose name ends with .felt. @throws Error if it is one of
/// several.
bool isScript(const std::vector<std::string>& paths);

/// Runs the script and makes what it declares into a volume for the camera of `picture`:
///
///     scalarfield density          what is looked at, per world unit; values below 0 count as 0
///     domain bounds                where it is; not declared: found from the field's ranges
///     vectorfield color            multiplies the albedo, 0 to 1
///     vectorfield emission         light of its own, or a scalarfield for white light
///     scalarfield temperature      glows as a black body, kelvin
///     vectorfield velocity         world units per second, blurs while the shutter is open
///     float extinction             where --extinction is not given
///     vector sky                   radiance of the sky, where --sky is not given
///     vector sun                   azimuth, elevation and irradiance, where no light is given
///
/// `time` is the frame, `seed` that of the picture. @throws felt::ScriptError; Error naming the file where it
/// declares no density, or one that ends nowhere.
RenderVolume scriptVolume(const std::string& path, const ScriptOptions& options, PictureOptions& picture,
                          Run& run);

}  // namespace nephele::apps

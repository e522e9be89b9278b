#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/options/picture/render_options.h"
#include "nephele/render/volume/field_volume.h"

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

/// Refuses parameters where nothing is a script. @throws CLI::ValidationError naming the option.
void requireNoSettings(const ScriptOptions& options);

/// Whether the input is a script: one file, whose name ends with .felt. @throws Error if it is one of
/// several.
bool isScript(const std::vector<std::string>& paths);

/// A script as a volume that is sampled for one camera or another. What it declares of one:
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
class ScriptVolume {
 public:
  /// Runs the script; what it says of the picture goes into `picture`, see suggestTo. `time` is the frame,
  /// `seed` that of the picture. @throws felt::ScriptError; Error naming the file where it declares no
  /// density, or one that ends nowhere.
  ScriptVolume(const std::string& path, const ScriptOptions& options, PictureOptions& picture, Run& run);

  /// Whether voxels stand between the script and the picture.
  bool isSampled() const { return !isExact_; }
  /// What the script says of a picture, where its options do not.
  void suggestTo(PictureOptions& picture) const;
  /// Where there may be density.
  const Box& box() const { return parts_.box; }
  /// As it is to be seen through the camera of `picture`.
  RenderVolume forCameraOf(const PictureOptions& picture, Run& run);
  /// The voxels of that; nothing where the script is empty. Looks at the script coarsely at the first call.
  std::optional<float> voxelSizeFor(const PictureOptions& picture, Run& run);
  /// The voxels that `camera` asks for: as wide as a pixel, or up to 9 % less, so that cameras that see it
  /// from about as far away share them.
  float voxelSize(const Camera& camera, const Progress& progress);
  /// Depends on nothing else.
  RenderVolume withVoxels(float voxelSize, const Progress& progress) const;

 private:
  /// Those in which it is looked at to frame it.
  float coarseVoxels() const;

  std::string path_;
  FieldParts parts_;
  bool isExact_;
  std::optional<double> extinction_;
  std::optional<Vec3d> sky_, sun_;
  /// What is seen of it from anywhere, once that is known.
  std::optional<Extent> seen_;
  std::optional<FieldResolution> resolution_;
};

}  // namespace nephele::apps

#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/options/picture/object_options.h"
#include "apps/options/picture/render_options.h"
#include "apps/options/picture/script_volume.h"

namespace nephele::apps {

/// What is looked at: volumes of files, read once, or a script, sampled for one camera after another.
class SceneVolume {
 public:
  explicit SceneVolume(RenderVolume volume) : volume_(std::move(volume)) {}
  /// `volume` has been sampled from `script`.
  SceneVolume(RenderVolume volume, ScriptVolume script)
      : volume_(std::move(volume)), script_(std::move(script)) {}

  const RenderVolume& volume() const { return *volume_; }
  RenderVolume taken() && { return *std::move(volume_); }
  /// The voxels that `camera` asks for, where they are others than those that there are. Only of scripts that
  /// are sampled: files have theirs, and what rays ask is as fine from everywhere.
  std::optional<float> otherVoxels(const Camera& camera, const Progress& progress);
  /// Samples the script anew. The volume of before is given up first, so whoever refers to it must have gone.
  void resample(float voxelSize, const Progress& progress);

 private:
  std::optional<RenderVolume> volume_;
  std::optional<ScriptVolume> script_;
};

/// What is in a picture, beside the options of how it is seen: volumes, objects, and what hides them.
struct SceneOptions {
  std::vector<std::string> inputs;
  ObjectOptions objects;
  /// Deep pictures: one to be written, and one of what stands in front. "" where there is none.
  std::string deep, holdout;

  ScriptOptions script;

  /// Reads the inputs as they are marched, all as one; notes where that is empty. A script may say an
  /// extinction, which goes into `picture`. @throws as readVolumes and ScriptVolume.
  SceneVolume sceneVolume(PictureOptions& picture, Run& run) const;
  /// For one camera, that of `picture`.
  RenderVolume volume(PictureOptions& picture, Run& run) const;
  /// Whether the volume is another one at another time, though its file is the same.
  bool changesWithTime(const PictureOptions& picture) const;
  /// How large the inputs are: volumes, or shapes alone. @throws Error naming the file.
  Extent measured(const PictureOptions& picture, Run& run) const;
  /// The same for sequences, with what of the outline the camera of `picture` frames.
  Extent extent(const PictureOptions& picture, Run& run) const;
  /// Puts the objects into `picture`, which is resolved and shown on screens, too, or not, and that it is to
  /// have depth. @throws CLI::Error for
  /// options that do not fit together, Error naming the file of an object.
  void addTo(PictureOptions& picture, const RenderVolume& volume, bool isShown, const Run& run) const;
};

/// Says so where a holdout meets an extinction that differs between colours.
void noteColouredHoldout(const SceneOptions& scene, const PictureOptions& picture, const Run& run);

/// Declares the inputs on `app`, described by `inputs`.
void addSceneInputs(CLI::App& app, SceneOptions& options, const std::string& inputs);
/// Declares --deep, --holdout and the options of objects, after those of pictures.
void addSceneOptions(CLI::App& app, SceneOptions& options, OutputTrial trial = OutputTrial::program);

}  // namespace nephele::apps

#pragma once

#include <optional>

#include "apps/detail/turntable_plan.h"

namespace nephele::apps {

/// What a turntable turns around, and all that follows from it: a volume, or another one in every frame.
class TurntableScene {
 public:
  /// Reads the volume of `frame`. `picture` is that of the options, not resolved yet. @throws as `turnTo`.
  TurntableScene(const TurntableOptions& options, const PictureOptions& picture, const TurntableFrame& frame,
                 Run& run);

  /// Whether the volume is that of `frame`.
  bool isOf(const TurntableFrame& frame) const { return volume_ && frame.volumeKey == key_; }
  /// Lets the volume go, which nothing may refer to any more, and reads that of `frame`.
  /// @throws as SceneOptions::volume and PictureOptions::resolved.
  void turnTo(const TurntableFrame& frame, Run& run);
  /// Refuses frames of it that need more memory than is allowed, `start` being their first camera.
  /// @throws Error
  void requireMemory(const Camera& start, const Run& run) const;

  /// See SceneVolume.
  std::optional<float> otherVoxels(const Camera& camera, const Progress& progress) {
    return volume_->otherVoxels(camera, progress);
  }
  void resample(float voxelSize, const Progress& progress);

  const RenderVolume& volume() const { return volume_->volume(); }
  /// Resolved, and with the objects.
  const PictureOptions& picture() const { return picture_; }

 private:
  const TurntableOptions& options_;
  const PictureOptions given_;
  PictureOptions picture_;
  std::optional<SceneVolume> volume_;
  std::string key_;
};

}  // namespace nephele::apps

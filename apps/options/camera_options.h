#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/options/options.h"
#include "nephele/render/scene/camera_motion.h"
#include "nephele/render/volume/render_volume.h"

namespace nephele::apps {

/// From where a volume is looked at, through which lens, and what moves meanwhile.
struct CameraOptions {
  /// What the picture is; angle and width of view are those below.
  Camera::Frame frame;
  /// Azimuth and elevation of a camera that frames the volume; `position` takes its place where it is given,
  /// `file` theirs.
  Vec3f view{25, 5, 0};
  std::optional<Vec3f> position, lookAt;
  Vec3f up{0, 1, 0};
  /// What `view` frames; the outline of the volume if empty.
  std::vector<Vec3f> framed;
  std::string file;
  RotationOrder rotationOrder;
  /// Frame of the file; its first if not given.
  std::optional<double> frameNumber;
  /// What is given here goes before what the file says. Focal length and film in millimetres.
  std::optional<double> fovDegrees, focalLength;
  double filmWidth = 36;
  std::optional<double> orthographicWidth;
  std::optional<double> fStop, lensRadius;
  /// The middle of the volume if not given.
  std::optional<double> focusDistance;
  Shutter shutter;
  /// World units, and degrees about its middle, per frame.
  std::optional<RigidMotion> volumeMotion;
  /// The volume has velocities, so that a shutter shows without any other motion.
  bool volumeFlows = false;

  /// The camera that these options place around `volume`. @throws CLI::Error for options that do not fit
  /// together, Error for a bad file.
  Camera camera(const RenderVolume& volume) const { return camera(volume, 0); }
  /// The camera of `file` so many frames later; nothing without a file.
  std::optional<Camera> laterCamera(const RenderVolume& volume, double frames) const;
  /// The motion of `volume`, about its middle; nothing for an instant.
  std::optional<RigidMotion> motionOf(const RenderVolume& volume) const;

 private:
  Camera camera(const RenderVolume& volume, double framesLater) const;
};

/// Declares the options on `app`.
void addCameraOptions(CLI::App& app, CameraOptions& options);

}  // namespace nephele::apps

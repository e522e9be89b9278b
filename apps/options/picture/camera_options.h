#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/app.h"
#include "apps/extent.h"
#include "apps/options/options.h"
#include "nephele/render/scene/camera_motion.h"

namespace nephele::apps {

/// From where a volume is looked at, through which lens, and what moves meanwhile.
struct CameraOptions {
  /// What the picture is; angle and width of view are those below.
  Camera::Frame frame;
  /// Azimuth and elevation of a camera that frames the volume; `position` takes its place where it is given,
  /// `file` theirs.
  Vec3f view{25, -4, 0};
  bool viewGiven = false;
  std::optional<Vec3f> position, lookAt;
  Vec3f up{0, 1, 0};
  /// What is looked at: `view` frames its outline. Filled in by `placed`.
  Extent seen{};
  std::string file;
  RotationOrder rotationOrder;
  /// Frame of the file; that of the run, or else its first, if not given.
  std::optional<double> frameNumber;
  /// This is one of many pictures, and the width of an orthographic one must not change.
  bool isOneOfMany = false;
  /// What is given here goes before what the file says. Focal length and film in millimetres.
  std::optional<double> fovDegrees, focalLength, filmWidth;
  /// Percentages are of the longest side of the volume, or of what is framed if it is empty.
  std::optional<Length> orthographicWidth, lensRadius;
  std::optional<double> fStop;
  /// The middle of the volume if not given.
  std::optional<Length> focusDistance;
  Shutter shutter;
  /// World units, and degrees about its middle, per frame.
  std::optional<RigidMotion> volumeMotion;
  /// The volume has velocities, so that a shutter shows without any other motion.
  bool volumeFlows = false;

  /// These options for a picture of `own`; in a sequence, of all that its pictures show.
  CameraOptions placed(const Extent& own, const Run& run) const;
  /// The camera that these options place around what is seen. @throws CLI::Error for options that do not fit
  /// together, Error for a bad file.
  Camera camera() const { return camera(0); }
  /// The frame of the picture, as expressions and scripts find it: that of the run, of `file`, or 0.
  double time(const Run& run) const;
  /// The camera of `file` so many frames later; nothing without a file.
  std::optional<Camera> laterCamera(double frames) const;
  /// The motion of the volume, about the middle of what is seen; nothing for an instant.
  std::optional<RigidMotion> motion() const;
  /// Of `points`, enough for the camera to frame them together with others.
  std::vector<Vec3f> outermost(const std::vector<Vec3f>& points) const;

 private:
  Camera camera(double framesLater) const;
};

/// Declares the options on `app`.
void addCameraOptions(CLI::App& app, CameraOptions& options);

}  // namespace nephele::apps

#pragma once

#include <span>
#include <vector>

#include "nephele/render/scene/camera.h"
#include "nephele/render/scene/lights.h"

namespace nephele {

/// What turns about the vertical axis through the middle of the volume. All turn from +z (the front) towards
/// +x for positive turns.
enum class Orbit {
  /// The camera walks around the volume; the lights stand still, and so does what they do to the volume.
  camera,
  /// The volume turns before a still camera, under still lights.
  model,
  /// The lights turn around a still volume before a still camera.
  light,
};

/// Where the camera and the lights are at every frame of a turntable, as the volume sees them: its own place
/// never changes, so that what turns is the rest.
class Turntable {
 public:
  /// `turns` whole turns over the frames `first` .. `last`: the frame after `last` would be `first` again.
  /// @throws Error if last < first, or `turns` is 0, not finite or more than 1000 either way.
  Turntable(Orbit orbit, const Vec3f& middle, int first, int last, double turns = 1.0);

  /// 360 turns (frame - first) / (last - first + 1).
  double degreesAt(double frame) const;
  /// Where `start`, the camera of the first frame, is at `frame`.
  Camera camera(const Camera& start, double frame) const;
  /// What `start`, the lights of the first frame, are at `frame`.
  /// @throws Error where they turn and one of them has a shadow map, or the sky comes from a file.
  Lights lights(const Lights& start, double frame) const;

  bool cameraMoves() const { return orbit_ != Orbit::light; }
  bool lightsMove() const { return orbit_ != Orbit::camera; }

 private:
  Orbit orbit_;
  Vec3f middle_;
  int first_, last_;
  double turns_;
};

/// Points whose hull contains all that `points` pass over in a turn about the vertical axis through `middle`,
/// by at most 0.06 % of the distance to the axis more. A camera that frames them frames every frame of a
/// turntable, at one distance for all. Cost: a sort of `points`.
std::vector<Vec3f> sweptOutline(std::span<const Vec3f> points, const Vec3f& middle);

/// Those of `points` that are corners of the hull of all at their height: they have the same swept outline,
/// whatever the vertical axis is. Sorted by height. Cost: a sort of `points`.
std::vector<Vec3f> sweptCorners(std::span<const Vec3f> points);

}  // namespace nephele

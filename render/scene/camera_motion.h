#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nephele/render/scene/camera.h"
#include "nephele/render/scene/rotation.h"

namespace nephele {

/// While the shutter is open, in frames around the one that is rendered: {-0.25, 0.25} is half a frame,
/// centred. The same number twice is an instant.
struct Shutter {
  double open = 0.0, close = 0.0;

  bool isInstant() const { return open == close; }
};

/// What a camera does at one frame. Everything that is optional may be given at some frames only.
struct CameraKey {
  /// Of a full-frame still camera, millimetres.
  static constexpr double kFilmWidth = 36;

  double frame = 0.0;
  Vec3d position{};
  /// Camera to world; the camera looks along its own -z. Not used where there is a target.
  Rotation rotation{};
  /// What is in the middle of the picture; at all frames or at none.
  std::optional<Vec3d> target{};
  /// What is up, where there is a target.
  Vec3d up{0, 1, 0};
  /// Angle of view across the picture, or from its top to its bottom: one of them.
  std::optional<double> fovDegrees{}, verticalFovDegrees{};
  /// Millimetres, where it is known; the same at all keys.
  std::optional<double> filmWidth{};
  /// `fovDegrees` is that of a focal length in front of this film.
  bool hasFocalLength = false;
  std::optional<double> orthographicWidth{};
  /// One of them; the f-stop is focal length / diameter of the lens.
  std::optional<double> fStop{}, lensRadius{};
  std::optional<double> focusDistance{};
};

/// A camera that moves from key to key.
///
/// Positions, targets and lens values run along a curve without kinks through their keys (Catmull and Rom's,
/// with the tangents of a parabola through three keys, so that keys may be unevenly spaced), or along
/// straight lines. Rotations turn evenly about one axis from each key to the next. Angles of view change
/// evenly in focal length. Before the first and after the last key positions and rotations go on as they did
/// there, so that a shutter that opens before the first frame blurs it as others; lens values stay.
class CameraMotion {
 public:
  /// @throws Error if there are no keys, frames do not increase, only some have a target, or a value is not
  /// usable; the message starts with the frame.
  explicit CameraMotion(std::vector<CameraKey> keys, bool smooth = true);

  const std::vector<CameraKey>& keys() const { return keys_; }
  bool isSmooth() const { return smooth_; }
  double firstFrame() const { return keys_.front().frame; }
  double lastFrame() const { return keys_.back().frame; }

  /// The state at `frame`: every field that any key has is filled in. It has a target if the keys do, and its
  /// rotation always is the camera's.
  /// @throws Error if it looks nowhere, or straight up or down its `up`.
  CameraKey at(double frame) const;

 private:
  std::vector<CameraKey> keys_;
  bool smooth_;
};

/// A rigid motion at constant speed: what a volume does around the frame that is rendered.
struct RigidMotion {
  /// World units per frame.
  Vec3d velocity{};
  /// Axis of the turn, its length the degrees per frame.
  Vec3d spinDegrees{};
  /// The point about which the body turns, at the frame itself.
  Vec3d centre{};

  /// `ray`, which passes at `frames` after the frame, as the body sees it: in the place where it is at the
  /// frame itself. Lengths are kept.
  Ray toBody(const Ray& ray, double frames) const;
  /// The inverse: a ray of the body, where the body is at `frames` after the frame.
  Ray toWorld(const Ray& ray, double frames) const;
};

}  // namespace nephele

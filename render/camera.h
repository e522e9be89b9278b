#pragma once

#include <array>
#include <span>

#include "modeling/math.h"

namespace nephele {

/// A half line from `origin`; `direction` has length 1, so that distances along it are world units.
struct Ray {
  Vec3d origin;
  Vec3d direction;
};

/// Row-major 4x4 matrix for row vectors, p' = p M, as images store it.
using Mat44 = std::array<float, 16>;

/// A pinhole camera with square pixels.
class Camera {
 public:
  struct Frame {
    int width = 1280, height = 720;
    /// Horizontal angle of view.
    float fovDegrees = 35.0f;
  };

  /// A camera at `position` that sees `target` in the middle of the picture, `up` pointing up.
  /// @throws Error if the positions coincide, `up` is parallel to the line of sight, or the frame is not
  /// usable.
  static Camera lookingAt(const Vec3f& position, const Vec3f& target, const Vec3f& up, const Frame& frame);

  /// The nearest camera, standing towards `azimuthDegrees` and `elevationDegrees`, that sees all `points`
  /// with `margin` (share of the frame, each side) left free. Exact: the four sides of the frustum are moved
  /// until they touch. No points frame a unit sphere about the origin. @throws Error if the frame is not
  /// usable.
  static Camera framing(std::span<const Vec3f> points, float azimuthDegrees, float elevationDegrees,
                        const Frame& frame, float margin = 0.04f);

  /// The ray through (x, y) in pixels: (0, 0) is the upper left corner of the picture, (0.5, 0.5) the first
  /// pixel's centre.
  Ray ray(double x, double y) const;

  int width() const { return frame_.width; }
  int height() const { return frame_.height; }
  const Vec3d& position() const { return position_; }
  const Vec3d& forward() const { return forward_; }
  /// Width of a pixel at distance 1 along the line of sight.
  double pixelAngle() const { return 2.0 * halfWidth_ / frame_.width; }
  /// Position in pixels, and depth along the line of sight; meaningful where depth > 0.
  Vec3d project(const Vec3d& world) const;

  /// World to camera space: x right, y up, looking along -z.
  Mat44 worldToCamera() const;
  /// World to normalised device coordinates: after division by w, x and y run from -1 to 1 (right, up) over
  /// the picture; z is 1 / depth.
  Mat44 worldToNdc() const;

 private:
  Camera(const Vec3d& position, const Vec3d& right, const Vec3d& up, const Frame& frame);

  Frame frame_;
  Vec3d position_, right_, up_, forward_;
  double halfWidth_ = 1, halfHeight_ = 1;  // of the picture at distance 1
};

}  // namespace nephele

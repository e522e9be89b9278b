#pragma once

#include <optional>
#include <span>
#include <vector>

#include "nephele/modeling/base/math.h"
#include "nephele/render/image/image_camera.h"
#include "nephele/render/image/pixel_box.h"

namespace nephele {

/// A half line from `origin`; `direction` has length 1, so that distances along it are world units.
struct Ray {
  Vec3d origin;
  Vec3d direction;
};

/// Horizontal angle of view in degrees of a lens of `focalLength` in front of a film `filmWidth` wide (the
/// same unit, usually millimetres), focused at infinity: 2 atan(filmWidth / (2 focalLength)).
double fovDegreesOf(double focalLength, double filmWidth);
/// The focal length that has the horizontal angle of view `fovDegrees` on a film `filmWidth` wide.
double focalLengthOf(double fovDegrees, double filmWidth);

/// A camera with square pixels: perspective or orthographic, with a pinhole or a thin lens, still or moving
/// while its shutter is open.
class Camera {
 public:
  enum class Projection { perspective, orthographic };

  struct Frame {
    int width = 1280, height = 720;
    /// Horizontal angle of view of a perspective camera.
    float fovDegrees = 35.0f;
    Projection projection = Projection::perspective;
    /// Width of an orthographic picture in world units. `framing` finds it if it is not given.
    std::optional<float> orthographicWidth{};
    /// The pixels that are wanted; default: all. Everything else here is about the whole picture.
    std::optional<PixelBox> crop{};
  };

  /// A thin lens: a disc of `radius` world units, sharp at `focusDistance` along the line of sight. A point
  /// at depth d is seen as a disc whose radius at the focus distance f is radius |d - f| / d.
  struct Lens {
    double radius = 0.0;
    double focusDistance = 1.0;
  };

  /// A camera at `position` that sees `target` in the middle of the picture, `up` pointing up.
  /// @throws Error if the positions coincide, `up` is parallel to the line of sight, or the frame is not
  /// usable; an orthographic frame must have its width.
  static Camera lookingAt(const Vec3f& position, const Vec3f& target, const Vec3f& up, const Frame& frame);

  /// A camera at `position` whose picture has `right` and `up` as its axes: unit vectors, perpendicular.
  /// @throws Error as lookingAt does.
  static Camera facing(const Vec3d& position, const Vec3d& right, const Vec3d& up, const Frame& frame);

  /// The nearest camera, standing towards `azimuthDegrees` and `elevationDegrees`, that sees all `points`
  /// with `margin` (share of the frame, each side) left free. Exact: the four sides of the frustum are moved
  /// until they touch. An orthographic camera stands in front of all points and, unless the frame says how
  /// wide its picture is, is as narrow as it can be. No points frame a unit sphere about the origin.
  /// @throws Error if the frame is not usable.
  static Camera framing(std::span<const Vec3f> points, float azimuthDegrees, float elevationDegrees,
                        const Frame& frame, float margin = 0.04f);
  /// Those of `points` that decide where `framing` puts the camera, seven at most: so that the points of many
  /// clouds can be framed together without being kept.
  static std::vector<Vec3f> outermost(std::span<const Vec3f> points, float azimuthDegrees,
                                      float elevationDegrees, const Frame& frame, float margin = 0.04f);

  /// This camera with `lens` instead of a pinhole. @throws Error if the radius is negative or the focus
  /// distance not above 0.
  Camera withLens(const Lens& lens) const;

  /// This camera, moving: `poses` are where it is while the shutter is open, in equal steps from opening to
  /// closing; between them it moves evenly. Everything but `ray` with a time and `forwardAt` goes on to
  /// describe this camera. Less than two poses make a still one.
  Camera withShutter(std::span<const Camera> poses) const;

  /// This camera, all its poses included, turned by `degrees` about the vertical axis through `about`, from
  /// +z towards +x.
  Camera turned(const Vec3d& about, double degrees) const;

  /// The ray through (x, y) in pixels and the middle of the lens: (0, 0) is the upper left corner of the
  /// picture, (0.5, 0.5) the first pixel's centre.
  Ray ray(double x, double y) const { return rayFrom(pose_, x, y); }
  /// The ray through (x, y) and a point of the lens: [0, 1)^2 covers the lens evenly. It starts on the lens,
  /// in the plane through `position` across the line of sight. `time` runs from 0, where the shutter opens,
  /// to 1, where it closes; a still camera does not ask for it.
  Ray ray(double x, double y, double lensU, double lensV, double time = 0.0) const;

  int width() const { return frame_.width; }
  int height() const { return frame_.height; }
  /// The pixels to be rendered: the crop, or the whole picture.
  PixelBox window() const { return frame_.crop.value_or(picture()); }
  /// All pixels, whatever the crop.
  PixelBox picture() const { return {0, 0, frame_.width, frame_.height}; }
  bool isOrthographic() const { return frame_.projection == Projection::orthographic; }
  bool hasLens() const;
  bool isMoving() const { return !shutter_.empty(); }
  const Vec3d& position() const { return pose_.position; }
  const Vec3d& right() const { return pose_.right; }
  const Vec3d& up() const { return pose_.up; }
  const Vec3d& forward() const { return pose_.forward; }
  /// The camera as it is at `time`, standing still.
  Camera stillAt(double time) const;
  /// The line of sight at `time`, see `ray`.
  Vec3d forwardAt(double time) const { return isMoving() ? poseAt(time).forward : pose_.forward; }
  Lens lens() const { return {pose_.lensRadius, pose_.focusDistance}; }
  /// Width of the whole picture at distance 1 along the line of sight; of an orthographic one, anywhere.
  double screenWidth() const { return 2.0 * pose_.halfWidth; }
  /// Width of a pixel at distance 1 along the line of sight; 0 for an orthographic camera.
  double pixelAngle() const { return isOrthographic() ? 0.0 : 2.0 * pose_.halfWidth / frame_.width; }
  /// Width of a pixel at `depth` along the line of sight.
  double pixelWidth(double depth) const {
    return 2.0 * pose_.halfWidth / frame_.width * (isOrthographic() ? 1.0 : depth);
  }
  /// Position in pixels of the whole picture, and depth along the line of sight; meaningful where depth > 0.
  Vec3d project(const Vec3d& world) const;

  /// World to camera space as OpenEXR's standard attributes have it: x right, y up, z along the line of
  /// sight, hence left-handed.
  Mat44 worldToCamera() const;
  /// World to normalised device coordinates, likewise: after division by w, (0, 0) is the upper left corner
  /// and (1, 1) the lower right one of the whole picture, whatever the crop; z is 1 / depth, or -depth for an
  /// orthographic camera.
  Mat44 worldToNdc() const;
  /// What images store of it.
  operator ImageCamera() const { return {worldToCamera(), worldToNdc(), float(screenWidth())}; }

 private:
  struct Pose {
    Vec3d position, right, up, forward;
    double halfWidth = 1, halfHeight = 1;  // of the picture at distance 1, or of an orthographic one
    double lensRadius = 0, focusDistance = 1;
  };

  Camera(const Vec3d& position, const Vec3d& right, const Vec3d& up, const Frame& frame);
  /// At the origin, looking the other way.
  static Camera towards(float azimuthDegrees, float elevationDegrees, const Frame& frame);
  void setWidth(double width);
  Ray rayFrom(const Pose& pose, double x, double y) const;
  Pose poseAt(double time) const;

  Frame frame_;
  Pose pose_;
  std::vector<Pose> shutter_;
};

}  // namespace nephele

// A pinhole or thin-lens camera.
//
// Framing: with r, u, f a point's coordinates along the camera's right, up and forward axes and t = tan(fov /
// 2), the point is inside the right side of a frustum at (x, y, z) iff r - x <= t (f - z), i.e. x - t z >=
// max(r - t f), and likewise for the other sides. Left and right together bound z from above, top and bottom
// too; the smaller bound is the nearest camera that sees everything, and x and y follow from the sides that
// touch.
//
// A ray through a lens goes from a point of the lens to where the ray through its middle meets the plane of
// focus. An orthographic camera has a lens before every pixel.
//
// A moving camera is a row of poses; between two of them axes are mixed and made perpendicular again, whose
// error is of second order in the turn from pose to pose (2e-4 of it at 5 degrees).
#include "nephele/render/scene/camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "nephele/modeling/base/error.h"
#include "nephele/render/scene/lights.h"

namespace nephele {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180.0;

void check(const Camera::Frame& frame) {
  require(frame.width >= 1 && frame.height >= 1 && frame.width <= 65536 && frame.height <= 65536,
          fmt::format("size: expected 1x1 to 65536x65536, got {}x{}", frame.width, frame.height));
  require(frame.fovDegrees > 0 && frame.fovDegrees < 180,
          fmt::format("fov: expected an angle between 0 and 180 degrees, got {}", frame.fovDegrees));
  if (frame.orthographicWidth)
    require(*frame.orthographicWidth > 0 && std::isfinite(*frame.orthographicWidth),
            fmt::format("orthographic width: expected a length > 0, got {}", *frame.orthographicWidth));
  if (const auto& crop = frame.crop)
    require(crop->x0 >= 0 && crop->y0 >= 0 && crop->x0 < crop->x1 && crop->y0 < crop->y1 &&
                crop->x1 <= frame.width && crop->y1 <= frame.height,
            fmt::format("crop: expected x0 < x1 and y0 < y1 within 0,0,{},{}, got {},{},{},{}", frame.width,
                        frame.height, crop->x0, crop->y0, crop->x1, crop->y1));
}

// [0, 1)^2 to the unit disc: squares around the middle to circles, which keeps areas and neighbours
// (Shirley and Chiu, "A low distortion map between disk and square", 1997).
std::pair<double, double> onDisc(double u, double v) {
  const double a = 2 * u - 1, b = 2 * v - 1;
  if (a == 0 && b == 0) return {0, 0};
  const bool wide = std::fabs(a) > std::fabs(b);
  const double radius = wide ? a : b, angle = wide ? 45 * (b / a) : 90 - 45 * (a / b);
  return {radius * std::cos(angle * kDegree), radius * std::sin(angle * kDegree)};
}

}  // namespace

double fovDegreesOf(double focalLength, double filmWidth) {
  require(focalLength > 0 && std::isfinite(focalLength),
          fmt::format("focal length: expected a length > 0, got {}", focalLength));
  require(filmWidth > 0 && std::isfinite(filmWidth),
          fmt::format("film width: expected a length > 0, got {}", filmWidth));
  return 2 * std::atan(filmWidth / (2 * focalLength)) / kDegree;
}

double focalLengthOf(double fovDegrees, double filmWidth) {
  require(fovDegrees > 0 && fovDegrees < 180,
          fmt::format("fov: expected an angle between 0 and 180 degrees, got {}", fovDegrees));
  return filmWidth / (2 * std::tan(0.5 * fovDegrees * kDegree));
}

Camera::Camera(const Vec3d& position, const Vec3d& right, const Vec3d& up, const Frame& frame)
    : frame_(frame) {
  check(frame);
  pose_.position = position;
  pose_.right = right;
  pose_.up = up;
  pose_.forward = cross(up, right);
  if (isOrthographic()) {
    setWidth(double(frame.orthographicWidth.value_or(1.0f)));
  } else {
    pose_.halfWidth = std::tan(0.5 * double(frame.fovDegrees) * 3.14159265358979323846 / 180.0);
    pose_.halfHeight = pose_.halfWidth * frame.height / frame.width;
  }
}

void Camera::setWidth(double width) {
  pose_.halfWidth = 0.5 * width;
  pose_.halfHeight = pose_.halfWidth * frame_.height / frame_.width;
}

Camera Camera::facing(const Vec3d& position, const Vec3d& right, const Vec3d& up, const Frame& frame) {
  require(isFinite(position) && isFinite(right) && isFinite(up), "camera: position and axes must be finite");
  require(std::fabs(length(right) - 1) < 1e-6 && std::fabs(length(up) - 1) < 1e-6 &&
              std::fabs(dot(right, up)) < 1e-6,
          "camera: right and up must be perpendicular unit vectors");
  require(frame.projection == Projection::perspective || frame.orthographicWidth,
          "orthographic width: is needed where the camera does not frame anything");
  return Camera(position, right, up, frame);
}

Camera Camera::lookingAt(const Vec3f& position, const Vec3f& target, const Vec3f& up, const Frame& frame) {
  require(isFinite(position) && isFinite(target) && isFinite(up),
          "camera: position, look-at and up must be finite");
  const Vec3d forward = normalize(Vec3d(target) - Vec3d(position));
  require(length(forward) > 0, "look-at: is the camera's own position, so that it looks nowhere");
  const Vec3d right = cross(forward, normalize(Vec3d(up)));
  require(length(right) > 1e-6,
          fmt::format("up: {},{},{} is parallel to the line of sight", up.x, up.y, up.z));
  return facing(Vec3d(position), normalize(right), cross(normalize(right), forward), frame);
}

namespace {

// How far points reach towards the four sides of a frustum, and towards the camera.
struct Reach {
  static constexpr double kNone = -std::numeric_limits<double>::infinity();
  double east = kNone, west = kNone, north = kNone, south = kNone, near = kNone;
  std::array<std::size_t, 5> points{};

  void include(double right, double up, double forward, double tx, double ty, std::size_t point) {
    const std::array<double, 5> reached{right - tx * forward, -right - tx * forward, up - ty * forward,
                                        -up - ty * forward, -forward};
    const std::array<double*, 5> most{&east, &west, &north, &south, &near};
    for (std::size_t side = 0; side != most.size(); ++side)
      if (reached[side] > *most[side]) {
        *most[side] = reached[side];
        points[side] = point;
      }
  }
};

}  // namespace

Camera Camera::towards(float azimuthDegrees, float elevationDegrees, const Frame& frame) {
  const Vec3d back(directionTowards(azimuthDegrees, elevationDegrees));
  // Taken from the azimuth alone, so that looking straight up or down is no special case.
  const Vec3d right(directionTowards(azimuthDegrees + 90.0f, 0.0f));
  return Camera({}, right, cross(back, right), frame);
}

std::vector<Vec3f> Camera::outermost(std::span<const Vec3f> points, float azimuthDegrees,
                                     float elevationDegrees, const Frame& frame, float margin) {
  if (points.empty()) return {};
  const Camera camera = towards(azimuthDegrees, elevationDegrees, frame);
  const Pose& pose = camera.pose_;
  const double free = camera.isOrthographic() ? 0 : 1 - 2 * margin;
  const Vec3d first(points.front());
  Reach reach;
  std::size_t farthest = 0;
  double extent = 0;
  for (std::size_t i = 0; i != points.size(); ++i) {
    const Vec3d p = Vec3d(points[i]) - first;
    if (length(p) > extent) {
      extent = length(p);
      farthest = i;
    }
    reach.include(dot(p, pose.right), dot(p, pose.up), dot(p, pose.forward), free * pose.halfWidth,
                  free * pose.halfHeight, i);
  }
  // What `framing` measures from stays the same, too.
  std::vector<Vec3f> result{points.front(), points[farthest]};
  for (const std::size_t i : reach.points) result.push_back(points[i]);
  return result;
}

Camera Camera::framing(std::span<const Vec3f> points, float azimuthDegrees, float elevationDegrees,
                       const Frame& frame, float margin) {
  require(margin >= 0 && margin < 0.5f, fmt::format("margin: expected [0, 0.5), got {}", margin));
  Camera camera = towards(azimuthDegrees, elevationDegrees, frame);
  Pose& pose = camera.pose_;

  static constexpr Vec3f kUnit[] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  if (points.empty()) points = kUnit;
  // The sides of an orthographic picture do not spread.
  const bool parallel = camera.isOrthographic();
  const double tx = parallel ? 0 : pose.halfWidth * (1 - 2 * margin),
               ty = parallel ? 0 : pose.halfHeight * (1 - 2 * margin);
  double extent = 0;
  const Vec3d first(points.front());
  Reach reach;
  for (const Vec3f& point : points) {
    const Vec3d p = Vec3d(point) - first;
    reach.include(dot(p, pose.right), dot(p, pose.up), dot(p, pose.forward), tx, ty, 0);
    extent = std::max(extent, length(p));
  }
  const auto& [east, west, north, south, near, none] = reach;
  const double nearest = -near;
  // A single point, or points on one line of sight, would put the camera onto them.
  const double apart = extent > 0 ? 1e-3 * extent : 1e-6;
  double z = nearest - std::max(extent, apart);
  if (!parallel) {
    z = std::min({-(east + west) / (2 * tx), -(north + south) / (2 * ty), nearest - apart});
  } else if (!frame.orthographicWidth) {
    const double width = std::max(east + west, (north + south) * frame.width / frame.height);
    camera.setWidth(std::max(width, apart) / (1 - 2 * margin));
  }
  pose.position =
      first + pose.right * ((east - west) / 2) + pose.up * ((north - south) / 2) + pose.forward * z;
  return camera;
}

Camera Camera::withLens(const Lens& lens) const {
  require(lens.radius >= 0 && std::isfinite(lens.radius),
          fmt::format("lens radius: expected a length >= 0, got {}", lens.radius));
  require(lens.focusDistance > 0 && std::isfinite(lens.focusDistance),
          fmt::format("focus distance: expected a length > 0, got {}", lens.focusDistance));
  Camera camera = *this;
  camera.pose_.lensRadius = lens.radius;
  camera.pose_.focusDistance = lens.focusDistance;
  for (Pose& pose : camera.shutter_) {
    pose.lensRadius = lens.radius;
    pose.focusDistance = lens.focusDistance;
  }
  return camera;
}

Camera Camera::withShutter(std::span<const Camera> poses) const {
  Camera camera = *this;
  camera.shutter_.clear();
  if (poses.size() < 2) return camera;
  for (const Camera& pose : poses) {
    require(pose.width() == width() && pose.height() == height() && pose.isOrthographic() == isOrthographic(),
            "camera: a moving one must keep its picture's size and projection");
    camera.shutter_.push_back(pose.pose_);
  }
  return camera;
}

Camera Camera::turned(const Vec3d& about, double degrees) const {
  if (degrees == 0) return *this;
  const double c = std::cos(degrees * kDegree), s = std::sin(degrees * kDegree);
  const auto turn = [c, s](const Vec3d& v) { return Vec3d{c * v.x + s * v.z, v.y, c * v.z - s * v.x}; };
  const auto turnPose = [&](Pose& pose) {
    pose.position = about + turn(pose.position - about);
    for (Vec3d* axis : {&pose.right, &pose.up, &pose.forward}) *axis = turn(*axis);
  };
  Camera camera = *this;
  turnPose(camera.pose_);
  for (Pose& pose : camera.shutter_) turnPose(pose);
  return camera;
}

bool Camera::hasLens() const {
  return pose_.lensRadius > 0 ||
         std::any_of(shutter_.begin(), shutter_.end(), [](const Pose& pose) { return pose.lensRadius > 0; });
}

Camera::Pose Camera::poseAt(double time) const {
  const double place = std::clamp(time, 0.0, 1.0) * double(shutter_.size() - 1);
  const std::size_t index = std::min(std::size_t(place), shutter_.size() - 2);
  const Pose &a = shutter_[index], &b = shutter_[index + 1];
  const double s = place - double(index);
  const auto mix = [s](const auto& from, const auto& to) { return from * (1 - s) + to * s; };
  Pose pose;
  pose.position = mix(a.position, b.position);
  pose.right = normalize(mix(a.right, b.right));
  const Vec3d up = mix(a.up, b.up);
  pose.up = normalize(up - pose.right * dot(up, pose.right));
  pose.forward = cross(pose.up, pose.right);
  pose.halfWidth = mix(a.halfWidth, b.halfWidth);
  pose.halfHeight = mix(a.halfHeight, b.halfHeight);
  pose.lensRadius = mix(a.lensRadius, b.lensRadius);
  pose.focusDistance = mix(a.focusDistance, b.focusDistance);
  return pose;
}

Camera Camera::stillAt(double time) const {
  Camera still = *this;
  if (isMoving()) still.pose_ = poseAt(time);
  still.shutter_.clear();
  return still;
}

Ray Camera::rayFrom(const Pose& pose, double x, double y) const {
  const double sx = (2 * x / frame_.width - 1) * pose.halfWidth,
               sy = (1 - 2 * y / frame_.height) * pose.halfHeight;
  if (isOrthographic()) return {pose.position + pose.right * sx + pose.up * sy, pose.forward};
  return {pose.position, normalize(pose.forward + pose.right * sx + pose.up * sy)};
}

Ray Camera::ray(double x, double y, double lensU, double lensV, double time) const {
  if (!isMoving() && pose_.lensRadius == 0) return rayFrom(pose_, x, y);
  const Pose pose = isMoving() ? poseAt(time) : pose_;
  const Ray central = rayFrom(pose, x, y);
  if (pose.lensRadius == 0) return central;
  const auto [u, v] = onDisc(lensU, lensV);
  const Vec3d aside = (pose.right * u + pose.up * v) * pose.lensRadius;
  const Vec3d focus = central.direction * (pose.focusDistance / dot(central.direction, pose.forward));
  return {central.origin + aside, normalize(focus - aside)};
}

Vec3d Camera::project(const Vec3d& world) const {
  const Vec3d p = world - pose_.position;
  const double depth = dot(p, pose_.forward), scale = isOrthographic() ? 1.0 : depth;
  return {(dot(p, pose_.right) / (scale * pose_.halfWidth) + 1) * 0.5 * frame_.width,
          (1 - dot(p, pose_.up) / (scale * pose_.halfHeight)) * 0.5 * frame_.height, depth};
}

Mat44 Camera::worldToCamera() const {
  const Vec3d axes[] = {pose_.right, pose_.up, pose_.forward};
  Mat44 camera{};
  for (std::size_t column = 0; column != 3; ++column) {
    for (std::size_t row = 0; row != 3; ++row) camera[row * 4 + column] = float(axes[column][int(row)]);
    camera[12 + column] = float(-dot(axes[column], pose_.position));
  }
  camera[15] = 1;
  return camera;
}

Mat44 Camera::worldToNdc() const {
  const Mat44 camera = worldToCamera();
  Mat44 ndc{};
  for (std::size_t row = 0; row < 4; ++row) {
    const float one = row == 3 ? 1.0f : 0.0f, depth = camera[row * 4 + 2];
    const float w = isOrthographic() ? one : depth;
    ndc[row * 4] = float(0.5 * (w + camera[row * 4] / pose_.halfWidth));
    ndc[row * 4 + 1] = float(0.5 * (w - camera[row * 4 + 1] / pose_.halfHeight));
    ndc[row * 4 + 2] = isOrthographic() ? -depth : one;
    ndc[row * 4 + 3] = w;
  }
  return ndc;
}

}  // namespace nephele

// A pinhole camera.
//
// Framing: with r, u, f a point's coordinates along the camera's right, up and forward axes and t = tan(fov /
// 2), the point is inside the right side of a frustum at (x, y, z) iff r - x <= t (f - z), i.e. x - t z >=
// max(r - t f), and likewise for the other sides. Left and right together bound z from above, top and bottom
// too; the smaller bound is the nearest camera that sees everything, and x and y follow from the sides that
// touch.
#include "render/camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "modeling/error.h"
#include "render/lights.h"

namespace nephele {

Camera::Camera(const Vec3d& position, const Vec3d& right, const Vec3d& up, const Frame& frame)
    : frame_(frame), position_(position), right_(right), up_(up), forward_(cross(up, right)) {
  require(frame.width >= 1 && frame.height >= 1 && frame.width <= 65536 && frame.height <= 65536,
          fmt::format("size: expected 1x1 to 65536x65536, got {}x{}", frame.width, frame.height));
  require(frame.fovDegrees > 0 && frame.fovDegrees < 180,
          fmt::format("fov: expected an angle between 0 and 180 degrees, got {}", frame.fovDegrees));
  halfWidth_ = std::tan(0.5 * double(frame.fovDegrees) * 3.14159265358979323846 / 180.0);
  halfHeight_ = halfWidth_ * frame.height / frame.width;
}

Camera Camera::lookingAt(const Vec3f& position, const Vec3f& target, const Vec3f& up, const Frame& frame) {
  require(isFinite(position) && isFinite(target) && isFinite(up),
          "camera: position, look-at and up must be finite");
  const Vec3d forward = normalize(Vec3d(target) - Vec3d(position));
  require(length(forward) > 0, "look-at: is the camera's own position, so that it looks nowhere");
  const Vec3d right = cross(forward, normalize(Vec3d(up)));
  require(length(right) > 1e-6,
          fmt::format("up: {},{},{} is parallel to the line of sight", up.x, up.y, up.z));
  return Camera(Vec3d(position), normalize(right), cross(normalize(right), forward), frame);
}

Camera Camera::framing(std::span<const Vec3f> points, float azimuthDegrees, float elevationDegrees,
                       const Frame& frame, float margin) {
  require(margin >= 0 && margin < 0.5f, fmt::format("margin: expected [0, 0.5), got {}", margin));
  const Vec3d back(directionTowards(azimuthDegrees, elevationDegrees));
  // Taken from the azimuth alone, so that looking straight up or down is no special case.
  const Vec3d right(directionTowards(azimuthDegrees + 90.0f, 0.0f));
  Camera camera({}, right, cross(back, right), frame);

  static constexpr Vec3f kUnit[] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  if (points.empty()) points = kUnit;
  const double tx = camera.halfWidth_ * (1 - 2 * margin), ty = camera.halfHeight_ * (1 - 2 * margin);
  constexpr double inf = std::numeric_limits<double>::infinity();
  double east = -inf, west = -inf, north = -inf, south = -inf, nearest = inf, extent = 0;
  const Vec3d first(points.front());
  for (const Vec3f& point : points) {
    const Vec3d p = Vec3d(point) - first;
    const double r = dot(p, camera.right_), u = dot(p, camera.up_), f = dot(p, camera.forward_);
    east = std::max(east, r - tx * f);
    west = std::max(west, -r - tx * f);
    north = std::max(north, u - ty * f);
    south = std::max(south, -u - ty * f);
    nearest = std::min(nearest, f);
    extent = std::max(extent, length(p));
  }
  // A single point, or points on one line of sight, would put the camera onto them.
  const double z = std::min(
      {-(east + west) / (2 * tx), -(north + south) / (2 * ty), nearest - std::max(1e-3 * extent, 1e-6)});
  camera.position_ =
      first + camera.right_ * ((east - west) / 2) + camera.up_ * ((north - south) / 2) + camera.forward_ * z;
  return camera;
}

Ray Camera::ray(double x, double y) const {
  const double sx = (2 * x / frame_.width - 1) * halfWidth_, sy = (1 - 2 * y / frame_.height) * halfHeight_;
  return {position_, normalize(forward_ + right_ * sx + up_ * sy)};
}

Vec3d Camera::project(const Vec3d& world) const {
  const Vec3d p = world - position_;
  const double depth = dot(p, forward_);
  return {(dot(p, right_) / (depth * halfWidth_) + 1) * 0.5 * frame_.width,
          (1 - dot(p, up_) / (depth * halfHeight_)) * 0.5 * frame_.height, depth};
}

Mat44 Camera::worldToCamera() const {
  const Vec3d x = right_, y = up_, z = -forward_;
  return {float(x.x),
          float(y.x),
          float(z.x),
          0,
          float(x.y),
          float(y.y),
          float(z.y),
          0,
          float(x.z),
          float(y.z),
          float(z.z),
          0,
          float(-dot(x, position_)),
          float(-dot(y, position_)),
          float(-dot(z, position_)),
          1};
}

Mat44 Camera::worldToNdc() const {
  const Mat44 camera = worldToCamera();
  Mat44 ndc{};
  for (int row = 0; row < 4; ++row) {
    ndc[row * 4] = float(camera[row * 4] / halfWidth_);
    ndc[row * 4 + 1] = float(camera[row * 4 + 1] / halfHeight_);
    ndc[row * 4 + 2] = row == 3 ? 1.0f : 0.0f;
    ndc[row * 4 + 3] = -camera[row * 4 + 2];
  }
  return ndc;
}

}  // namespace nephele

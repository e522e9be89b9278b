// Animated cameras: curves through keys.
//
// A curve between keys i and i + 1 is the cubic with their values and tangents. The tangent at a key is that
// of the parabola through it and its neighbours, at an end that of the parabola of the last three keys: even
// keys inside give Catmull and Rom's curve, and motion at constant speed or acceleration is reproduced
// exactly.
#include "nephele/render/scene/camera_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "nephele/modeling/base/error.h"

namespace nephele {

namespace {

template <class T>
struct Curve {
  std::vector<double> times;
  std::vector<T> values;

  T slope(std::size_t i) const { return (values[i + 1] - values[i]) * (1 / (times[i + 1] - times[i])); }

  T tangent(std::size_t i) const {
    const std::size_t last = times.size() - 1;
    if (last == 1) return slope(0);
    if (i == 0) return slope(0) * 2.0 - tangent(1);
    if (i == last) return slope(last - 1) * 2.0 - tangent(last - 1);
    const double before = times[i] - times[i - 1], after = times[i + 1] - times[i];
    return (slope(i - 1) * after + slope(i) * before) * (1 / (before + after));
  }

  // Beyond the ends: straight on, or as at the end.
  T at(double time, bool smooth, bool goesOn) const {
    if (times.size() == 1) return values[0];
    const std::size_t last = times.size() - 1;
    if (time <= times.front() || time >= times.back()) {
      const std::size_t end = time <= times.front() ? 0 : last;
      if (!goesOn) return values[end];
      const T speed = smooth ? tangent(end) : slope(end == 0 ? 0 : last - 1);
      return values[end] + speed * (time - times[end]);
    }
    const auto i = std::size_t(std::upper_bound(times.begin(), times.end(), time) - times.begin()) - 1;
    const double span = times[i + 1] - times[i], s = (time - times[i]) / span;
    if (!smooth) return values[i] * (1 - s) + values[i + 1] * s;
    const double s2 = s * s, s3 = s2 * s;
    const T result = values[i] * (2 * s3 - 3 * s2 + 1) + tangent(i) * (span * (s3 - 2 * s2 + s)) +
                     values[i + 1] * (3 * s2 - 2 * s3) + tangent(i + 1) * (span * (s3 - s2));
    // What stays at its ends is a length or an angle, which must not overshoot between two keys.
    if constexpr (std::is_same_v<T, double>)
      return std::clamp(result, std::min(values[i], values[i + 1]), std::max(values[i], values[i + 1]));
    return result;
  }
};

void requireWithin(const CameraKey& key, const char* name, const std::optional<double>& value, double low,
                   double high) {
  if (!value || (*value >= low && *value <= high)) return;
  throw Error(fmt::format(
      "frame {:g}: {} must be {}, got {:g}", key.frame, name,
      high < 1e30 ? fmt::format("from {} to {}", low, high) : fmt::format("at least {:g}", low), *value));
}

/// Differences and squares of such are still numbers.
void requireNotFar(const CameraKey& key, const char* name, const Vec3d& value) {
  constexpr double kMost = 1e30;
  for (const double coordinate : {value.x, value.y, value.z})
    if (!(std::fabs(coordinate) <= kMost))
      throw Error(fmt::format("frame {:g}: {} must be from {:g} to {:g} along each axis, got {:g}", key.frame,
                              name, -kMost, kMost, coordinate));
}

// Camera to world of a camera at `position` that looks at `target`.
Rotation lookingAt(const CameraKey& key) {
  const Vec3d forward = normalize(*key.target - key.position);
  require(
      length(forward) > 0,
      fmt::format("frame {:g}: look_at is the camera's own position, so that it looks nowhere", key.frame));
  const Vec3d right = cross(forward, normalize(key.up));
  require(length(right) > 1e-6, fmt::format("frame {:g}: up is parallel to the line of sight", key.frame));
  return Rotation::ofAxes(normalize(right), cross(normalize(right), forward));
}

}  // namespace

CameraMotion::CameraMotion(std::vector<CameraKey> keys, bool smooth)
    : keys_(std::move(keys)), smooth_(smooth) {
  require(!keys_.empty(), "holds no frames");
  for (std::size_t i = 0; i != keys_.size(); ++i) {
    CameraKey& key = keys_[i];
    require(std::isfinite(key.frame), "a frame has a number that is not finite");
    requireNotFar(key, "position", key.position);
    requireNotFar(key, "up", key.up);
    if (key.target) requireNotFar(key, "look_at", *key.target);
    constexpr double kLeastStep = 1e-6;
    require(i == 0 || key.frame - keys_[i - 1].frame >= kLeastStep,
            fmt::format("frame {:g}: comes after frame {:g}, but frames must increase, by {:g} at least",
                        key.frame, i == 0 ? 0.0 : keys_[i - 1].frame, kLeastStep));
    require(key.target.has_value() == keys_[0].target.has_value(),
            fmt::format("frame {:g}: look_at must be given at all frames or at none", key.frame));
    constexpr double kLast = 1e9;
    require(std::fabs(key.frame) <= kLast,
            fmt::format("frame {:g}: frames are from {:g} to {:g}", key.frame, -kLast, kLast));
    requireWithin(key, "fov", key.fovDegrees, 0.01, 179);
    // What 0.01 to 179 across may be in a picture of any shape.
    requireWithin(key, "fov", key.verticalFovDegrees, 1e-7, 179.99999);
    requireWithin(key, "orthographic_width", key.orthographicWidth, 1e-12, INFINITY);
    requireWithin(key, "f_stop", key.fStop, 1e-3, INFINITY);
    requireWithin(key, "lens_radius", key.lensRadius, 0, INFINITY);
    requireWithin(key, "focus_distance", key.focusDistance, 1e-12, INFINITY);
    if (key.target) key.rotation = lookingAt(key);
  }
  const auto any = [this](std::optional<double> CameraKey::*member) {
    return std::any_of(keys_.begin(), keys_.end(),
                       [member](const CameraKey& key) { return (key.*member).has_value(); });
  };
  require(!any(&CameraKey::fStop) || !any(&CameraKey::lensRadius),
          "f_stop is given at some frames and lens_radius at others; give one of them");
  require(!any(&CameraKey::fovDegrees) || !any(&CameraKey::verticalFovDegrees),
          "the angle of view is given across at some frames and upright at others");
}

CameraKey CameraMotion::at(double frame) const {
  // A curve through the keys that have `value`, or nothing.
  const auto sampled = [&](const auto& value, bool goesOn) {
    using T = typename std::decay_t<decltype(value(keys_[0]))>::value_type;
    Curve<T> curve;
    for (const CameraKey& key : keys_)
      if (const std::optional<T> v = value(key)) {
        curve.times.push_back(key.frame);
        curve.values.push_back(*v);
      }
    return curve.times.empty() ? std::optional<T>() : curve.at(frame, smooth_, goesOn);
  };
  const auto lens = [&](std::optional<double> CameraKey::*member) {
    return sampled([member](const CameraKey& key) { return key.*member; }, false);
  };
  // Even in focal length.
  const auto angle = [&](std::optional<double> CameraKey::*member) {
    std::optional<double> focal = sampled(
        [member](const CameraKey& key) {
          return key.*member ? std::optional(focalLengthOf(*(key.*member), 1)) : std::nullopt;
        },
        false);
    if (focal) focal = fovDegreesOf(*focal, 1);
    return focal;
  };

  CameraKey key;
  key.frame = frame;
  key.position = *sampled([](const CameraKey& k) { return std::optional(k.position); }, true);
  key.up = *sampled([](const CameraKey& k) { return std::optional(k.up); }, true);
  key.target = sampled([](const CameraKey& k) { return k.target; }, true);
  key.fovDegrees = angle(&CameraKey::fovDegrees);
  key.verticalFovDegrees = angle(&CameraKey::verticalFovDegrees);
  key.filmWidth = keys_.front().filmWidth;
  key.hasFocalLength =
      std::ranges::all_of(keys_, [](const CameraKey& k) { return !k.fovDegrees || k.hasFocalLength; });
  key.orthographicWidth = lens(&CameraKey::orthographicWidth);
  key.fStop = lens(&CameraKey::fStop);
  key.lensRadius = lens(&CameraKey::lensRadius);
  key.focusDistance = lens(&CameraKey::focusDistance);
  if (key.target) {
    key.rotation = lookingAt(key);
  } else if (keys_.size() == 1) {
    key.rotation = keys_[0].rotation;
  } else {
    const auto next = std::upper_bound(keys_.begin() + 1, keys_.end() - 1, frame,
                                       [](double f, const CameraKey& k) { return f < k.frame; });
    const CameraKey &a = *(next - 1), &b = *next;
    key.rotation = slerp(a.rotation, b.rotation, (frame - a.frame) / (b.frame - a.frame));
  }
  return key;
}

Ray RigidMotion::toBody(const Ray& ray, double frames) const {
  Vec3d origin = ray.origin - centre - velocity * frames;
  Vec3d direction = ray.direction;
  if (const double speed = length(spinDegrees); speed > 0) {
    const Rotation back = Rotation::about(spinDegrees, -speed * frames * 3.14159265358979323846 / 180.0);
    origin = back(origin);
    direction = back(direction);
  }
  return {origin + centre, direction};
}

Ray RigidMotion::toWorld(const Ray& ray, double frames) const {
  Vec3d origin = ray.origin - centre;
  Vec3d direction = ray.direction;
  if (const double speed = length(spinDegrees); speed > 0) {
    const Rotation turn = Rotation::about(spinDegrees, speed * frames * 3.14159265358979323846 / 180.0);
    origin = turn(origin);
    direction = turn(direction);
  }
  return {origin + centre + velocity * frames, direction};
}

}  // namespace nephele

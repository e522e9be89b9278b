// Turntables: geometry only.
//
// A volume is the largest thing in a picture, so it stays where it is: that a model turns by an angle before
// a still camera is the same as that camera and lights turn by minus that angle.
//
// What points pass over while they turn is a body of revolution: a point at height y and distance r from the
// axis becomes a circle. The hull of all circles is that of those on the hull of the points (y, r), few of
// them; a circle is replaced by a regular polygon around it.
#include "nephele/render/scene/turntable.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <tuple>
#include <utility>

#include "nephele/modeling/base/error.h"
#include "nephele/render/scene/clear_sky.h"
#include "nephele/render/scene/environment.h"

namespace nephele {
namespace {

constexpr double kHalfTurn = 3.14159265358979323846;  // in radians

// About the vertical axis, from +z towards +x.
Vec3f turned(const Vec3f& v, double degrees) {
  const double c = std::cos(degrees * kHalfTurn / 180), s = std::sin(degrees * kHalfTurn / 180);
  return {float(c * v.x + s * v.z), v.y, float(c * v.z - s * v.x)};
}

void requireNoMap(const std::string& light, bool hasMap) {
  require(!hasMap, fmt::format("turntable: the shadow map of the light '{}' was made for one place, and the "
                               "lights of this orbit turn",
                               light));
}

}  // namespace

Turntable::Turntable(Orbit orbit, const Vec3f& middle, int first, int last, double turns)
    : orbit_(orbit), middle_(middle), first_(first), last_(last), turns_(turns) {
  require(isFinite(middle), "turntable: the middle must be finite");
  require(first <= last, fmt::format("turntable: the first frame {} is after the last {}", first, last));
  require(std::isfinite(turns) && turns != 0 && std::fabs(turns) <= 1000,
          fmt::format("turns: expected a number from -1000 to 1000 that is not 0, got {}", turns));
}

double Turntable::degreesAt(double frame) const {
  // Whole turns are taken off, so that frames that look alike are alike to the last bit.
  const double turns = turns_ * (frame - first_) / (double(last_) - first_ + 1);
  return 360 * (turns - std::floor(turns));
}

Camera Turntable::camera(const Camera& start, double frame) const {
  if (!cameraMoves()) return start;
  return start.turned(Vec3d(middle_), (orbit_ == Orbit::model ? -1 : 1) * degreesAt(frame));
}

Lights Turntable::lights(const Lights& start, double frame) const {
  if (!lightsMove()) return start;
  const double degrees = (orbit_ == Orbit::model ? -1 : 1) * degreesAt(frame);
  Lights result = start;
  if (start.map) result.map = std::make_shared<const Environment>(start.map->turned(degrees));
  if (start.clear) result.clear = std::make_shared<const ClearSky>(start.clear->turned(degrees));
  for (DistantLight& sun : result.suns) {
    requireNoMap(sun.name, sun.deepShadow != nullptr);
    sun.direction = turned(sun.direction, degrees);
  }
  for (LocalLight& light : result.locals) {
    requireNoMap(light.name, light.deepShadow != nullptr);
    light.position = middle_ + turned(light.position - middle_, degrees);
    if (light.cone) light.cone->direction = turned(light.cone->direction, degrees);
  }
  return result;
}

std::vector<Vec3f> sweptCorners(std::span<const Vec3f> points) {
  std::vector<Vec3f> sorted(points.begin(), points.end());
  std::sort(sorted.begin(), sorted.end(),
            [](const Vec3f& a, const Vec3f& b) { return std::tie(a.y, a.x, a.z) < std::tie(b.y, b.x, b.z); });
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  std::vector<Vec3f> corners;
  for (std::size_t begin = 0, end = 0; begin != sorted.size(); begin = end) {
    while (end != sorted.size() && sorted[end].y == sorted[begin].y) ++end;
    // One side of the hull from the least x to the largest, then the other.
    for (const int side : {1, -1}) {
      const std::size_t first = corners.size();
      for (std::size_t i = begin; i != end; ++i) {
        const Vec3f& p = sorted[i];
        const auto turns = [&] {
          const Vec3d a(corners[corners.size() - 2]), b(corners.back()), c(p);
          return side * ((b.x - a.x) * (c.z - a.z) - (b.z - a.z) * (c.x - a.x)) > 0;
        };
        while (corners.size() >= first + 2 && !turns()) corners.pop_back();
        corners.push_back(p);
      }
    }
  }
  return corners;
}

std::vector<Vec3f> sweptOutline(std::span<const Vec3f> points, const Vec3f& middle) {
  std::vector<std::pair<double, double>> profile;  // height, distance from the axis
  profile.reserve(points.size());
  for (const Vec3f& p : points)
    profile.emplace_back(p.y, std::hypot(double(p.x) - middle.x, double(p.z) - middle.z));
  std::sort(profile.begin(), profile.end());

  // The outer half of the hull: heights increase, and every turn is towards the axis.
  std::vector<std::pair<double, double>> hull;
  for (const auto& p : profile) {
    const auto outside = [&] {
      const auto &a = hull[hull.size() - 2], &b = hull.back();
      return (b.first - a.first) * (p.second - a.second) - (b.second - a.second) * (p.first - a.first) < 0;
    };
    while (hull.size() >= 2 && !outside()) hull.pop_back();
    // Of points at the lowest height, the one that is farthest from the axis.
    if (hull.size() == 1 && hull.back().first == p.first) hull.pop_back();
    hull.push_back(p);
  }

  constexpr int kCorners = 96;
  std::vector<Vec3f> swept;
  swept.reserve(hull.size() * kCorners);
  for (const auto& [height, radius] : hull)
    for (int i = 0; i != kCorners; ++i) {
      const double angle = 2 * kHalfTurn * i / kCorners, around = radius / std::cos(kHalfTurn / kCorners);
      swept.push_back({float(middle.x + around * std::sin(angle)), float(height),
                       float(middle.z + around * std::cos(angle))});
    }
  return swept;
}

}  // namespace nephele

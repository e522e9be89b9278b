#include "data/models/shapes.h"

#include <algorithm>

namespace nephele {

Frame frameAt(const Vec3d& origin, const Vec3d& up, const Vec3d& forward) {
  const Vec3d y = normalize(up);
  const Vec3d x = normalize(forward - y * dot(forward, y));
  return {origin, x, y, cross(x, y)};
}

double ellipsoid(const Vec3d& p, const Vec3d& radii) {
  const Vec3d scaled{p.x / radii.x, p.y / radii.y, p.z / radii.z};
  const double size = length(scaled);
  if (size < 1e-9) return std::min({radii.x, radii.y, radii.z});
  const double slope = length(Vec3d{scaled.x / radii.x, scaled.y / radii.y, scaled.z / radii.z});
  return size * (1 - size) / slope;
}

double ball(const Vec3d& p, const Vec3d& center, double radius) {
  return radius - length(p - center);
}

double limb(const Vec3d& p, const Vec3d& a, double radiusA, const Vec3d& b, double radiusB) {
  const double t = std::clamp(dot(p - a, b - a) / dot(b - a, b - a), 0.0, 1.0);
  return radiusA + (radiusB - radiusA) * t - length(p - (a + (b - a) * t));
}

}  // namespace nephele

#pragma once

#include <cmath>
#include <numbers>
#include <span>

#include "nephele/modeling/base/math.h"

namespace nephele {

/// How often a closed surface winds around a point that is not on it: 1 inside, 0 outside, -1 inside a
/// surface that is turned inward. `triangles` gives three indices of `positions` for each. Cost: linear, an
/// arc tangent for each triangle. Source: van Oosterom and Strackee, The Solid Angle of a Plane Triangle
/// (1983).
template <class Triangles>
double windingNumber(std::span<const Vec3d> positions, const Triangles& triangles, const Vec3d& point) {
  double total = 0;
  for (const auto& t : triangles) {
    const Vec3d a = positions[t[0]] - point, b = positions[t[1]] - point, c = positions[t[2]] - point;
    const double la = length(a), lb = length(b), lc = length(c);
    total += std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return total / (2 * std::numbers::pi);
}

}  // namespace nephele

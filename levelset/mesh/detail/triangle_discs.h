#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "nephele/modeling/base/box_units.h"
#include "nephele/modeling/base/mesh.h"

namespace nephele::detail {

/// The point of triangle (a, b, c) nearest to the origin: its foot on the face if that lies inside, else the
/// nearest point of the sides. Always a point of the triangle; where it is a sliver, whose face rounding
/// makes meaningless, the sides compete with the face.
inline Vec3f nearestToOrigin(const Vec3f& a, const Vec3f& b, const Vec3f& c) {
  const Vec3f ab = b - a, bc = c - b, ca = a - c;
  // Barycentrics of the foot from the two sides at a (normal equations).
  const float bb = dot(ab, ab), cc = dot(ca, ca), mixed = -dot(ab, ca), toB = -dot(a, ab), toC = dot(a, ca);
  const float determinant = bb * cc - mixed * mixed;
  constexpr float kSliver = 1e-3f;
  std::optional<Vec3f> face;
  if (determinant > 0.0f) {
    const float v = (cc * toB - mixed * toC) / determinant, w = (bb * toC - mixed * toB) / determinant;
    if (v >= 0.0f && w >= 0.0f && v + w <= 1.0f) face = a + ab * v - ca * w;
    if (face && determinant > kSliver * bb * cc) return *face;
  }
  Vec3f best = face.value_or(Vec3f{});
  float bestSquared = face ? dot(best, best) : std::numeric_limits<float>::infinity();
  const auto trySide = [&](const Vec3f& start, const Vec3f& along) {
    const float squared = dot(along, along);
    const float t = squared > 0 ? std::min(std::max(-dot(start, along) / squared, 0.0f), 1.0f) : 0.0f;
    const Vec3f q = start + along * t;
    if (const float qq = dot(q, q); qq < bestSquared) {
      bestSquared = qq;
      best = q;
    }
  };
  trySide(a, ab);
  trySide(b, bc);
  trySide(c, ca);
  return best;
}

/// A disc around a triangle in its plane: settles most of those that a hierarchy offers.
struct TriangleDisc {
  Vec3f middle;
  float radius;
  Vec3f normal;  ///< Unit, or zero for a triangle without area: then the disc is a ball.
  float slack;   ///< What rounding may cost.

  bool isBeyond(const Vec3f& p, float distance) const {
    const Vec3f away = p - middle;
    const float height = dot(away, normal);
    const float aside = std::sqrt(std::max(dot(away, away) - height * height, 0.0f)) - radius;
    const float reach = distance + slack;
    return height * height + (aside > 0.0f ? aside * aside : 0.0f) > reach * reach;
  }
};

/// Those of all triangles.
std::vector<TriangleDisc> discsOf(const Mesh& mesh, const BoxUnits& units);

/// @throws Error if the mesh has no faces, is not triangulated or has positions that are not finite.
void requireTriangles(const Mesh& mesh);

}  // namespace nephele::detail

#pragma once

#include <array>

#include "nephele/modeling/base/math.h"
#include "nephele/modeling/base/mesh.h"

namespace nephele {

/// x -> scale * turn * x + shift, `turn` a rotation matrix, row-major: a map that keeps shapes.
struct Similarity {
  double scale = 1;
  std::array<double, 9> turn{1, 0, 0, 0, 1, 0, 0, 0, 1};
  Vec3d shift;

  /// Turns by `degrees` about x, then y, then z.
  static Similarity rotation(const Vec3d& degrees);

  Vec3d operator()(const Vec3d& p) const { return turned(p) * scale + shift; }
  /// A direction, turned only.
  Vec3d turned(const Vec3d& v) const;
  /// Turned the other way.
  Vec3d turnedBack(const Vec3d& v) const;
  /// Angle of the turn, radians, 0 to pi.
  double angle() const;
};

/// First `first`, then `second`.
Similarity operator*(const Similarity& second, const Similarity& first);

/// Whether values called so are velocities, which turn and scale with what they are on: v, vel or velocity.
bool isVelocity(const std::string& name);

/// Whether values called so are normals, which turn with what they are on: n, N, normal or normals.
bool isNormal(const std::string& name);

/// The mesh elsewhere: normals turn with it, velocities turn and are scaled, those that are three attributes
/// of one number, too (`nx`, `vel_y`, `v.z`, `v_0`); all others are as they were.
/// @throws Error unless the mesh is valid.
Mesh moved(Mesh mesh, const Similarity& by);

}  // namespace nephele

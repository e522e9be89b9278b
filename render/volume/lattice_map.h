#pragma once

#include "nephele/modeling/base/math.h"
#include "nephele/render/volume/lattice_ray.h"

namespace nephele {

/// How a ray in the world becomes one in a lattice, in double since cameras may stand far away.
struct LatticeMap {
  double m[3][3], t[3];

  explicit LatticeMap(const Affine& a, const Vec3i& firstBrick = {}) {
    for (int row = 0; row != 3; ++row) {
      for (int column = 0; column != 3; ++column) m[row][column] = a.linear(row, column);
      t[row] = double(a.translation[row]) - 8.0 * firstBrick[row];
    }
  }
  Vec3d vector(const Vec3d& v) const {
    Vec3d r;
    for (int row = 0; row != 3; ++row) r[row] = m[row][0] * v.x + m[row][1] * v.y + m[row][2] * v.z;
    return r;
  }
  Vec3d point(const Vec3d& p) const { return vector(p) + Vec3d{t[0], t[1], t[2]}; }
  LatticeRay ray(const Vec3d& origin, const Vec3d& direction) const {
    return {Vec3f(point(origin)), Vec3f(vector(direction))};
  }
};

}  // namespace nephele

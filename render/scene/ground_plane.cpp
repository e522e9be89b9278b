#include <array>
#include <cmath>

#include "nephele/render/scene/surfaces.h"

namespace nephele {

Mesh groundPlane(const Vec3f& centre, float height, float size) {
  constexpr int kSquares = 6;
  constexpr double kWider = 10;
  Mesh mesh;
  double half = 0.5 * double(size) / std::pow(kWider, kSquares - 1);
  for (std::uint32_t square = 0; square != kSquares; ++square, half *= kWider) {
    const double x = centre.x, z = centre.z;
    mesh.positions.insert(mesh.positions.end(), {{x - half, height, z + half},
                                                 {x + half, height, z + half},
                                                 {x + half, height, z - half},
                                                 {x - half, height, z - half}});
    if (square == 0) {
      mesh.addFace(std::array<std::uint32_t, 4>{0, 1, 2, 3});
      continue;
    }
    const std::uint32_t outer = 4 * square, inner = outer - 4;
    for (std::uint32_t side = 0; side != 4; ++side) {
      const std::uint32_t next = (side + 1) % 4;
      mesh.addFace(std::array<std::uint32_t, 4>{outer + side, outer + next, inner + next, inner + side});
    }
  }
  return mesh;
}

}  // namespace nephele

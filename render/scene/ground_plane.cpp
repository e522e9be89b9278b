#include "nephele/render/scene/surfaces.h"

namespace nephele {

Mesh groundPlane(const Vec3f& centre, float height, float size) {
  Mesh mesh;
  const double x = centre.x, z = centre.z, half = 0.5 * double(size);
  mesh.positions = {{x - half, height, z + half},
                    {x + half, height, z + half},
                    {x + half, height, z - half},
                    {x - half, height, z - half}};
  const std::uint32_t corners[] = {0, 1, 2, 3};
  mesh.addFace(corners);
  return mesh;
}

}  // namespace nephele

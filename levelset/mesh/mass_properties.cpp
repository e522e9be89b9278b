// Volume, centroid and inertia of a solid from its surface.
//
// Each triangle and the middle of the box span a tetrahedron; signed, they add up to the solid. The integral
// of x x^T over a tetrahedron with a corner at the origin and the others a, b, c is det(a, b, c) / 120 (a a^T
// + b b^T + c c^T + s s^T) with s = a + b + c.

#include "nephele/levelset/mesh/mass_properties.h"
namespace nephele {

MassProperties massProperties(const Mesh& mesh) {
  requireValid(mesh);
  MassProperties result;
  if (mesh.corners.empty()) return result;
  Vec3d low = mesh.positions[mesh.corners[0]], high = low;
  for (const std::uint32_t v : mesh.corners) {
    low = min(low, mesh.positions[v]);
    high = max(high, mesh.positions[v]);
  }
  const Vec3d origin = (low + high) * 0.5;
  Vec3d first{};
  std::array<double, 9> second{};
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
    const auto face = mesh.face(f);
    for (std::size_t k = 1; k + 1 < face.size(); ++k) {
      const Vec3d a = mesh.positions[face[0]] - origin, b = mesh.positions[face[k]] - origin,
                  c = mesh.positions[face[k + 1]] - origin;
      const double six = dot(a, cross(b, c));
      const Vec3d sum = a + b + c;
      result.volume += six / 6;
      result.area += length(cross(b - a, c - a)) / 2;
      first += sum * (six / 24);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          second[std::size_t(3 * i + j)] +=
              six / 120 * (a[i] * a[j] + b[i] * b[j] + c[i] * c[j] + sum[i] * sum[j]);
    }
  }
  const Vec3d offset = result.volume != 0 ? first / result.volume : Vec3d{};
  result.centroid = origin + offset;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) second[std::size_t(3 * i + j)] -= result.volume * offset[i] * offset[j];
  const double trace = second[0] + second[4] + second[8];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      result.inertia[std::size_t(3 * i + j)] = (i == j ? trace : 0) - second[std::size_t(3 * i + j)];
  return result;
}

}  // namespace nephele

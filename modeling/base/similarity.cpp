#include "nephele/modeling/base/similarity.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace nephele {

Similarity Similarity::rotation(const Vec3d& degrees) {
  Similarity result;
  for (int axis = 0; axis != 3; ++axis) {
    const double angle = degrees[axis] * M_PI / 180, c = std::cos(angle), s = std::sin(angle);
    const auto u = std::size_t((axis + 1) % 3), v = std::size_t((axis + 2) % 3);
    Similarity one;
    one.turn[u * 3 + u] = one.turn[v * 3 + v] = c;
    one.turn[u * 3 + v] = -s;
    one.turn[v * 3 + u] = s;
    result = one * result;
  }
  return result;
}

Vec3d Similarity::turned(const Vec3d& v) const {
  return {turn[0] * v.x + turn[1] * v.y + turn[2] * v.z, turn[3] * v.x + turn[4] * v.y + turn[5] * v.z,
          turn[6] * v.x + turn[7] * v.y + turn[8] * v.z};
}

Vec3d Similarity::turnedBack(const Vec3d& v) const {
  return {turn[0] * v.x + turn[3] * v.y + turn[6] * v.z, turn[1] * v.x + turn[4] * v.y + turn[7] * v.z,
          turn[2] * v.x + turn[5] * v.y + turn[8] * v.z};
}

double Similarity::angle() const {
  return std::acos(std::clamp(0.5 * (turn[0] + turn[4] + turn[8] - 1), -1.0, 1.0));
}

Similarity operator*(const Similarity& second, const Similarity& first) {
  Similarity result;
  result.scale = second.scale * first.scale;
  for (std::size_t column = 0; column != 3; ++column) {
    const Vec3d turned = second.turned({first.turn[column], first.turn[3 + column], first.turn[6 + column]});
    for (int row = 0; row != 3; ++row) result.turn[std::size_t(row) * 3 + column] = turned[row];
  }
  result.shift = second(first.shift);
  return result;
}

bool isVelocity(const std::string& name) {
  return name == "v" || name == "vel" || name == "velocity";
}

Mesh moved(Mesh mesh, const Similarity& by) {
  requireValid(mesh);
  for (Vec3d& position : mesh.positions) position = by(position);
  for (MeshAttribute& attribute : mesh.attributes) {
    const bool isNormal = attribute.name == "normal" || attribute.name == "normals" || attribute.name == "N";
    if (attribute.width != 3 || !(isNormal || isVelocity(attribute.name))) continue;
    for (std::size_t i = 0; i != attribute.values.size(); i += 3) {
      float* v = attribute.values.data() + i;
      const Vec3d turned =
          by.turned({double(v[0]), double(v[1]), double(v[2])}) * (isNormal ? 1.0 : by.scale);
      for (int c = 0; c != 3; ++c) v[c] = float(turned[c]);
    }
  }
  return mesh;
}

}  // namespace nephele

#include "nephele/modeling/base/similarity.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

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

bool isNormal(const std::string& name) {
  return name == "n" || name == "N" || name == "normal" || name == "normals";
}

namespace {

/// The component that an attribute of one number is of a vector: "vx", "velocity_y", "v.z" or "v_0", as
/// tables of vertices have them.
struct ComponentName {
  std::string vector;
  int axis = 0;
};

std::optional<ComponentName> componentOf(const std::string& name) {
  constexpr std::string_view kAxes = "xyz012";
  if (name.size() < 2 || kAxes.find(name.back()) == kAxes.npos) return std::nullopt;
  const char before = name[name.size() - 2];
  const std::size_t length = name.size() - (before == '_' || before == '.' ? 2 : 1);
  return ComponentName{name.substr(0, length), int(kAxes.find(name.back()) % 3)};
}

/// Three attributes of one number that are one vector, or an attribute of three three times.
using Components = std::array<MeshAttribute*, 3>;

std::vector<Components> vectorsOf(Mesh& mesh) {
  std::vector<Components> vectors;
  std::map<std::tuple<std::string, bool, MeshAttribute::Domain>, Components> parts;
  for (MeshAttribute& attribute : mesh.attributes) {
    if (attribute.width == 3 && (isNormal(attribute.name) || isVelocity(attribute.name)))
      vectors.push_back({&attribute, &attribute, &attribute});
    const auto component = attribute.width == 1 ? componentOf(attribute.name) : std::nullopt;
    if (!component || !(isNormal(component->vector) || isVelocity(component->vector))) continue;
    // "vx" and "v_0" are no parts of one vector.
    const std::string before(attribute.name, 0, attribute.name.size() - 1);
    const bool isNumbered = attribute.name.back() < 'x';
    parts[{before, isNumbered, attribute.domain}][std::size_t(component->axis)] = &attribute;
  }
  for (const auto& [name, components] : parts)
    if (std::ranges::find(components, nullptr) == components.end()) vectors.push_back(components);
  return vectors;
}

bool isOfNormals(const Components& components) {
  const std::string& name = components[0]->name;
  return isNormal(components[0]->width == 3 ? name : componentOf(name)->vector);
}

}  // namespace

Mesh moved(Mesh mesh, const Similarity& by) {
  requireValid(mesh);
  for (Vec3d& position : mesh.positions) position = by(position);
  for (const Components& components : vectorsOf(mesh)) {
    const double scale = isOfNormals(components) ? 1.0 : by.scale;
    const auto width = std::size_t(components[0]->width);
    for (std::size_t i = 0; i != components[0]->values.size(); i += width) {
      float* v[3];
      for (std::size_t c = 0; c != 3; ++c) v[c] = &components[c]->values[i + (width == 3 ? c : 0)];
      const Vec3d turned = by.turned({double(*v[0]), double(*v[1]), double(*v[2])}) * scale;
      for (int c = 0; c != 3; ++c) *v[c] = float(turned[c]);
    }
  }
  return mesh;
}

}  // namespace nephele

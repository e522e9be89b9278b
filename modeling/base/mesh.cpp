// Plain functions on indexed polygon meshes.
//
// Polygons are treated as fans from their first corner everywhere, so area, volume and triangulation agree
// with each other; for a concave polygon the fan may leave the polygon, but signed volume does not notice.
// Sums are taken about the centre of the box, so that a small mesh far from the origin keeps its digits.
// Equal positions are found with an open-addressing hash table of indices.
#include "nephele/modeling/base/mesh.h"

#include <bit>
#include <cstring>
#include <string>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"

namespace nephele {
namespace {

struct Bounds {
  Vec3d min{}, max{};
  bool empty = true;
};

Bounds usedBounds(const Mesh& mesh) {
  Bounds bounds;
  for (const std::uint32_t v : mesh.corners) {
    const Vec3d& p = mesh.positions[v];
    if (bounds.empty) {
      bounds = {p, p, false};
    } else {
      bounds.min = min(bounds.min, p);
      bounds.max = max(bounds.max, p);
    }
  }
  return bounds;
}

Vec3d center(const Bounds& bounds) {
  return (bounds.min + bounds.max) * 0.5;
}

// Adding zero turns -0 into +0, so that values that compare equal have equal bits.
std::uint64_t bitsOf(double value) {
  return std::bit_cast<std::uint64_t>(value + 0.0);
}

std::uint64_t hashOf(const Vec3d& p) {
  std::uint64_t h = bitsOf(p.x) * 0x9E3779B97F4A7C15ull;
  h = (std::rotl(h, 23) ^ bitsOf(p.y)) * 0xC2B2AE3D27D4EB4Full;
  h = (std::rotl(h, 29) ^ bitsOf(p.z)) * 0x165667B19E3779F9ull;
  return h ^ (h >> 32);
}

// Copies the values of item `from` behind those already in `target`.
void appendItem(const MeshAttribute& source, std::size_t from, std::vector<float>& target) {
  const auto first = source.values.begin() + static_cast<std::ptrdiff_t>(from) * source.width;
  target.insert(target.end(), first, first + source.width);
}

}  // namespace

const Mesh& requireValid(const Mesh& mesh) {
  const auto number = [](auto value) { return std::to_string(value); };
  const std::size_t cornerCount = mesh.corners.size(), positionCount = mesh.positions.size();
  require(!mesh.faceStart.empty() && mesh.faceStart.front() == 0,
          "mesh: the first face must start at corner 0");
  for (std::size_t f = 0; f < mesh.faceCount(); ++f)
    if (mesh.faceStart[f] > mesh.faceStart[f + 1])
      throw Error("mesh: face " + number(f) + " ends before it starts");
  if (mesh.faceStart.back() != cornerCount)
    throw Error("mesh: the faces have " + number(mesh.faceStart.back()) + " corners, but there are " +
                number(cornerCount));
  for (std::size_t c = 0; c < cornerCount; ++c)
    if (mesh.corners[c] >= positionCount)
      throw Error("mesh: corner " + number(c) + " is at position " + number(mesh.corners[c]) +
                  ", but there are " + number(positionCount) + " positions");
  for (const MeshAttribute& a : mesh.attributes) {
    const bool ofVertices = a.domain == MeshAttribute::Domain::vertex;
    const std::size_t count = ofVertices ? positionCount : cornerCount;
    if (a.width < 0 || a.values.size() != count * static_cast<std::size_t>(a.width))
      throw Error("mesh: attribute '" + printable(a.name, 60) + "' has " + number(a.values.size()) +
                  " values for " + number(count) + (ofVertices ? " positions" : " corners") + ", " +
                  number(a.width) + " each");
  }
  for (const MeshGroup& group : mesh.groups) {
    const std::size_t end = std::size_t{group.firstFace} + group.faceCount;
    if (end > mesh.faceCount())
      throw Error("mesh: group '" + printable(group.name, 60) + "' ends behind face " + number(end) +
                  ", but there are " + number(mesh.faceCount()) + " faces");
  }
  return mesh;
}

Box boundingBox(const Mesh& mesh) {
  const Bounds bounds = usedBounds(mesh);
  if (bounds.empty) return {};
  return {Vec3f(bounds.min), Vec3f(bounds.max)};
}

Mesh triangulated(const Mesh& mesh) {
  requireValid(mesh);
  if (mesh.isTriangles()) {
    bool everyFace = true;
    for (std::size_t f = 0; f < mesh.faceCount() && everyFace; ++f) everyFace = mesh.face(f).size() == 3;
    if (everyFace) return mesh;
  }

  Mesh result;
  result.positions = mesh.positions;
  std::size_t triangleCount = 0;
  for (std::size_t f = 0; f < mesh.faceCount(); ++f)
    triangleCount += mesh.face(f).size() < 3 ? 0 : mesh.face(f).size() - 2;
  result.corners.reserve(3 * triangleCount);
  result.faceStart.reserve(triangleCount + 1);

  std::vector<std::uint32_t> sourceCorner;
  sourceCorner.reserve(3 * triangleCount);
  std::vector<std::uint32_t> firstTriangle(mesh.faceCount() + 1);
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
    firstTriangle[f] = static_cast<std::uint32_t>(result.faceCount());
    for (std::uint32_t c = mesh.faceStart[f] + 2; c < mesh.faceStart[f + 1]; ++c) {
      for (const std::uint32_t corner : {mesh.faceStart[f], c - 1, c}) {
        result.corners.push_back(mesh.corners[corner]);
        sourceCorner.push_back(corner);
      }
      result.faceStart.push_back(static_cast<std::uint32_t>(result.corners.size()));
    }
  }
  firstTriangle.back() = static_cast<std::uint32_t>(result.faceCount());

  for (const MeshAttribute& attribute : mesh.attributes) {
    MeshAttribute copy{attribute.name, attribute.domain, attribute.width, {}};
    if (attribute.domain == MeshAttribute::Domain::vertex) {
      copy.values = attribute.values;
    } else {
      copy.values.reserve(sourceCorner.size() * static_cast<std::size_t>(attribute.width));
      for (const std::uint32_t corner : sourceCorner) appendItem(attribute, corner, copy.values);
    }
    result.attributes.push_back(std::move(copy));
  }
  result.materialFiles = mesh.materialFiles;
  for (const MeshGroup& group : mesh.groups) {
    const std::uint32_t first = firstTriangle[group.firstFace];
    result.groups.push_back(
        {group.name, first, firstTriangle[group.firstFace + group.faceCount] - first, group.material});
  }
  return result;
}

double signedVolume(const Mesh& mesh) {
  const Vec3d origin = center(usedBounds(mesh));
  double sixfold = 0;
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
    const auto face = mesh.face(f);
    if (face.size() < 3) continue;
    const Vec3d a = mesh.positions[face[0]] - origin;
    for (std::size_t i = 2; i < face.size(); ++i)
      sixfold += dot(a, cross(mesh.positions[face[i - 1]] - origin, mesh.positions[face[i]] - origin));
  }
  return sixfold / 6;
}

double surfaceArea(const Mesh& mesh) {
  double twofold = 0;
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
    const auto face = mesh.face(f);
    if (face.size() < 3) continue;
    const Vec3d& a = mesh.positions[face[0]];
    for (std::size_t i = 2; i < face.size(); ++i)
      twofold += length(cross(mesh.positions[face[i - 1]] - a, mesh.positions[face[i]] - a));
  }
  return twofold / 2;
}

std::vector<std::uint32_t> firstEqualPosition(std::span<const Vec3d> positions) {
  constexpr std::uint32_t kFree = 0xFFFFFFFFu;
  const std::size_t slotCount = std::bit_ceil(2 * positions.size() + 1);
  std::vector<std::uint32_t> slots(slotCount, kFree);
  std::vector<std::uint32_t> first(positions.size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    std::size_t slot = hashOf(positions[i]) & (slotCount - 1);
    while (slots[slot] != kFree && positions[slots[slot]] != positions[i])
      slot = (slot + 1) & (slotCount - 1);
    if (slots[slot] == kFree) slots[slot] = static_cast<std::uint32_t>(i);
    first[i] = slots[slot];
  }
  return first;
}

}  // namespace nephele

// Edges with more than two faces, made apart.
//
// No vertex can be doubled where a surface touches itself along an edge but hangs together around both of its
// ends. A vertex in the middle of the edge, for two of its faces alone, makes two edges of one that differ
// from the one that stays.
#include "nephele/levelset/cut/detail/solids/crowded_edges.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <vector>

namespace nephele::detail {

namespace {

constexpr std::uint32_t kNone = ~0u;

/// The numbers of the vertices in the middle of a triangle's edges, or kNone.
using Middles = std::array<std::uint32_t, 3>;
/// Corners of a triangle that takes the place of another one: 0 to 2 are those of the other one, 3 + k is the
/// middle of its edge k.
using Part = std::array<std::uint32_t, 3>;

std::vector<Part> partsOf(const Middles& middles) {
  std::vector<Part> parts{{0, 1, 2}};
  for (std::uint32_t k = 0; k < 3; ++k) {
    if (middles[k] == kNone) continue;
    const std::uint32_t end = (k + 1) % 3;
    for (Part& part : parts) {
      const auto at = std::find(part.begin(), part.end(), k);
      if (at == part.end()) continue;
      std::rotate(part.begin(), at, part.end());
      if (part[1] != end) continue;
      const std::uint32_t apex = part[2];
      part = {k, 3 + k, apex};
      parts.push_back({3 + k, end, apex});
      break;
    }
  }
  return parts;
}

/// Values of corners 0 to 5 of a triangle, from those of its own three.
std::vector<float> withMeans(std::span<const float> own, std::size_t width) {
  std::vector<float> values(own.begin(), own.end());
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t i = 0; i < width; ++i)
      values.push_back((own[width * k + i] + own[width * ((k + 1) % 3) + i]) / 2);
  return values;
}

}  // namespace

void splitEdges(Mesh& mesh, std::span<const CornerPair> edges) {
  if (edges.empty()) return;
  const auto next = [](std::uint32_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; };
  std::map<std::uint32_t, Middles> middlesOf;
  for (const CornerPair& edge : edges) {
    const auto vertex = std::uint32_t(mesh.positions.size());
    const std::uint32_t a = mesh.corners[edge[0]], b = mesh.corners[next(edge[0])];
    mesh.positions.push_back((mesh.positions[a] + mesh.positions[b]) / 2.0);
    for (MeshAttribute& attribute : mesh.attributes) {
      const auto width = std::size_t(attribute.width);
      if (attribute.domain != MeshAttribute::Domain::vertex) continue;
      for (std::size_t i = 0; i < width; ++i)
        attribute.values.push_back((attribute.values[width * a + i] + attribute.values[width * b + i]) / 2);
    }
    for (const std::uint32_t corner : edge)
      middlesOf.try_emplace(corner / 3, Middles{kNone, kNone, kNone}).first->second[corner % 3] = vertex;
  }

  std::vector<std::uint32_t> corners, firstOf;
  std::vector<std::vector<float>> values(mesh.attributes.size());
  for (std::uint32_t f = 0; f < mesh.faceCount(); ++f) {
    firstOf.push_back(std::uint32_t(corners.size() / 3));
    const auto found = middlesOf.find(f);
    const Middles middles = found == middlesOf.end() ? Middles{kNone, kNone, kNone} : found->second;
    const auto face = mesh.face(f);
    const std::array<std::uint32_t, 6> vertices{face[0],    face[1],    face[2],
                                                middles[0], middles[1], middles[2]};
    const std::vector<Part> parts = partsOf(middles);
    for (const Part& part : parts)
      for (const std::uint32_t c : part) corners.push_back(vertices[c]);
    for (std::size_t a = 0; a < mesh.attributes.size(); ++a) {
      const MeshAttribute& attribute = mesh.attributes[a];
      if (attribute.domain != MeshAttribute::Domain::corner) continue;
      const auto width = std::size_t(attribute.width);
      const auto all = withMeans(std::span(attribute.values).subspan(3 * width * f, 3 * width), width);
      for (const Part& part : parts)
        for (const std::uint32_t c : part)
          values[a].insert(values[a].end(), all.begin() + std::ptrdiff_t(width * c),
                           all.begin() + std::ptrdiff_t(width * (c + 1)));
    }
  }
  firstOf.push_back(std::uint32_t(corners.size() / 3));
  mesh.corners = std::move(corners);
  mesh.faceStart.clear();
  for (std::uint32_t c = 0; c <= mesh.corners.size(); c += 3) mesh.faceStart.push_back(c);
  for (std::size_t a = 0; a < mesh.attributes.size(); ++a)
    if (mesh.attributes[a].domain == MeshAttribute::Domain::corner)
      mesh.attributes[a].values = std::move(values[a]);
  for (MeshGroup& group : mesh.groups) {
    const std::uint32_t end = firstOf[group.firstFace + group.faceCount];
    group.firstFace = firstOf[group.firstFace];
    group.faceCount = end - group.firstFace;
  }
}

}  // namespace nephele::detail

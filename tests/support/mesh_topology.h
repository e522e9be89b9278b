#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <numeric>
#include <ostream>
#include <unordered_map>
#include <vector>

#include "nephele/modeling/base/mesh.h"

namespace nephele::test {

/// Topology of a mesh by its vertex indices alone: no positions are merged.
struct Topology {
  std::size_t openEdges = 0;         ///< Edges with one face, or two faces that run the same way.
  std::size_t nonManifoldEdges = 0;  ///< Edges with more than two faces.
  std::size_t splitVertices = 0;     ///< Vertices whose faces form more than one fan.
  std::size_t unusedVertices = 0;
  std::size_t components = 0;
  long eulerCharacteristic = 0;

  bool isClosedManifold() const {
    return openEdges == 0 && nonManifoldEdges == 0 && splitVertices == 0 && unusedVertices == 0;
  }
};

inline std::ostream& operator<<(std::ostream& out, const Topology& t) {
  return out << t.openEdges << " open edges, " << t.nonManifoldEdges << " non-manifold edges, "
             << t.splitVertices << " split vertices, " << t.unusedVertices << " unused vertices, "
             << t.components << " components, chi " << t.eulerCharacteristic;
}

inline Topology topologyOf(const Mesh& mesh) {
  struct Edge {
    int forward = 0, backward = 0;
  };
  Topology result;
  const std::size_t vertexCount = mesh.positions.size();
  std::unordered_map<std::uint64_t, Edge> edges;
  edges.reserve(2 * mesh.corners.size());
  std::vector<std::uint32_t> component(vertexCount);
  std::iota(component.begin(), component.end(), 0u);
  const auto root = [&](std::uint32_t v) {
    while (component[v] != v) v = component[v] = component[component[v]];
    return v;
  };
  // Per vertex, one link (next, previous) for each of its faces.
  std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>> links(vertexCount);
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
    const auto face = mesh.face(f);
    for (std::size_t i = 0; i < face.size(); ++i) {
      const std::uint32_t a = face[i];
      const std::uint32_t b = face[(i + 1) % face.size()];
      Edge& edge = edges[std::uint64_t(std::min(a, b)) << 32 | std::max(a, b)];
      ++(a < b ? edge.forward : edge.backward);
      links[a].push_back({b, face[(i + face.size() - 1) % face.size()]});
      component[root(a)] = root(b);
    }
  }
  for (const auto& [key, edge] : edges) {
    if (edge.forward + edge.backward > 2) {
      ++result.nonManifoldEdges;
    } else if (edge.forward != 1 || edge.backward != 1) {
      ++result.openEdges;
    }
  }
  std::size_t usedVertices = 0;
  for (std::uint32_t v = 0; v < vertexCount; ++v) {
    const auto& around = links[v];
    if (around.empty()) {
      ++result.unusedVertices;
      continue;
    }
    ++usedVertices;
    if (root(v) == v) ++result.components;
    std::map<std::uint32_t, std::uint32_t> next(around.begin(), around.end());
    std::uint32_t at = around[0].first;
    std::size_t steps = 0;
    do {
      const auto it = next.find(at);
      if (it == next.end()) break;
      at = it->second;
      ++steps;
    } while (at != around[0].first && steps <= around.size());
    if (steps != around.size()) ++result.splitVertices;
  }
  result.eulerCharacteristic = long(usedVertices) - long(edges.size()) + long(mesh.faceCount());
  return result;
}

}  // namespace nephele::test

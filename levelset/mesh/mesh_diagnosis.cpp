// What a mesh is and what is wrong with it, in linear time.
//
// Equal positions are merged by index first. Edges are then gathered at their smaller vertex by a counting
// sort and grouped there by a short insertion sort, which is several times faster than one hash table or one
// global sort. Components and boundary loops come from union-find over vertices; the fans around each vertex
// from union-find over face corners, joined across every edge. Self-intersections are another matter
// (self_intersection.cpp).
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "nephele/levelset/grid/disjoint_sets.h"
#include "nephele/levelset/mesh/mesh_repair.h"

namespace nephele {
namespace {

// One side of a face on an edge. The edge belongs to its smaller vertex.
struct EdgeUse {
  std::uint32_t larger;  // the other vertex
  std::uint32_t corner;  // where the side starts in its face
  std::uint32_t next;    // where it ends
  bool ascending;        // runs from the smaller to the larger vertex
};

// Vertices between two looks at whether all is cancelled: some ten milliseconds.
constexpr std::uint32_t kVerticesUnheard = 1 << 16;

std::string counted(std::size_t count, const char* one, const char* many) {
  return fmt::format("{} {}", count, count == 1 ? one : many);
}

bool isDegenerate(const Mesh& mesh, std::span<const std::uint32_t> face,
                  std::span<const std::uint32_t> vertexOf) {
  const std::size_t n = face.size();
  if (n < 3) return true;
  // Corners further apart may be equal: so are those of the bridge to a hole in a polygon.
  for (std::size_t i = 0; i < n; ++i)
    for (const std::size_t step : {1, 2})
      if (vertexOf[face[i]] == vertexOf[face[(i + step) % n]]) return true;
  const Vec3d& a = mesh.positions[face[0]];
  for (std::size_t i = 2; i < n; ++i) {
    const Vec3d u = mesh.positions[face[i - 1]] - a, v = mesh.positions[face[i]] - a;
    const Vec3d w = cross(u, v);
    if (dot(w, w) > 1e-30 * dot(u, u) * dot(v, v)) return false;
  }
  return true;
}

// Faces with the same set of vertices as one before them.
std::size_t countDuplicates(const Mesh& mesh, std::span<const std::uint32_t> vertexOf) {
  struct Key {
    std::uint64_t hash;
    std::uint32_t face;
  };
  std::vector<Key> keys(mesh.faceCount());
  for (std::uint32_t f = 0; f < keys.size(); ++f) {
    // Sum and product of scrambled indices do not depend on the order of the corners.
    std::uint64_t sum = 0, product = 1;
    for (const std::uint32_t corner : mesh.face(f)) {
      std::uint64_t h = (vertexOf[corner] + 1) * 0x9E3779B97F4A7C15ull;
      h ^= h >> 29;
      h *= 0xBF58476D1CE4E5B9ull;
      sum += h;
      product *= h | 1;
    }
    keys[f] = {sum ^ (product * 0x94D049BB133111EBull), f};
  }
  // Only faces that share a slot of this table can be equal; nearly all have one for themselves.
  const std::size_t slotCount = std::size_t{1} << (std::bit_width(keys.size()) + 2);
  std::vector<std::uint8_t> load(slotCount);
  for (const Key& key : keys) load[key.hash & (slotCount - 1)] |= load[key.hash & (slotCount - 1)] ? 2 : 1;
  std::erase_if(keys, [&](const Key& key) { return (load[key.hash & (slotCount - 1)] & 2) == 0; });
  std::sort(keys.begin(), keys.end(),
            [](const Key& a, const Key& b) { return a.hash != b.hash ? a.hash < b.hash : a.face < b.face; });
  const auto sortedVertices = [&](std::uint32_t f) {
    std::vector<std::uint32_t> vertices;
    for (const std::uint32_t corner : mesh.face(f)) vertices.push_back(vertexOf[corner]);
    std::sort(vertices.begin(), vertices.end());
    return vertices;
  };
  std::size_t duplicates = 0;
  for (std::size_t i = 1; i < keys.size(); ++i)
    duplicates +=
        keys[i].hash == keys[i - 1].hash && sortedVertices(keys[i].face) == sortedVertices(keys[i - 1].face);
  return duplicates;
}

}  // namespace

MeshDiagnosis diagnose(const Mesh& mesh, const Progress& progress) {
  requireValid(mesh);
  progress.check();
  MeshDiagnosis d;
  const std::size_t positionCount = mesh.positions.size();
  const std::vector<std::uint32_t> vertexOf = firstEqualPosition(mesh.positions);

  progress.check();
  d.faces = mesh.faceCount();
  for (std::size_t f = 0; f < d.faces; ++f) {
    const auto face = mesh.face(f);
    d.triangles += face.size() < 3 ? 0 : face.size() - 2;
    d.degenerateFaces += isDegenerate(mesh, face, vertexOf);
  }
  std::vector<bool> positionUsed(positionCount);
  for (const std::uint32_t v : mesh.corners) positionUsed[v] = true;
  std::vector<bool> vertexUsed(positionCount);
  std::size_t usedPositions = 0;
  for (std::size_t i = 0; i < positionCount; ++i) {
    usedPositions += positionUsed[i];
    if (positionUsed[i]) vertexUsed[vertexOf[i]] = true;
  }
  d.vertices = static_cast<std::size_t>(std::count(vertexUsed.begin(), vertexUsed.end(), true));
  d.mergedVertices = usedPositions - d.vertices;
  d.unusedVertices = positionCount - usedPositions;
  progress.check();
  d.duplicateFaces = countDuplicates(mesh, vertexOf);
  progress.check();
  d.volume = signedVolume(mesh);
  d.area = surfaceArea(mesh);
  d.box = boundingBox(mesh);

  progress.check();
  // Edge uses, gathered at the smaller vertex.
  std::vector<std::uint32_t> start(positionCount + 1);
  const auto forEachSide = [&](const auto& visit) {
    for (std::size_t f = 0; f < d.faces; ++f) {
      const std::uint32_t first = mesh.faceStart[f], last = mesh.faceStart[f + 1];
      for (std::uint32_t c = first; c < last; ++c) {
        const std::uint32_t next = c + 1 == last ? first : c + 1;
        visit(c, next, vertexOf[mesh.corners[c]], vertexOf[mesh.corners[next]]);
      }
    }
  };
  forEachSide([&](std::uint32_t, std::uint32_t, std::uint32_t a, std::uint32_t b) {
    if (a != b) ++start[std::min(a, b) + 1];
  });
  std::partial_sum(start.begin(), start.end(), start.begin());
  std::vector<EdgeUse> uses(start.back());
  std::vector<std::uint32_t> fill(start.begin(), start.end() - 1);
  detail::DisjointSets parts(positionCount), fans(mesh.corners.size());
  forEachSide([&](std::uint32_t c, std::uint32_t next, std::uint32_t a, std::uint32_t b) {
    if (a != b) {
      uses[fill[std::min(a, b)]++] = {std::max(a, b), c, next, a < b};
      parts.join(a, b);
    } else {
      fans.join(c, next);
    }
  });

  detail::DisjointSets loops(positionCount);
  std::vector<bool> onBoundary(positionCount);
  std::size_t edges = 0;
  for (std::uint32_t v = 0; v < positionCount; ++v) {
    if (v % kVerticesUnheard == 0) progress.check();
    const auto first = uses.begin() + start[v], last = uses.begin() + start[v + 1];
    std::sort(first, last, [](const EdgeUse& a, const EdgeUse& b) {
      return a.larger != b.larger ? a.larger < b.larger : a.corner < b.corner;
    });
    for (auto i = first; i != last;) {
      std::size_t count = 0, ascending = 0;
      const auto edge = i;
      for (; i != last && i->larger == edge->larger; ++i) {
        ++count;
        ascending += i->ascending;
        // Corners at the smaller vertex belong to one fan, and so do those at the larger one.
        fans.join(edge->ascending ? edge->corner : edge->next, i->ascending ? i->corner : i->next);
        fans.join(edge->ascending ? edge->next : edge->corner, i->ascending ? i->next : i->corner);
      }
      ++edges;
      d.unbalancedEdges += 2 * ascending != count;
      if (count == 1) {
        ++d.boundaryEdges;
        loops.join(v, edge->larger);
        onBoundary[v] = onBoundary[edge->larger] = true;
      } else if (count == 2) {
        d.misorientedEdges += ascending != 1;
      } else {
        ++d.nonManifoldEdges;
      }
    }
  }
  for (std::uint32_t v = 0; v < positionCount; ++v) {
    d.components += vertexUsed[v] && parts.root(v) == v;
    d.boundaryLoops += onBoundary[v] && loops.root(v) == v;
  }
  std::vector<std::uint8_t> fanCount(positionCount);
  for (std::uint32_t c = 0; c < mesh.corners.size(); ++c) {
    std::uint8_t& count = fanCount[vertexOf[mesh.corners[c]]];
    if (fans.root(c) == c && count < 2) ++count;
  }
  d.nonManifoldVertices = static_cast<std::size_t>(std::count(fanCount.begin(), fanCount.end(), 2));
  d.eulerCharacteristic =
      static_cast<long>(d.vertices) - static_cast<long>(edges) + static_cast<long>(d.faces);
  return d;
}

std::vector<std::string> MeshDiagnosis::problems() const {
  std::vector<std::string> list;
  if (faces == 0) list.push_back("no faces");
  if (boundaryEdges > 0)
    list.push_back(fmt::format("open: {} in {}", counted(boundaryEdges, "boundary edge", "boundary edges"),
                               counted(boundaryLoops, "hole", "holes")));
  if (nonManifoldEdges > 0)
    list.push_back(counted(nonManifoldEdges, "non-manifold edge (more than two faces)",
                           "non-manifold edges (more than two faces)"));
  if (nonManifoldVertices > 0)
    list.push_back(counted(nonManifoldVertices, "non-manifold vertex (several fans of faces)",
                           "non-manifold vertices (several fans of faces)"));
  if (misorientedEdges > 0)
    list.push_back(counted(misorientedEdges, "edge between faces of opposite orientation",
                           "edges between faces of opposite orientation"));
  if (duplicateFaces > 0) list.push_back(counted(duplicateFaces, "duplicate face", "duplicate faces"));
  if (degenerateFaces > 0) list.push_back(counted(degenerateFaces, "degenerate face", "degenerate faces"));
  if (inward()) list.push_back("oriented inwards");
  if (unusedVertices > 0) list.push_back(counted(unusedVertices, "unused vertex", "unused vertices"));
  return list;
}

}  // namespace nephele

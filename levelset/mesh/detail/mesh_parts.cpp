// Parts of a mesh, their orientation and how they lie in each other.
//
// Parts are found by union-find with parity over the edges with two faces: the parity says whether a face
// must be turned to agree with the root of its set, and a contradiction marks a one-sided part. Containment
// is decided by the winding number (sum of solid angles, van Oosterom and Strackee 1983) of one part around a
// point of another, tried only where the boxes allow it. Parts that intersect have no clean containment; they
// count as contained by the one point that is looked at, which matters only where some part is oriented
// inward.
#include "nephele/levelset/mesh/detail/mesh_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "nephele/levelset/grid/disjoint_sets.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/levelset/mesh/winding_number.h"

namespace nephele::detail {
namespace {

/// Sets of faces that are as they are or turned: 2 f stands for face f as it is, 2 f + 1 for the same turned.
class ParitySets {
 public:
  explicit ParitySets(std::size_t count) : sets_(2 * count) {}
  struct Root {
    std::uint32_t set;
    bool odd;
  };
  Root find(std::uint32_t i) {
    const std::uint32_t root = sets_.root(2 * i);
    return {root / 2, root % 2 != 0};
  }
  // False if the two are joined already with the other parity.
  bool join(std::uint32_t a, std::uint32_t b, bool differ) {
    const std::uint32_t turn = differ ? 1 : 0;
    if (sets_.root(2 * a) == sets_.root(2 * b + 1 - turn)) return false;
    sets_.join(2 * a, 2 * b + turn);
    sets_.join(2 * a + 1, 2 * b + 1 - turn);
    return true;
  }

 private:
  DisjointSets sets_;
};

struct Side {
  std::uint32_t low, high, face;
  bool ascending;
};

std::vector<Side> sortedSides(const Mesh& mesh) {
  std::vector<Side> sides;
  sides.reserve(mesh.corners.size());
  for (std::uint32_t f = 0; f < mesh.faceCount(); ++f) {
    const auto face = mesh.face(f);
    for (std::size_t i = 0; i < face.size(); ++i) {
      const std::uint32_t a = face[i], b = face[i + 1 == face.size() ? 0 : i + 1];
      if (a != b) sides.push_back({std::min(a, b), std::max(a, b), f, a < b});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::array{a.low, a.high, a.face} < std::array{b.low, b.high, b.face};
  });
  return sides;
}

struct PartShape {
  std::vector<std::uint32_t> faces;
  double volume = 0;
  Vec3d min{}, max{};
};

std::vector<PartShape> shapesOf(const Mesh& mesh, const MeshParts& parts) {
  std::vector<PartShape> shapes(parts.count);
  for (std::uint32_t f = 0; f < mesh.faceCount(); ++f) shapes[parts.partOf[f]].faces.push_back(f);
  for (PartShape& shape : shapes) {
    const Vec3d origin = mesh.positions[mesh.face(shape.faces.front())[0]];
    shape.min = shape.max = origin;
    for (const std::uint32_t f : shape.faces) {
      const auto face = mesh.face(f);
      Vec3d p[3];
      for (int k = 0; k < 3; ++k) {
        p[k] = mesh.positions[face[static_cast<std::size_t>(k)]];
        shape.min = min(shape.min, p[k]);
        shape.max = max(shape.max, p[k]);
      }
      shape.volume += dot(p[0] - origin, cross(p[1] - origin, p[2] - origin)) / 6;
    }
  }
  return shapes;
}

bool boxHolds(const PartShape& outer, const PartShape& inner) {
  for (int k = 0; k < 3; ++k)
    if (inner.min[k] < outer.min[k] || inner.max[k] > outer.max[k]) return false;
  return true;
}

// Winding number of `outer` around `inner`, rounded: 0 where it is not inside.
int containment(const Mesh& mesh, const PartShape& outer, const PartShape& inner) {
  if (!boxHolds(outer, inner)) return 0;
  const auto face = mesh.face(inner.faces.front());
  const Vec3d point = (mesh.positions[face[0]] + mesh.positions[face[1]] + mesh.positions[face[2]]) / 3.0;
  std::vector<std::span<const std::uint32_t>> triangles;
  triangles.reserve(outer.faces.size());
  for (const std::uint32_t f : outer.faces) triangles.push_back(mesh.face(f));
  return static_cast<int>(std::lround(windingNumber(mesh.positions, triangles, point)));
}

enum class Across { manifoldEdges, allEdges };

MeshParts joinFaces(const Mesh& mesh, Across across) {
  MeshParts parts;
  const std::vector<Side> sides = sortedSides(mesh);
  ParitySets sets(mesh.faceCount());
  std::vector<std::uint32_t> contradictions;
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t end = i;
    while (end < sides.size() && sides[end].low == sides[i].low && sides[end].high == sides[i].high) ++end;
    if (across == Across::allEdges) {
      for (std::size_t j = i + 1; j < end; ++j) sets.join(sides[i].face, sides[j].face, false);
    } else if (end - i == 2 &&
               !sets.join(sides[i].face, sides[i + 1].face, sides[i].ascending == sides[i + 1].ascending)) {
      contradictions.push_back(sides[i].face);
    }
    i = end;
  }
  parts.partOf.resize(mesh.faceCount());
  parts.turned.resize(mesh.faceCount());
  for (std::uint32_t f = 0; f < mesh.faceCount(); ++f) {
    const auto [root, odd] = sets.find(f);
    // The root is the lowest face of its set, so it has its number already.
    parts.partOf[f] = root == f ? static_cast<std::uint32_t>(parts.count++) : parts.partOf[root];
    parts.turned[f] = odd;
  }
  for (std::uint32_t& f : contradictions) f = parts.partOf[f];
  std::sort(contradictions.begin(), contradictions.end());
  parts.oneSided = static_cast<std::size_t>(std::unique(contradictions.begin(), contradictions.end()) -
                                            contradictions.begin());
  return parts;
}

}  // namespace

MeshParts findParts(const Mesh& mesh) {
  return joinFaces(mesh, Across::manifoldEdges);
}

MeshParts findClosedParts(const Mesh& mesh) {
  return joinFaces(mesh, Across::allEdges);
}

Mesh withMergedPositions(const Mesh& mesh) {
  const std::vector<std::uint32_t> first = firstEqualPosition(mesh.positions);
  std::vector<bool> used(first.size());
  for (const std::uint32_t v : mesh.corners) used[first[v]] = true;
  std::vector<std::uint32_t> kept(first.size()), sources;
  for (std::uint32_t v = 0; v < first.size(); ++v) {
    if (!used[v]) continue;
    kept[v] = static_cast<std::uint32_t>(sources.size());
    sources.push_back(v);
  }
  Mesh result;
  result.faceStart = mesh.faceStart;
  result.groups = mesh.groups;
  result.materialFiles = mesh.materialFiles;
  result.positions.reserve(sources.size());
  for (const std::uint32_t v : sources) result.positions.push_back(mesh.positions[v]);
  result.corners.reserve(mesh.corners.size());
  for (const std::uint32_t v : mesh.corners) result.corners.push_back(kept[first[v]]);
  for (const MeshAttribute& attribute : mesh.attributes) {
    if (attribute.domain == MeshAttribute::Domain::corner) {
      result.attributes.push_back(attribute);
      continue;
    }
    MeshAttribute copy{attribute.name, attribute.domain, attribute.width, {}};
    const auto width = static_cast<std::size_t>(attribute.width);
    for (const std::uint32_t v : sources)
      for (std::size_t k = 0; k < width; ++k) copy.values.push_back(attribute.values[v * width + k]);
    result.attributes.push_back(std::move(copy));
  }
  return result;
}

Mesh selectFaces(const Mesh& mesh, const std::vector<bool>& kept, const std::vector<bool>& turned) {
  Mesh result;
  result.positions = mesh.positions;
  std::vector<std::uint32_t> sourceCorner;
  std::vector<std::uint32_t> firstOf(mesh.faceCount() + 1);
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
    firstOf[f] = static_cast<std::uint32_t>(result.faceCount());
    if (!kept[f]) continue;
    const std::uint32_t first = mesh.faceStart[f], last = mesh.faceStart[f + 1];
    const bool turn = !turned.empty() && turned[f];
    for (std::uint32_t i = first; i < last; ++i) {
      // A turned face keeps its first corner, and so its fan.
      const std::uint32_t c = turn && i != first ? last - (i - first) : i;
      sourceCorner.push_back(c);
      result.corners.push_back(mesh.corners[c]);
    }
    result.faceStart.push_back(static_cast<std::uint32_t>(result.corners.size()));
  }
  firstOf.back() = static_cast<std::uint32_t>(result.faceCount());

  for (const MeshAttribute& attribute : mesh.attributes) {
    if (attribute.domain == MeshAttribute::Domain::vertex) {
      result.attributes.push_back(attribute);
      continue;
    }
    MeshAttribute copy{attribute.name, attribute.domain, attribute.width, {}};
    const auto width = static_cast<std::size_t>(attribute.width);
    copy.values.reserve(sourceCorner.size() * width);
    for (const std::uint32_t c : sourceCorner)
      for (std::size_t k = 0; k < width; ++k) copy.values.push_back(attribute.values[c * width + k]);
    result.attributes.push_back(std::move(copy));
  }
  for (const MeshGroup& group : mesh.groups) {
    const std::uint32_t first = firstOf[group.firstFace], end = firstOf[group.firstFace + group.faceCount];
    if (end > first) result.groups.push_back({group.name, first, end - first, group.material});
  }
  result.materialFiles = mesh.materialFiles;
  return result;
}

Mesh withoutDegenerates(const Mesh& triangles) {
  std::vector<bool> kept(triangles.faceCount());
  for (std::size_t f = 0; f < kept.size(); ++f) {
    const auto face = triangles.face(f);
    kept[f] = face[0] != face[1] && face[1] != face[2] && face[2] != face[0];
  }
  return selectFaces(triangles, kept, {});
}

Mesh withoutDuplicates(const Mesh& mesh) {
  struct Entry {
    std::vector<std::uint32_t> loop;  // from the lowest vertex on, in the direction of its lower neighbour
    std::uint32_t face;
    bool forward;  // the face runs that way
  };
  std::vector<Entry> entries(mesh.faceCount());
  for (std::uint32_t f = 0; f < entries.size(); ++f) {
    const auto face = mesh.face(f);
    std::vector<std::uint32_t> loop(face.begin(), face.end());
    std::rotate(loop.begin(), std::min_element(loop.begin(), loop.end()), loop.end());
    const bool forward = loop.size() < 2 || loop[1] <= loop.back();
    if (!forward) std::reverse(loop.begin() + 1, loop.end());
    entries[f] = {std::move(loop), f, forward};
  }
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return a.loop != b.loop ? a.loop < b.loop : a.face < b.face;
  });

  // Edges of the distinct faces: each edge once per face, so equal_range counts faces.
  using Edge = std::array<std::uint32_t, 2>;
  const auto edgeAt = [](const std::vector<std::uint32_t>& loop, std::size_t i) {
    const std::uint32_t a = loop[i], b = loop[i + 1 == loop.size() ? 0 : i + 1];
    return Edge{std::min(a, b), std::max(a, b)};
  };
  std::vector<Edge> edges;
  for (std::size_t e = 0; e < entries.size(); ++e) {
    if (e > 0 && entries[e].loop == entries[e - 1].loop) continue;
    for (std::size_t i = 0; i < entries[e].loop.size(); ++i) edges.push_back(edgeAt(entries[e].loop, i));
  }
  std::sort(edges.begin(), edges.end());
  // Most edges have an odd number of other faces: without this face they would be open.
  const auto isNeeded = [&](const std::vector<std::uint32_t>& loop) {
    std::size_t odd = 0;
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const auto [first, last] = std::equal_range(edges.begin(), edges.end(), edgeAt(loop, i));
      odd += (last - first - 1) % 2 == 1;
    }
    return 2 * odd > loop.size();
  };

  enum class Rule { cancelToOne, cancel, parity };
  const auto reduced = [&](Rule rule) {
    std::vector<bool> kept(entries.size(), true);
    for (std::size_t i = 0; i < entries.size();) {
      std::size_t end = i, forward = 0;
      for (; end < entries.size() && entries[end].loop == entries[i].loop; ++end)
        forward += entries[end].forward;
      const std::size_t backward = end - i - forward;
      if (end - i > 1) {
        const bool keepForward = rule == Rule::parity ? entries[i].forward : forward > backward;
        std::size_t keep = rule == Rule::parity ? isNeeded(entries[i].loop)
                                                : std::max(forward, backward) - std::min(forward, backward);
        if (rule == Rule::cancelToOne) keep = std::min<std::size_t>(keep, 1);
        for (std::size_t j = i; j < end; ++j) {
          kept[entries[j].face] = keep > 0 && entries[j].forward == keepForward;
          keep -= kept[entries[j].face];
        }
      }
      i = end;
    }
    return selectFaces(mesh, kept, {});
  };
  if (!diagnose(mesh).closed()) return reduced(Rule::parity);
  Mesh result = reduced(Rule::cancelToOne);
  return result.faceCount() == 0 || diagnose(result).closed() ? result : reduced(Rule::cancel);
}

Mesh withNearBoundaryMerged(const Mesh& triangles, double tolerance) {
  const std::vector<Side> sides = sortedSides(triangles);
  std::vector<std::uint32_t> boundary;
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const auto same = [&](std::size_t j) {
      return j < sides.size() && sides[j].low == sides[i].low && sides[j].high == sides[i].high;
    };
    if (!same(i + 1) && !(i > 0 && same(i - 1)))
      boundary.insert(boundary.end(), {sides[i].low, sides[i].high});
  }
  std::sort(boundary.begin(), boundary.end());
  boundary.erase(std::unique(boundary.begin(), boundary.end()), boundary.end());

  // Sorted by x, so that only a short run must be compared.
  std::stable_sort(boundary.begin(), boundary.end(), [&](std::uint32_t a, std::uint32_t b) {
    return triangles.positions[a].x < triangles.positions[b].x;
  });
  Mesh result = triangles;
  std::vector<bool> moved(triangles.positions.size());
  for (std::size_t i = 0; i < boundary.size(); ++i) {
    if (moved[boundary[i]]) continue;
    const Vec3d& p = triangles.positions[boundary[i]];
    for (std::size_t j = i + 1; j < boundary.size(); ++j) {
      const Vec3d& q = triangles.positions[boundary[j]];
      if (q.x - p.x > tolerance) break;
      if (moved[boundary[j]] || length(q - p) > tolerance) continue;
      result.positions[boundary[j]] = p;
      moved[boundary[j]] = true;
    }
  }
  return withMergedPositions(result);
}

std::vector<bool> partsToTurn(const Mesh& triangles, const MeshParts& parts) {
  const std::vector<PartShape> shapes = shapesOf(triangles, parts);
  std::vector<bool> turn(parts.count, false);
  if (std::all_of(shapes.begin(), shapes.end(), [](const PartShape& s) { return s.volume >= 0; }))
    return turn;

  // From the largest to the smallest, so that whatever holds a part is settled before it.
  std::vector<std::uint32_t> order(parts.count);
  std::iota(order.begin(), order.end(), std::uint32_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::abs(shapes[a].volume) > std::abs(shapes[b].volume);
  });
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::uint32_t part = order[i];
    int winding = 0;
    bool outermostTurned = false, inside = false;
    for (std::size_t j = 0; j < i; ++j) {
      const std::uint32_t other = order[j];
      const int w = containment(triangles, shapes[other], shapes[part]);
      if (w == 0) continue;
      if (!inside) outermostTurned = turn[other];
      inside = true;
      winding += turn[other] ? -w : w;
    }
    // A part moves with what holds it. An inward part is a cavity where there is something to hollow out.
    turn[part] = inside && outermostTurned;
    const bool inward = (shapes[part].volume < 0) != turn[part];
    if (inward && winding <= 0) turn[part] = !turn[part];
  }
  return turn;
}

}  // namespace nephele::detail

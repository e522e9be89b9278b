// From flat faces to closed shells of triangles.
//
// A face is laid flat along the largest axis of its normal. Its points are numbered by their places, so that
// both sides of a cut meet the triangulation with the same input and get the same triangles. Shells grow over
// pairs of directed edges; corners joined by such pairs are one vertex, which parts fans that only touch. A
// shell of negative volume is the wall of a cavity and goes with the smallest shell around it.
#include "nephele/levelset/cut/detail/solids/solid_triangles.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "nephele/levelset/cut/detail/solids/cap_triangles.h"
#include "nephele/levelset/grid/disjoint_sets.h"

namespace nephele::detail {
namespace {

using Edge = std::array<std::uint32_t, 2>;

// Loops of a few points need no Delaunay triangulation.
constexpr std::size_t kFewPoints = 8;

/// Loops without a point twice.
std::vector<std::vector<std::uint32_t>> loopsOf(std::size_t pointCount, std::vector<Edge> edges) {
  std::sort(edges.begin(), edges.end());
  std::vector<std::uint32_t> next(pointCount + 1);
  for (const Edge& edge : edges) ++next[edge[0] + 1];
  std::partial_sum(next.begin(), next.end(), next.begin());
  const std::vector<std::uint32_t> end(next.begin() + 1, next.end());
  std::vector<int> place(pointCount, -1);
  std::vector<std::vector<std::uint32_t>> loops;
  std::vector<std::uint32_t> path;
  for (std::uint32_t start = 0; start < pointCount; ++start) {
    std::uint32_t at = start;
    while (true) {
      if (place[at] >= 0) {
        const auto first = path.begin() + place[at];
        for (auto i = first; i != path.end(); ++i) place[*i] = -1;
        if (path.end() - first > 2) loops.emplace_back(first, path.end());
        path.erase(first, path.end());
      }
      if (next[at] == end[at]) break;
      place[at] = int(path.size());
      path.push_back(at);
      at = edges[next[at]++][1];
    }
    for (const std::uint32_t i : path) place[i] = -1;
    path.clear();
  }
  return loops;
}

class FaceTriangles {
 public:
  FaceTriangles(const SolidSplitter& splitter, std::vector<SolidTriangle>& out)
      : splitter_(splitter), out_(out) {}

  void add(const SolidFace& face, std::span<const SolidEdge> solidEdges) {
    number(solidEdges);
    const bool isFlipped = layFlat(face.id);
    edges_.clear();
    for (const SolidEdge& edge : solidEdges) {
      const Edge local{indexOf(edge.from), indexOf(edge.to)};
      edges_.push_back(isFlipped ? Edge{local[1], local[0]} : local);
    }
    // Order must not depend on the side, nor on how the solid came about.
    std::sort(edges_.begin(), edges_.end());
    const auto loops = loopsOf(vertices_.size(), edges_);
    const bool isSimple = loops.size() == 1 && loops[0].size() <= kFewPoints;
    if (!isSimple) {
      if (const auto triangles = delaunayTriangles(points_, edges_)) {
        append(face.id, *triangles, isFlipped);
        return;
      }
    }
    for (const auto& loop : loops) {
      const bool isShort = loop.size() <= kFewPoints;
      append(face.id, isShort ? bestTriangles(points_, loop) : earTriangles(points_, loop), isFlipped);
    }
  }

 private:
  void number(std::span<const SolidEdge> edges) {
    vertices_.clear();
    for (const SolidEdge& edge : edges) {
      vertices_.push_back(edge.from);
      vertices_.push_back(edge.to);
    }
    std::sort(vertices_.begin(), vertices_.end());
    vertices_.erase(std::unique(vertices_.begin(), vertices_.end()), vertices_.end());
    byId_ = vertices_;
    std::stable_sort(vertices_.begin(), vertices_.end(), [&](std::uint32_t a, std::uint32_t b) {
      return splitter_.position(a) < splitter_.position(b);
    });
    local_.resize(vertices_.size());
    for (std::uint32_t i = 0; i < vertices_.size(); ++i)
      local_[std::size_t(std::lower_bound(byId_.begin(), byId_.end(), vertices_[i]) - byId_.begin())] = i;
    solidEdges_ = edges;
  }

  std::uint32_t indexOf(std::uint32_t v) const {
    return local_[std::size_t(std::lower_bound(byId_.begin(), byId_.end(), v) - byId_.begin())];
  }

  /// Returns whether the face looks against the direction that it is seen from, the same for both sides.
  bool layFlat(std::uint32_t id) {
    const Vec3d origin = splitter_.position(vertices_[0]);
    Vec3d area{};
    for (const SolidEdge& edge : solidEdges_)
      area += cross(splitter_.position(edge.from) - origin, splitter_.position(edge.to) - origin);
    Vec3d normal;
    if (id & kOnPlane) {
      normal = splitter_.planes()[id & ~kOnPlane].normal;
    } else {
      const TriangleIndices& t = splitter_.triangle(id);
      const Vec3d a = splitter_.position(t[0]);
      normal = cross(splitter_.position(t[1]) - a, splitter_.position(t[2]) - a);
    }
    int axis = 0;
    for (const int k : {1, 2})
      if (std::abs(normal[k]) > std::abs(normal[axis])) axis = k;
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const bool isFlipped = area[axis] < 0;
    points_.clear();
    for (const std::uint32_t vertex : vertices_) {
      const Vec3d& p = splitter_.position(vertex);
      points_.push_back({p[u], p[v]});
    }
    return isFlipped;
  }

  void append(std::uint32_t face, const std::vector<TriangleIndices>& triangles, bool isFlipped) {
    for (const TriangleIndices& t : triangles) {
      TriangleIndices v{vertices_[t[0]], vertices_[t[1]], vertices_[t[2]]};
      if (isFlipped) std::swap(v[1], v[2]);
      out_.push_back({face, v});
    }
  }

  const SolidSplitter& splitter_;
  std::vector<SolidTriangle>& out_;
  std::span<const SolidEdge> solidEdges_;
  std::vector<std::uint32_t> vertices_, byId_, local_;
  std::vector<PlanePoint> points_;
  std::vector<Edge> edges_;
};

/// An edge of a triangle, from the corner to the next.
struct Half {
  std::uint64_t key;
  std::uint32_t corner;
  bool isForward;
};

std::uint32_t nextCorner(std::uint32_t corner) {
  return corner % 3 == 2 ? corner - 2 : corner + 1;
}

/// Where more than two faces meet in an edge: puts those that run back in the order of those that run forward
/// (the first `forwardCount`), each with the one across the solid between them.
void pairAroundEdge(const SolidSplitter& splitter, const std::vector<SolidTriangle>& triangles,
                    std::span<Half> halves, std::size_t forwardCount) {
  const auto at = [&](std::uint32_t corner) {
    return splitter.position(triangles[corner / 3].vertices[corner % 3]);
  };
  const Vec3d start = at(halves[0].corner), axis = normalize(at(nextCorner(halves[0].corner)) - start);
  const Vec3d right = normalize(cross(axis, std::abs(axis.x) < 0.5 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0}));
  const Vec3d up = cross(axis, right);
  const auto angle = [&](const Half& half) {
    const Vec3d arm = at(nextCorner(nextCorner(half.corner))) - start;
    return std::atan2(dot(arm, up), dot(arm, right));
  };
  for (std::size_t k = 0; k < std::min(forwardCount, halves.size() - forwardCount); ++k) {
    const double from = angle(halves[k]);
    std::size_t best = forwardCount + k;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t j = forwardCount + k; j < halves.size(); ++j) {
      // The solid lies below a face that runs forward, as angles go.
      double turn = from - angle(halves[j]);
      if (turn <= 0) turn += 2 * M_PI;
      if (turn >= least) continue;
      least = turn;
      best = j;
    }
    std::swap(halves[forwardCount + k], halves[best]);
  }
}

/// Without pairs of triangles that are the same from either side: where points coincide, a flat cut may have
/// such a pair between them. `suspects` are in the order of their numbers, some more than once.
std::vector<SolidTriangle> withoutFlakes(const std::vector<SolidTriangle>& triangles,
                                         std::vector<std::uint32_t> suspects) {
  suspects.erase(std::unique(suspects.begin(), suspects.end()), suspects.end());
  const auto sorted = [&](std::uint32_t t) {
    TriangleIndices v = triangles[t].vertices;
    std::sort(v.begin(), v.end());
    return v;
  };
  /// From the lowest vertex to the next higher, or the other way round.
  const auto runsUp = [&](std::uint32_t t) {
    const TriangleIndices &v = triangles[t].vertices, s = sorted(t);
    return v[std::size_t(std::find(v.begin(), v.end(), s[0]) - v.begin() + 1) % 3] == s[1];
  };
  std::stable_sort(suspects.begin(), suspects.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return sorted(a) < sorted(b); });
  std::vector<bool> isDropped(triangles.size());
  for (std::size_t i = 0; i + 1 < suspects.size(); ++i) {
    const std::uint32_t a = suspects[i], b = suspects[i + 1];
    if (isDropped[a] || sorted(a) != sorted(b) || runsUp(a) == runsUp(b)) continue;
    isDropped[a] = isDropped[b] = true;
  }
  std::vector<SolidTriangle> left;
  left.reserve(triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t)
    if (!isDropped[t]) left.push_back(triangles[t]);
  return left;
}

/// Whether a ray from `p` meets the shell an odd number of times. Its direction is one that no model has.
bool isInside(const SolidSplitter& splitter, const Shell& shell, const Vec3d& p) {
  const auto sheared = [&](std::uint32_t v) {
    const Vec3d d = splitter.position(v) - p;
    return Vec3d{d.x, d.y - 0.287164 * d.x, d.z - 0.137313 * d.x};
  };
  bool inside = false;
  for (const SolidTriangle& t : shell.triangles) {
    const Vec3d a = sheared(t.vertices[0]), b = sheared(t.vertices[1]), c = sheared(t.vertices[2]);
    const double ab = a.y * b.z - a.z * b.y, bc = b.y * c.z - b.z * c.y, ca = c.y * a.z - c.z * a.y;
    const bool isIn = (ab > 0 && bc > 0 && ca > 0) || (ab < 0 && bc < 0 && ca < 0);
    if (isIn && (bc * a.x + ca * b.x + ab * c.x) / (ab + bc + ca) > 0) inside = !inside;
  }
  return inside;
}

/// Makes one of points that rounding brought together, and leaves out triangles between them, which the other
/// side of a cut loses as well.
void joinEqualPoints(const SolidSplitter& splitter, std::vector<SolidTriangle>& triangles) {
  std::vector<std::uint32_t> vertices;
  vertices.reserve(3 * triangles.size());
  for (const SolidTriangle& t : triangles)
    vertices.insert(vertices.end(), t.vertices.begin(), t.vertices.end());
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  std::vector<Vec3d> positions;
  positions.reserve(vertices.size());
  for (const std::uint32_t v : vertices) positions.push_back(splitter.position(v));
  const std::vector<std::uint32_t> first = firstEqualPosition(positions);
  bool isJoined = false;
  for (std::uint32_t i = 0; i < first.size(); ++i) isJoined |= first[i] != i;
  if (!isJoined) return;
  for (SolidTriangle& t : triangles)
    for (std::uint32_t& v : t.vertices)
      v = vertices[first[std::size_t(std::ranges::lower_bound(vertices, v) - vertices.begin())]];
  std::erase_if(triangles, [](const SolidTriangle& t) {
    const TriangleIndices& v = t.vertices;
    return v[0] == v[1] || v[1] == v[2] || v[2] == v[0];
  });
}

}  // namespace

std::vector<SolidTriangle> trianglesOf(const SolidSplitter& splitter, const Solid& solid) {
  std::vector<SolidTriangle> triangles;
  triangles.reserve(solid.whole.size() + 2 * solid.edges.size());
  for (const std::uint32_t t : solid.whole) triangles.push_back({t, splitter.triangle(t)});
  FaceTriangles faces(splitter, triangles);
  for (const SolidFace& face : solid.faces) faces.add(face, solid.edgesOf(face));
  joinEqualPoints(splitter, triangles);
  return triangles;
}

std::vector<Shell> shellsOf(const SolidSplitter& splitter, const std::vector<SolidTriangle>& triangles) {
  std::vector<Half> halves(3 * triangles.size());
  const auto vertex = [&](std::uint32_t corner) { return triangles[corner / 3].vertices[corner % 3]; };
  for (std::uint32_t c = 0; c < halves.size(); ++c) {
    const std::uint32_t a = vertex(c), b = vertex(nextCorner(c));
    halves[c] = {std::uint64_t(std::min(a, b)) << 32 | std::max(a, b), c, a < b};
  }
  std::sort(halves.begin(), halves.end(), [](const Half& a, const Half& b) {
    return a.key != b.key ? a.key < b.key : a.isForward != b.isForward ? a.isForward : a.corner < b.corner;
  });
  std::vector<std::uint32_t> crowded;
  for (std::size_t i = 0, end = 0; i < halves.size(); i = end) {
    for (end = i; end < halves.size() && halves[end].key == halves[i].key;) ++end;
    for (std::size_t k = i; k < end && end - i > 2; ++k) crowded.push_back(halves[k].corner / 3);
  }
  if (!crowded.empty()) {
    std::sort(crowded.begin(), crowded.end());
    auto left = withoutFlakes(triangles, std::move(crowded));
    if (left.size() < triangles.size()) return shellsOf(splitter, left);
  }
  DisjointSets parts(triangles.size()), fans(halves.size());
  for (std::size_t i = 0, end = 0; i < halves.size(); i = end) {
    std::size_t middle = i;
    while (middle < halves.size() && halves[middle].key == halves[i].key && halves[middle].isForward)
      ++middle;
    for (end = middle; end < halves.size() && halves[end].key == halves[i].key;) ++end;
    if (end - i > 2) pairAroundEdge(splitter, triangles, std::span(halves).subspan(i, end - i), middle - i);
    for (std::size_t k = 0; k < std::min(middle - i, end - middle); ++k) {
      const std::uint32_t a = halves[i + k].corner, b = halves[middle + k].corner;
      parts.join(a / 3, b / 3);
      fans.join(a, nextCorner(b));
      fans.join(nextCorner(a), b);
    }
  }

  std::vector<Shell> shells;
  constexpr std::uint32_t kNone = ~0u;
  std::vector<std::uint32_t> shellOf(triangles.size(), kNone), numberOf(halves.size(), kNone);
  std::vector<std::uint32_t> place(triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    const std::uint32_t root = parts.root(t);
    if (shellOf[root] == kNone) {
      shellOf[root] = std::uint32_t(shells.size());
      shells.emplace_back();
    }
    Shell& shell = shells[shellOf[root]];
    place[t] = std::uint32_t(shell.triangles.size());
    shell.triangles.push_back(triangles[t]);
    for (std::uint32_t c = 3 * t; c < 3 * t + 3; ++c) {
      const std::uint32_t fan = fans.root(c);
      if (numberOf[fan] == kNone) {
        numberOf[fan] = std::uint32_t(shell.vertices.size());
        shell.vertices.push_back(vertex(c));
      }
      shell.corners.push_back(numberOf[fan]);
    }
  }
  for (std::size_t i = 0, end = 0; i < halves.size(); i = end) {
    std::size_t middle = i;
    std::vector<CornerPair> ends;
    for (end = i; end < halves.size() && halves[end].key == halves[i].key; ++end)
      middle += halves[end].isForward ? 1 : 0;
    if (end - i <= 2) continue;
    for (std::size_t k = 0; k < std::min(middle - i, end - middle); ++k) {
      const std::uint32_t a = halves[i + k].corner, b = halves[middle + k].corner;
      const CornerPair fansAtEnds{fans.root(a), fans.root(nextCorner(a))};
      const bool isCrowded = std::find(ends.begin(), ends.end(), fansAtEnds) != ends.end();
      ends.push_back(fansAtEnds);
      const auto cornerOf = [&](std::uint32_t c) { return 3 * place[c / 3] + c % 3; };
      if (isCrowded) shells[shellOf[parts.root(a / 3)]].crowded.push_back({cornerOf(a), cornerOf(b)});
    }
  }
  for (Shell& shell : shells) {
    const Vec3d origin = splitter.position(shell.vertices[0]);
    for (const SolidTriangle& t : shell.triangles)
      shell.volume +=
          dot(splitter.position(t.vertices[0]) - origin,
              cross(splitter.position(t.vertices[1]) - origin, splitter.position(t.vertices[2]) - origin)) /
          6;
  }

  for (Shell& cavity : shells) {
    if (cavity.volume >= 0) continue;
    Shell* around = nullptr;
    for (Shell& shell : shells)
      if (shell.volume > -cavity.volume && (!around || shell.volume < around->volume) &&
          isInside(splitter, shell, splitter.position(cavity.vertices[0])))
        around = &shell;
    if (!around) continue;
    const auto offset = std::uint32_t(around->vertices.size());
    const auto cornerOffset = std::uint32_t(around->corners.size());
    for (const CornerPair& pair : cavity.crowded)
      around->crowded.push_back({cornerOffset + pair[0], cornerOffset + pair[1]});
    around->triangles.insert(around->triangles.end(), cavity.triangles.begin(), cavity.triangles.end());
    around->vertices.insert(around->vertices.end(), cavity.vertices.begin(), cavity.vertices.end());
    for (const std::uint32_t c : cavity.corners) around->corners.push_back(offset + c);
    around->volume += cavity.volume;
    cavity = {};
  }
  std::erase_if(shells, [](const Shell& shell) { return shell.triangles.empty(); });
  return shells;
}

}  // namespace nephele::detail

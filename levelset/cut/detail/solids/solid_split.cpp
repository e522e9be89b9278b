// Splitting polyhedra by planes.
//
// A face is the set of its directed edges, so that all of topology is sums of signed edges. Points have a
// sign towards the plane; edges with both signs get a cut point. The part of a face on one side is closed
// along the line of the cut: sorted along it, points at which edges end without one that goes on say how many
// segments run from each to the next. What a side's faces leave open in the plane, reversed, is its cap.
// Whatever the signs, both sides are closed, so rounding can move a point but never open a piece.
//
// For Voronoi cells, which are cut apart from each other, a cut point is computed from the source triangle or
// edge and the cells that meet in it, in the order of their indices: every cell finds the same bits.
#include "nephele/levelset/cut/detail/solids/solid_split.h"

#include <algorithm>
#include <cmath>

namespace nephele::detail {
namespace {

constexpr std::uint64_t edgeKey(std::uint32_t a, std::uint32_t b) {
  return std::uint64_t(std::min(a, b)) << 32 | std::max(a, b);
}

/// Takes out pairs of edges that run to and fro; what is left is in the order of its points.
void cancelOpposite(std::vector<SolidEdge>& edges) {
  const auto key = [](const SolidEdge& edge) { return edgeKey(edge.from, edge.to); };
  std::stable_sort(edges.begin(), edges.end(),
                   [&](const SolidEdge& a, const SolidEdge& b) { return key(a) < key(b); });
  std::vector<SolidEdge> left;
  for (std::size_t i = 0, end = 0; i < edges.size(); i = end) {
    int net = 0;
    for (end = i; end < edges.size() && key(edges[end]) == key(edges[i]); ++end)
      net += edges[end].from < edges[end].to ? 1 : -1;
    for (std::size_t j = i; j < end && net != 0; ++j) {
      const int direction = edges[j].from < edges[j].to ? 1 : -1;
      if (direction * net <= 0) continue;
      left.push_back(edges[j]);
      net -= direction;
    }
  }
  edges = std::move(left);
}

/// Where three planes meet.
Vec3d meet(const CutPlane& a, const CutPlane& b, const CutPlane& c) {
  const Vec3d bc = cross(b.normal, c.normal), ca = cross(c.normal, a.normal), ab = cross(a.normal, b.normal);
  return (bc * a.offset + ca * b.offset + ab * c.offset) / dot(a.normal, bc);
}

/// Where the segment meets the plane; the same for both directions of the segment.
Vec3d between(Vec3d a, Vec3d b, const CutPlane& plane) {
  if (b < a) std::swap(a, b);
  const double da = plane.distance(a), db = plane.distance(b);
  const double t = da / (da - db);
  return t < 0.5 ? a + (b - a) * t : b + (a - b) * (db / (db - da));
}

}  // namespace

CutPlane bisector(std::span<const Vec3d> cells, std::uint32_t low, std::uint32_t high) {
  const Vec3d normal = normalize(cells[high] - cells[low]);
  return {normal, dot(normal, (cells[low] + cells[high]) * 0.5), {low, high}};
}

SolidSplitter::SolidSplitter(std::span<const Vec3d> positions, std::span<const TriangleIndices> triangles,
                             std::span<const Vec3d> cells, double tolerance)
    : source_(positions), triangles_(triangles), cells_(cells), tolerance_(tolerance) {
  stamp_.resize(positions.size());
  sign_.resize(positions.size());
}

Solid SolidSplitter::solidOf(std::span<const std::uint32_t> triangles) const {
  Solid solid;
  solid.whole.assign(triangles.begin(), triangles.end());
  measure(solid);
  return solid;
}

void SolidSplitter::measure(Solid& solid) const {
  if (solid.isEmpty()) return;
  solid.low = solid.high =
      position(solid.whole.empty() ? solid.edges[0].from : triangles_[solid.whole[0]][0]);
  const auto include = [&](std::uint32_t v) {
    solid.low = min(solid.low, position(v));
    solid.high = max(solid.high, position(v));
  };
  for (const std::uint32_t t : solid.whole)
    for (const std::uint32_t v : triangles_[t]) include(v);
  for (const SolidEdge& edge : solid.edges) include(edge.from);
}

void SolidSplitter::begin(const CutPlane& plane) {
  planes_.push_back(plane);
  cuts_.clear();
}

void SolidSplitter::finish(std::span<Solid* const> solids) {
  std::vector<std::uint32_t> used;
  for (const Solid* solid : solids)
    for (const SolidEdge& edge : solid->edges)
      if (edge.from >= firstCutPoint()) used.push_back(edge.from);
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  const auto renumber = [&](std::uint32_t& v) {
    if (v >= firstCutPoint())
      v = firstCutPoint() + std::uint32_t(std::lower_bound(used.begin(), used.end(), v) - used.begin());
  };
  for (Solid* solid : solids)
    for (SolidEdge& edge : solid->edges) {
      renumber(edge.from);
      renumber(edge.to);
    }
  std::vector<Vec3d> points;
  points.reserve(used.size());
  for (const std::uint32_t v : used) points.push_back(position(v));
  added_ = std::move(points);
  stamp_ = {};
  sign_ = {};
  cuts_ = {};
  line_ = {};
  sides_ = {};
}

int SolidSplitter::sideOfBox(const Solid& solid, const CutPlane& plane) const {
  const Vec3d half = (solid.high - solid.low) * 0.5;
  const double reach = std::abs(plane.normal.x) * half.x + std::abs(plane.normal.y) * half.y +
                       std::abs(plane.normal.z) * half.z;
  const double middle = plane.distance((solid.low + solid.high) * 0.5);
  return middle > reach + tolerance_ ? 1 : middle < -reach - tolerance_ ? -1 : 0;
}

int SolidSplitter::signOf(std::uint32_t v) {
  const auto now = std::uint32_t(planes_.size());
  if (stamp_[v] != now) {
    const double d = planes_.back().distance(position(v));
    stamp_[v] = now;
    sign_[v] = std::int8_t(d > tolerance_ ? 1 : d < -tolerance_ ? -1 : 0);
  }
  return sign_[v];
}

std::array<Solid, 2> SolidSplitter::split(const Solid& solid, std::array<bool, 2> wanted) {
  std::array<Solid, 2> result;
  for (const int side : {0, 1}) {
    sides_[side].solid = wanted[side] ? &result[side] : nullptr;
    sides_[side].rim.clear();
  }
  for (const std::uint32_t t : solid.whole) {
    const TriangleIndices& v = triangles_[t];
    const std::array<int, 3> signs{signOf(v[0]), signOf(v[1]), signOf(v[2])};
    const int low = std::min({signs[0], signs[1], signs[2]}), high = std::max({signs[0], signs[1], signs[2]});
    if (low < 0 && high > 0) {
      const std::array<SolidEdge, 3> edges{
          {{v[0], v[1], kSourceEdge}, {v[1], v[2], kSourceEdge | 1}, {v[2], v[0], kSourceEdge | 2}}};
      cutFace(t, edges);
    } else {
      keepWhole(t, signs);
    }
  }
  for (const SolidFace& face : solid.faces) {
    const auto edges = solid.edgesOf(face);
    int low = 1, high = -1;
    for (const SolidEdge& edge : edges) {
      const int sign = signOf(edge.from);
      low = std::min(low, sign);
      high = std::max(high, sign);
    }
    if (low < 0 && high > 0) {
      cutFace(face.id, edges);
    } else {
      keepFace(solid, face);
    }
  }
  for (const int side : {0, 1}) {
    if (!wanted[side]) continue;
    addCap(side);
    measure(result[side]);
  }
  return result;
}

void SolidSplitter::keepWhole(std::uint32_t t, const std::array<int, 3>& signs) {
  const TriangleIndices& v = triangles_[t];
  const int sum = signs[0] + signs[1] + signs[2];
  int side = sum > 0;
  if (sum == 0) {
    const std::array<SolidEdge, 3> edges{{{v[0], v[1], 0}, {v[1], v[2], 0}, {v[2], v[0], 0}}};
    side = coplanarSide(edges);
  }
  if (!sides_[side].solid) return;
  sides_[side].solid->whole.push_back(t);
  for (int k = 0; k < 3; ++k)
    if (signs[k] == 0 && signs[(k + 1) % 3] == 0) sides_[side].rim.push_back({v[k], v[(k + 1) % 3], t});
}

void SolidSplitter::keepFace(const Solid& solid, const SolidFace& face) {
  const auto edges = solid.edgesOf(face);
  int sum = 0;
  for (const SolidEdge& edge : edges) sum += signOf(edge.from);
  const int side = sum == 0 ? coplanarSide(edges) : sum > 0;
  if (!sides_[side].solid) return;
  Solid& kept = *sides_[side].solid;
  kept.faces.push_back({face.id, std::uint32_t(kept.edges.size()), face.edgeCount});
  kept.edges.insert(kept.edges.end(), edges.begin(), edges.end());
  for (const SolidEdge& edge : edges)
    if (signOf(edge.from) == 0 && signOf(edge.to) == 0)
      sides_[side].rim.push_back({edge.from, edge.to, face.id});
}

/// A face in the plane belongs to the solid behind it.
int SolidSplitter::coplanarSide(std::span<const SolidEdge> edges) const {
  const Vec3d& origin = position(edges[0].from);
  Vec3d normal{};
  for (const SolidEdge& edge : edges)
    normal += cross(position(edge.from) - origin, position(edge.to) - origin);
  return dot(normal, planes_.back().normal) < 0;
}

void SolidSplitter::cutFace(std::uint32_t id, std::span<const SolidEdge> edges) {
  for (Side& side : sides_) side.part.clear();
  line_.clear();
  bool runsAlong = false;
  const auto add = [&](int side, const SolidEdge& edge, bool fromOnLine, bool toOnLine) {
    sides_[side].part.push_back(edge);
    if (fromOnLine) line_.push_back({edge.from, side == 0 ? -1 : 0});
    if (toOnLine) line_.push_back({edge.to, side == 0 ? 1 : 0});
  };
  for (const SolidEdge& edge : edges) {
    const int a = signOf(edge.from), b = signOf(edge.to);
    if (a * b >= 0) {
      runsAlong |= a == 0 && b == 0;
      add(a + b > 0, edge, a == 0, b == 0);
      continue;
    }
    const std::uint32_t cut = cutVertex(edge, id);
    add(a > 0, {edge.from, cut, edge.beyond}, false, true);
    add(b > 0, {cut, edge.to, edge.beyond}, true, false);
  }
  closeAlongLine();
  for (const int side : {0, 1}) {
    if (!sides_[side].solid) continue;
    if (runsAlong) cancelOpposite(sides_[side].part);
    addPart(side, id);
  }
}

/// Adds to both parts of the current face the segments of the cut that close them.
void SolidSplitter::closeAlongLine() {
  // Islands of a face may lie on both sides without an edge that crosses.
  if (line_.empty()) return;
  const std::uint32_t plane = kOnPlane | std::uint32_t(planes_.size() - 1);
  Vec3d low = position(line_[0].vertex), high = low;
  for (const LineEnd& end : line_) {
    low = min(low, position(end.vertex));
    high = max(high, position(end.vertex));
  }
  const Vec3d size = high - low;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  std::sort(line_.begin(), line_.end(), [&](const LineEnd& a, const LineEnd& b) {
    const Vec3d &p = position(a.vertex), &q = position(b.vertex);
    return p[axis] != q[axis] ? p[axis] < q[axis] : p != q ? p < q : a.vertex < b.vertex;
  });
  int open = 0;
  for (std::size_t k = 0; k + 1 < line_.size(); ++k) {
    open += line_[k].balance;
    const std::uint32_t here = line_[k].vertex, next = line_[k + 1].vertex;
    if (here == next) continue;
    for (int i = 0; i < std::abs(open); ++i) {
      const SolidEdge along{here, next, plane}, back{next, here, plane};
      sides_[0].part.push_back(open > 0 ? along : back);
      sides_[1].part.push_back(open > 0 ? back : along);
    }
  }
}

void SolidSplitter::addPart(int side, std::uint32_t id) {
  Side& s = sides_[side];
  if (s.part.empty()) return;
  s.solid->faces.push_back({id, std::uint32_t(s.solid->edges.size()), std::uint32_t(s.part.size())});
  s.solid->edges.insert(s.solid->edges.end(), s.part.begin(), s.part.end());
  for (const SolidEdge& edge : s.part)
    if (isOnPlane(edge.from) && isOnPlane(edge.to)) s.rim.push_back({edge.from, edge.to, id});
}

/// What the faces of a side leave open in the plane.
void SolidSplitter::addCap(int side) {
  std::vector<SolidEdge>& cap = sides_[side].part;
  cap = sides_[side].rim;
  for (SolidEdge& edge : cap) std::swap(edge.from, edge.to);
  cancelOpposite(cap);
  if (cap.empty()) return;
  Solid& solid = *sides_[side].solid;
  solid.faces.push_back({kOnPlane | std::uint32_t(planes_.size() - 1), std::uint32_t(solid.edges.size()),
                         std::uint32_t(cap.size())});
  solid.edges.insert(solid.edges.end(), cap.begin(), cap.end());
}

std::uint32_t SolidSplitter::cutVertex(const SolidEdge& edge, std::uint32_t face) {
  const auto [entry, added] =
      cuts_.try_emplace(edgeKey(edge.from, edge.to), std::uint32_t(source_.size() + added_.size()));
  if (added) {
    added_.push_back(cutPoint(edge, face));
    stamp_.push_back(std::uint32_t(planes_.size()));
    sign_.push_back(0);
  }
  return entry->second;
}

CutPlane SolidSplitter::surfaceOf(std::uint32_t face) const {
  if (face & kOnPlane) return planes_[face & ~kOnPlane];
  const TriangleIndices& v = triangles_[face];
  const Vec3d &a = source_[v[0]], &b = source_[v[1]], &c = source_[v[2]];
  const Vec3d normal = normalize(cross(b - a, c - a));
  return {normal, dot(normal, a)};
}

Vec3d SolidSplitter::cutPoint(const SolidEdge& edge, std::uint32_t face) const {
  const CutPlane& plane = planes_.back();
  const Vec3d &from = position(edge.from), &to = position(edge.to);
  if (plane.cells[0] == plane.cells[1]) return between(from, to, plane);
  Vec3d point;
  if (!(face & kOnPlane) && (edge.beyond & kSourceEdge) && !(edge.beyond & kOnPlane)) {
    const TriangleIndices& v = triangles_[face];
    const std::uint32_t k = edge.beyond & 3;
    point = between(source_[v[k]], source_[v[(k + 1) % 3]], plane);
  } else {
    // The cells that meet here, in order, and the triangle of the source if there is one.
    std::array<std::uint32_t, 6> cells{};
    std::size_t count = 0;
    const auto add = [&](std::uint32_t cell) {
      std::size_t at = 0;
      while (at < count && cells[at] < cell) ++at;
      if (at < count && cells[at] == cell) return;
      for (std::size_t i = count++; i > at; --i) cells[i] = cells[i - 1];
      cells[at] = cell;
    };
    std::uint32_t triangle = kOnPlane;
    for (const std::uint32_t surface : {face, edge.beyond, kOnPlane | std::uint32_t(planes_.size() - 1)}) {
      if (surface & kOnPlane) {
        const auto& both = planes_[surface & ~kOnPlane].cells;
        if (both[0] == both[1]) return between(from, to, plane);
        add(both[0]);
        add(both[1]);
      } else {
        triangle = surface;
      }
    }
    const auto parting = [&](std::size_t k) { return bisector(cells_, cells[0], cells[k]); };
    if (triangle != kOnPlane && count == 3) {
      point = meet(surfaceOf(triangle), parting(1), parting(2));
    } else if (triangle == kOnPlane && count == 4) {
      point = meet(parting(1), parting(2), parting(3));
    } else {
      return between(from, to, plane);
    }
  }
  // Surfaces that are nearly parallel do not say where they meet; the edge does.
  const Vec3d margin{tolerance_, tolerance_, tolerance_};
  const Vec3d low = min(from, to) - margin, high = max(from, to) + margin;
  const bool isNear = point.x >= low.x && point.y >= low.y && point.z >= low.z && point.x <= high.x &&
                      point.y <= high.y && point.z <= high.z;
  return isNear ? point : between(from, to, plane);
}

}  // namespace nephele::detail

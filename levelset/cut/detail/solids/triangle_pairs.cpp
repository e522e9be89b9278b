#include "nephele/levelset/cut/detail/solids/triangle_pairs.h"

#include <cmath>
#include <utility>

#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {

TrianglePairs::Kernel::Point_3 TrianglePairs::at(std::uint32_t v) const {
  const Vec3d& p = given_.positions[v];
  return {p.x, p.y, p.z};
}

int TrianglePairs::sideOfPlane(const TriangleIndices& t, std::uint32_t v) const {
  return CGAL::orientation(at(t[0]), at(t[1]), at(t[2]), at(v));
}

int TrianglePairs::turn(FlatAxis axis, std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
  const auto flat = [&](std::uint32_t v) {
    const Vec3d& p = given_.positions[v];
    return Kernel::Point_2(p[firstCoordinate(axis)], p[secondCoordinate(axis)]);
  };
  return CGAL::orientation(flat(a), flat(b), flat(c));
}

TrianglePairs::TrianglePairs(const Surfaces& surfaces) : given_(surfaces) {
  axes_.resize(given_.triangles.size());
  parallelFor(axes_.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const TriangleIndices& t = given_.triangles[i];
      const Vec3d& a = given_.positions[t[0]];
      const Vec3d n = cross(given_.positions[t[1]] - a, given_.positions[t[2]] - a);
      // Weights, so that rounding does not decide for normals like (1, 1, 0).
      const std::array<double, 3> sizes{std::abs(n.x), 1.0137 * std::abs(n.y), 1.0291 * std::abs(n.z)};
      std::array<FlatAxis, 3> order{0, 1, 2};
      std::sort(order.begin(), order.end(), [&](FlatAxis j, FlatAxis k) { return sizes[j] > sizes[k]; });
      axes_[i] = kNoArea;
      for (const FlatAxis axis : order)
        if (turn(axis, t[0], t[1], t[2]) != 0) {
          axes_[i] = axis;
          break;
        }
    }
  });
}

/// The meetings of an edge with a triangle that is not degenerate; a and b are the edge's points, with
/// their sides of the triangle's plane.
void TrianglePairs::meetEdge(TriangleMeetings& found, std::uint32_t a, std::uint32_t b, int sideA, int sideB,
                             std::uint32_t triangle) const {
  if (sideA * sideB > 0) return;
  const TriangleIndices& t = given_.triangles[triangle];
  const auto add = [&](const Meeting& meeting) {
    found.meetings.push_back(meeting);
    return std::uint32_t(found.meetings.size() - 1);
  };
  const auto onEdge = [&](std::uint32_t p, std::uint32_t q, std::uint32_t point) {
    found.edgePoints.push_back({ordered(p, q), point});
  };
  if (sideA * sideB < 0) {
    std::array<int, 3> turns;
    for (std::size_t k = 0; k < 3; ++k)
      turns[k] = CGAL::orientation(at(a), at(b), at(t[k]), at(t[(k + 1) % 3]));
    const auto [low, high] = std::minmax({turns[0], turns[1], turns[2]});
    if (low < 0 && high > 0) return;
    const auto zeros = std::count(turns.begin(), turns.end(), 0);
    if (zeros < 2) {
      const std::uint32_t point = add(Meeting::edgeAndFace(a, b, triangle));
      onEdge(a, b, point);
      for (std::size_t k = 0; k < 3; ++k)
        if (turns[k] == 0) onEdge(t[k], t[(k + 1) % 3], point);
    } else {
      // Through the corner that both edges have.
      for (std::size_t k = 0; k < 3; ++k)
        if (turns[k] == 0 && turns[(k + 2) % 3] == 0) {
          onEdge(a, b, add(Meeting::vertex(t[k])));
          break;
        }
    }
    return;
  }
  const FlatAxis axis = axes_[triangle];
  const int sense = turn(axis, t[0], t[1], t[2]);
  for (const auto& [v, side] : {std::pair(a, sideA), std::pair(b, sideB)}) {
    if (side != 0) continue;
    std::array<int, 3> turns;
    for (std::size_t k = 0; k < 3; ++k) turns[k] = sense * turn(axis, t[k], t[(k + 1) % 3], v);
    if (std::min({turns[0], turns[1], turns[2]}) < 0) continue;
    const std::uint32_t point = add(Meeting::vertex(v));
    for (std::size_t k = 0; k < 3; ++k)
      if (turns[k] == 0) onEdge(t[k], t[(k + 1) % 3], point);
  }
  if (sideA != 0 || sideB != 0) return;
  std::array<int, 3> sides;
  for (std::size_t k = 0; k < 3; ++k) sides[k] = turn(axis, a, b, t[k]);
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t c = t[k], d = t[(k + 1) % 3];
    if (sides[k] == 0 && isBetween(a, b, c)) onEdge(a, b, add(Meeting::vertex(c)));
    if (sides[k] * sides[(k + 1) % 3] >= 0 || turn(axis, c, d, a) * turn(axis, c, d, b) >= 0) continue;
    const std::uint32_t point = add(Meeting::edges(a, b, c, d));
    onEdge(a, b, point);
    onEdge(c, d, point);
  }
}

/// Whether c, on the line through a and b, is strictly between them.
bool TrianglePairs::isBetween(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
  const Vec3d &p = given_.positions[a], &q = given_.positions[b], &r = given_.positions[c];
  const auto less = [](const Vec3d& x, const Vec3d& y) { return x < y; };
  return (less(p, r) && less(r, q)) || (less(q, r) && less(r, p));
}

void TrianglePairs::meet(TriangleMeetings& found, std::uint32_t s, std::uint32_t t) const {
  if (axes_[s] == kNoArea || axes_[t] == kNoArea) return;
  const TriangleIndices &a = given_.triangles[s], &b = given_.triangles[t];
  const auto areApart = [](const std::array<int, 3>& sides) {
    return std::min({sides[0], sides[1], sides[2]}) > 0 || std::max({sides[0], sides[1], sides[2]}) < 0;
  };
  const std::array<int, 3> sidesB{sideOfPlane(a, b[0]), sideOfPlane(a, b[1]), sideOfPlane(a, b[2])};
  if (areApart(sidesB)) return;
  const std::array<int, 3> sidesA{sideOfPlane(b, a[0]), sideOfPlane(b, a[1]), sideOfPlane(b, a[2])};
  if (areApart(sidesA)) return;
  const bool inOnePlane = sidesB == std::array<int, 3>{0, 0, 0};
  auto first = std::uint32_t(found.meetings.size());
  const auto end = [&] {
    const auto count = std::uint32_t(found.meetings.size()) - first;
    return std::pair(std::exchange(first, std::uint32_t(found.meetings.size())), count);
  };
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t l = (k + 1) % 3;
    meetEdge(found, b[k], b[l], sidesB[k], sidesB[l], s);
    if (!inOnePlane) continue;
    const auto [begin, count] = end();
    found.contacts.push_back({s, t, {b[k], b[l]}, begin, count});
  }
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t l = (k + 1) % 3;
    meetEdge(found, a[k], a[l], sidesA[k], sidesA[l], t);
    if (!inOnePlane) continue;
    const auto [begin, count] = end();
    found.contacts.push_back({t, s, {a[k], a[l]}, begin, count});
  }
  if (inOnePlane) return;
  const auto [begin, count] = end();
  if (count < 2) return;
  found.contacts.push_back({s, t, {kNoPoint, kNoPoint}, begin, count});
  found.contacts.push_back({t, s, {kNoPoint, kNoPoint}, begin, count});
}

}  // namespace nephele::detail

#pragma once

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <algorithm>
#include <array>
#include <compare>
#include <vector>

#include "nephele/levelset/cut/detail/solids/meeting_points.h"
#include "nephele/levelset/cut/detail/solids/surface_arrangement.h"

/// Holds CGAL: for sources of the target nephele_levelset_exact only.
namespace nephele::detail {

using PointPair = std::array<std::uint32_t, 2>;
/// Of a triangle without an area.
inline constexpr FlatAxis kNoArea = 3;
inline constexpr std::uint32_t kNoPoint = ~0u;

constexpr PointPair ordered(std::uint32_t a, std::uint32_t b) {
  return {std::min(a, b), std::max(a, b)};
}

/// A point on an edge, as an index into a list of meetings and later as a number.
struct EdgePoint {
  PointPair edge;
  std::uint32_t point;
  auto operator<=>(const EdgePoint&) const = default;
};

/// What a pair of triangles has in common.
struct TriangleContact {
  /// The triangle that it is a segment of, and the one that makes it.
  std::uint32_t triangle, other;
  /// Of `other`, if the segment is part of it and in the plane of `triangle`; else kNoPoint.
  PointPair edge;
  /// Meetings, of which at most two are different places.
  std::uint32_t first, count;
};

/// What a group of pairs gives.
struct TriangleMeetings {
  std::vector<Meeting> meetings;
  std::vector<EdgePoint> edgePoints;
  std::vector<TriangleContact> contacts;
};

/// Finds what pairs of triangles have in common, by exact predicates on the given points.
class TrianglePairs {
 public:
  /// `surfaces` must outlive this.
  explicit TrianglePairs(const Surfaces& surfaces);

  /// In which coordinates each triangle is looked at, kNoArea if it has no area.
  FlatAxis axis(std::uint32_t triangle) const { return axes_[triangle]; }
  /// 1, 0, -1: which way three given points turn, as seen along an axis.
  int turn(FlatAxis axis, std::uint32_t a, std::uint32_t b, std::uint32_t c) const;
  /// Appends what two triangles have in common.
  void meet(TriangleMeetings& found, std::uint32_t s, std::uint32_t t) const;

 private:
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

  Kernel::Point_3 at(std::uint32_t v) const;
  int sideOfPlane(const TriangleIndices& t, std::uint32_t v) const;
  void meetEdge(TriangleMeetings& found, std::uint32_t a, std::uint32_t b, int sideA, int sideB,
                std::uint32_t triangle) const;
  bool isBetween(std::uint32_t a, std::uint32_t b, std::uint32_t c) const;

  const Surfaces& given_;
  std::vector<FlatAxis> axes_;
};

}  // namespace nephele::detail

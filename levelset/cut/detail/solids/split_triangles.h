#pragma once

#include <span>
#include <vector>

#include "nephele/levelset/cut/detail/solids/meeting_points.h"
#include "nephele/levelset/cut/detail/solids/triangle_pairs.h"

/// Holds CGAL: for sources of the target nephele_levelset_exact only.
namespace nephele::detail {

/// Triangles of a face with points on its outline, in order, and segments inside of it, which do not cross.
/// `isFlipped`: its outline runs clockwise as seen along `axis`. `isExact`: the same for all faces with the
/// same points, not from rounded ones.
std::vector<TriangleIndices> splitTriangles(const MeetingPoints& points, FlatAxis axis, bool isFlipped,
                                            bool isExact, const std::vector<std::uint32_t>& outline,
                                            std::span<const PointPair> segments);

/// Triangles between the points of an outline that all lie on one line.
std::vector<TriangleIndices> trianglesWithoutArea(const std::vector<std::uint32_t>& outline);

}  // namespace nephele::detail

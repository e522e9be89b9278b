#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace nephele::detail {

using PlanePoint = std::array<double, 2>;

/// Triangles, counter-clockwise, of the region to the left of the directed edges, which are closed loops in
/// any order: the constrained Delaunay triangulation. The same input gives the same triangles. Nothing if
/// edges cross, a point lies on an edge or two points are equal.
std::optional<std::vector<std::array<std::uint32_t, 3>>> delaunayTriangles(
    std::span<const PlanePoint> points, std::span<const std::array<std::uint32_t, 2>> edges);

/// Triangles of one loop of few points, so that the worst of them is as good as can be; otherwise as
/// `earTriangles`. Cost: cubic.
std::vector<std::array<std::uint32_t, 3>> bestTriangles(std::span<const PlanePoint> points,
                                                        std::span<const std::uint32_t> loop);

/// Triangles of one loop, counter-clockwise (a loop that runs clockwise gives its triangles reversed). Always
/// two fewer than points, whatever their places. Cost: quadratic.
std::vector<std::array<std::uint32_t, 3>> earTriangles(std::span<const PlanePoint> points,
                                                       std::span<const std::uint32_t> loop);

}  // namespace nephele::detail

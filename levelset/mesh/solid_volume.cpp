// Volume of a closed mesh whose parts overlap or that intersects itself.
//
// Parallel rays on a square lattice over the two longer sides of the box; along each the winding number steps
// at every triangle, and the stretches where it is positive are summed. The rays are found by projecting each
// triangle on the lattice. Which side of an edge a ray passes is computed from the edge's ends in one fixed
// order, so two triangles that share an edge always agree and no ray slips between them.
#include <algorithm>
#include <array>
#include <cmath>

#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/modeling/base/error.h"

namespace nephele {
namespace {

constexpr int kRaysAlongLongestSide = 1024;
constexpr double kMostVisits = 2e7;  // of rays by the boxes of projected triangles

struct Crossing {
  std::uint64_t ray;
  double depth;
  int step;  // what the winding number does here, going up
};

struct Point {
  double x, y, z;  // z along the rays
};

// True if `p` lies left of a -> b, seen against the rays; the same answer as for b -> a, negated.
bool isLeft(const Point& a, const Point& b, double x, double y) {
  const bool swapped = b.x < a.x || (b.x == a.x && b.y < a.y);
  const Point &low = swapped ? b : a, &high = swapped ? a : b;
  const bool left = (high.x - low.x) * (y - low.y) - (high.y - low.y) * (x - low.x) >= 0;
  return left != swapped;
}

}  // namespace

double solidVolume(const Mesh& source) {
  require(source.faceCount() > 0, "solid volume: the mesh has no faces");
  const Mesh mesh = triangulated(source);
  const Box box = boundingBox(mesh);
  const Vec3f size = box.size();
  const int up = size.x <= size.y && size.x <= size.z ? 0 : size.y <= size.z ? 1 : 2;
  const int across = (up + 1) % 3, along = (up + 2) % 3;
  const double longest = static_cast<double>(box.longestSide());
  require(std::isfinite(longest), "solid volume: the mesh is too large for its coordinates");
  if (!(longest > 0)) return 0;

  // Fewer rays where many triangles lie over each other, so that time and memory stay bounded.
  double covered = 0;
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
    const auto face = mesh.face(f);
    const Vec3d &a = mesh.positions[face[0]], &b = mesh.positions[face[1]], &c = mesh.positions[face[2]];
    const Vec3d extent = max(max(a, b), c) - min(min(a, b), c);
    covered += extent[across] * extent[along];
  }
  const double spacing = std::max(longest / kRaysAlongLongestSide, std::sqrt(covered / kMostVisits));

  // An odd shift keeps rays off the regular positions that models like.
  const double x0 = static_cast<double>(box.min[across]) - 0.38197 * spacing;
  const double y0 = static_cast<double>(box.min[along]) - 0.61803 * spacing;
  std::vector<Crossing> crossings;
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
    std::array<Point, 3> t;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3d& p = mesh.positions[mesh.face(f)[k]];
      t[k] = {p[across], p[along], p[up]};
    }
    const auto [xLow, xHigh] = std::minmax({t[0].x, t[1].x, t[2].x});
    const auto [yLow, yHigh] = std::minmax({t[0].y, t[1].y, t[2].y});
    const double area = (t[1].x - t[0].x) * (t[2].y - t[0].y) - (t[1].y - t[0].y) * (t[2].x - t[0].x);
    const auto iEnd = static_cast<std::int64_t>(std::floor((xHigh - x0) / spacing));
    const auto jEnd = static_cast<std::int64_t>(std::floor((yHigh - y0) / spacing));
    for (auto i = static_cast<std::int64_t>(std::ceil((xLow - x0) / spacing)); i <= iEnd; ++i)
      for (auto j = static_cast<std::int64_t>(std::ceil((yLow - y0) / spacing)); j <= jEnd; ++j) {
        const double x = x0 + static_cast<double>(i) * spacing, y = y0 + static_cast<double>(j) * spacing;
        const bool left = isLeft(t[0], t[1], x, y);
        if (isLeft(t[1], t[2], x, y) != left || isLeft(t[2], t[0], x, y) != left) continue;
        // Barycentric depth; a triangle on edge has all its points at about one depth along the ray.
        const double b =
            area == 0 ? 0 : ((x - t[0].x) * (t[2].y - t[0].y) - (y - t[0].y) * (t[2].x - t[0].x)) / area;
        const double c =
            area == 0 ? 0 : ((t[1].x - t[0].x) * (y - t[0].y) - (t[1].y - t[0].y) * (x - t[0].x)) / area;
        const double depth = t[0].z + b * (t[1].z - t[0].z) + c * (t[2].z - t[0].z);
        const std::uint64_t ray = static_cast<std::uint64_t>(i) << 32 | static_cast<std::uint32_t>(j);
        crossings.push_back({ray, depth, left ? -1 : 1});
      }
  }
  std::sort(crossings.begin(), crossings.end(), [](const Crossing& a, const Crossing& b) {
    return a.ray != b.ray ? a.ray < b.ray : a.depth != b.depth ? a.depth < b.depth : a.step > b.step;
  });
  double length = 0;
  int winding = 0;
  for (std::size_t i = 0; i + 1 < crossings.size(); ++i) {
    winding += crossings[i].step;
    if (crossings[i + 1].ray != crossings[i].ray)
      winding = 0;
    else if (winding > 0)
      length += crossings[i + 1].depth - crossings[i].depth;
  }
  return length * spacing * spacing;
}

}  // namespace nephele

// Volume of a closed mesh whose parts overlap or that intersects itself.
//
// Parallel rays on a square lattice over the two longer sides of the box; along each the winding number steps
// at every triangle, and the stretches where it is positive are summed. The rays are found by projecting each
// triangle on the lattice. Which side of an edge a ray passes is computed from the edge's ends in one fixed
// order, so two triangles that share an edge always agree and no ray slips between them.
//
// The lattice is worked off in strips, so that few crossings are held at once.
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

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

struct RayLattice {
  int across, along, up;  // axes; rays run up
  double x0, y0, spacing;

  Point operator()(const Vec3d& p) const { return {p[across], p[along], p[up]}; }
  std::int64_t firstFrom(double low, double origin) const {
    return static_cast<std::int64_t>(std::ceil((low - origin) / spacing));
  }
  std::int64_t lastTo(double high, double origin) const {
    return static_cast<std::int64_t>(std::floor((high - origin) / spacing));
  }
};

/// Rays whose first number is in [begin, end).
struct Strip {
  std::int64_t begin, end;
};

void addCrossings(const RayLattice& lattice, const Strip& strip, const std::array<Point, 3>& t,
                  std::vector<Crossing>& crossings) {
  const auto [xLow, xHigh] = std::minmax({t[0].x, t[1].x, t[2].x});
  const auto [yLow, yHigh] = std::minmax({t[0].y, t[1].y, t[2].y});
  const double area = (t[1].x - t[0].x) * (t[2].y - t[0].y) - (t[1].y - t[0].y) * (t[2].x - t[0].x);
  const std::int64_t iEnd = std::min(lattice.lastTo(xHigh, lattice.x0) + 1, strip.end);
  const std::int64_t jEnd = lattice.lastTo(yHigh, lattice.y0) + 1;
  for (std::int64_t i = std::max(lattice.firstFrom(xLow, lattice.x0), strip.begin); i < iEnd; ++i)
    for (std::int64_t j = lattice.firstFrom(yLow, lattice.y0); j < jEnd; ++j) {
      const double x = lattice.x0 + static_cast<double>(i) * lattice.spacing;
      const double y = lattice.y0 + static_cast<double>(j) * lattice.spacing;
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

/// The length of all rays inside.
double insideLength(std::vector<Crossing>& crossings) {
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
  return length;
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

  const auto corners = [&](std::size_t f) -> std::array<Vec3d, 3> {
    const auto face = mesh.face(f);
    return {mesh.positions[face[0]], mesh.positions[face[1]], mesh.positions[face[2]]};
  };
  // Fewer rays where many triangles lie over each other, so that time stays bounded.
  double covered = 0;
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
    const auto [a, b, c] = corners(f);
    const Vec3d extent = max(max(a, b), c) - min(min(a, b), c);
    covered += extent[across] * extent[along];
  }
  const double spacing = std::max(longest / kRaysAlongLongestSide, std::sqrt(covered / kMostVisits));
  // An odd shift keeps rays off the regular positions that models like.
  const RayLattice lattice{across,
                           along,
                           up,
                           static_cast<double>(box.min[across]) - 0.38197 * spacing,
                           static_cast<double>(box.min[along]) - 0.61803 * spacing,
                           spacing};

  constexpr std::int64_t kStripRays = 16;
  const std::int64_t rays = lattice.lastTo(static_cast<double>(box.max[across]), lattice.x0) + 2;
  std::vector<std::vector<std::uint32_t>> facesOfStrip(std::size_t(rays / kStripRays + 1));
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
    const auto [a, b, c] = corners(f);
    const auto [low, high] = std::minmax({a[across], b[across], c[across]});
    const std::int64_t first = std::clamp<std::int64_t>(lattice.firstFrom(low, lattice.x0), 0, rays);
    const std::int64_t last = std::clamp<std::int64_t>(lattice.lastTo(high, lattice.x0), 0, rays);
    for (std::int64_t s = first / kStripRays; first <= last && s <= last / kStripRays; ++s)
      facesOfStrip[std::size_t(s)].push_back(std::uint32_t(f));
  }
  std::vector<double> lengths(facesOfStrip.size());
  parallelFor(lengths.size(), 1, [&](std::size_t begin, std::size_t end) {
    std::vector<Crossing> crossings;
    for (std::size_t s = begin; s < end; ++s) {
      const Strip strip{std::int64_t(s) * kStripRays, std::int64_t(s + 1) * kStripRays};
      crossings.clear();
      for (const std::uint32_t f : facesOfStrip[s]) {
        const auto [a, b, c] = corners(f);
        addCrossings(lattice, strip, {lattice(a), lattice(b), lattice(c)}, crossings);
      }
      lengths[s] = insideLength(crossings);
    }
  });
  return std::accumulate(lengths.begin(), lengths.end(), 0.0) * spacing * spacing;
}

}  // namespace nephele

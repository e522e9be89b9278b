// Nearest points in builds without Embree: by the tree of boxes, slower, with the same arithmetic for each
// triangle.
#include <algorithm>
#include <cmath>

#include "nephele/levelset/mesh/detail/triangle_discs.h"
#include "nephele/levelset/mesh/nearest_on_mesh.h"
#include "nephele/levelset/mesh/triangle_tree.h"

namespace nephele {

struct NearestOnMesh::Hierarchy {
  explicit Hierarchy(const Mesh& mesh) : units(boundingBox(mesh)), discs(detail::discsOf(mesh, units)) {
    std::vector<Vec3d> places;
    for (const Vec3d& p : mesh.positions) {
      positions.push_back(Vec3f(units.own(p)));
      places.push_back(Vec3d(positions.back()));
    }
    for (std::size_t c = 0; c != mesh.corners.size(); c += 3)
      triangles.push_back({mesh.corners[c], mesh.corners[c + 1], mesh.corners[c + 2]});
    tree.emplace(places, triangles, 0, std::uint32_t(triangles.size()));
  }

  BoxUnits units;
  std::vector<detail::TriangleDisc> discs;
  std::vector<Vec3f> positions;
  std::vector<detail::TriangleIndices> triangles;
  std::optional<detail::TriangleTree> tree;
};

NearestOnMesh::NearestOnMesh(const Mesh& mesh, const Progress& progress)
    : box_(boundingBox(requireValid(mesh))) {
  detail::requireTriangles(mesh);
  progress.check();
  hierarchy_ = std::make_unique<Hierarchy>(mesh);
}

NearestOnMesh::~NearestOnMesh() = default;

std::optional<NearestOnMesh::Hit> NearestOnMesh::nearest(const Vec3f& p, float radius) const {
  const Hierarchy& h = *hierarchy_;
  const Vec3f local(h.units.own(Vec3d(p)));
  if (!isFinite(local)) return std::nullopt;
  radius = float(h.units.own(radius));
  float squared = radius * radius;
  Vec3f offset;
  std::optional<std::uint32_t> nearest;
  h.tree->visitNear(Vec3d(local), double(radius), [&](std::uint32_t triangle, double& reach) {
    if (h.discs[triangle].isBeyond(local, float(reach))) return;
    const auto& [a, b, c] = h.triangles[triangle];
    const Vec3f q =
        detail::nearestToOrigin(h.positions[a] - local, h.positions[b] - local, h.positions[c] - local);
    const float qq = dot(q, q);
    // Equally near triangles: the lower index, whatever order the tree visits them in.
    if (qq > squared || (qq == squared && nearest && triangle > *nearest)) return;
    squared = qq;
    offset = q;
    nearest = triangle;
    // A little more, so that rounding cannot hide an equally near triangle.
    constexpr double kSlack = 1.000001;
    reach = std::sqrt(double(squared)) * kSlack;
  });
  if (!nearest) return std::nullopt;
  return Hit{Vec3f(h.units.world(Vec3d(local + offset))), float(h.units.world(std::sqrt(squared))), *nearest};
}

std::optional<std::vector<std::uint32_t>> NearestOnMesh::trianglesNear(const Vec3f& p, float radius,
                                                                       std::size_t most) const {
  const Hierarchy& h = *hierarchy_;
  std::vector<std::uint32_t> triangles;
  const Vec3f local(h.units.own(Vec3d(p)));
  if (!isFinite(local)) return triangles;
  radius = float(h.units.own(radius));
  h.tree->visitNear(Vec3d(local), double(radius), [&](std::uint32_t triangle, double& reach) {
    if (h.discs[triangle].isBeyond(local, radius)) return;
    triangles.push_back(triangle);
    // Nothing is nearer than that: the walk ends.
    if (triangles.size() > most) reach = -1;
  });
  if (triangles.size() > most) return std::nullopt;
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

}  // namespace nephele

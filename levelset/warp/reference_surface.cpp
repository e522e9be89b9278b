// A mesh that is asked for its nearest points, relative to the middle of its box.
//
// Nearest points are found in single precision and then weighted in double: the weights of a point that lies
// on an edge by rounding only are still those of that edge. Normals at vertices are the sums of the faces'
// normals weighted by their angles there (Thuermer and Wuethrich, Computing vertex normals from polygonal
// facets, 1998), so that they do not depend on how flat parts are cut into triangles.
#include "nephele/levelset/warp/reference_surface.h"

#include <algorithm>
#include <cmath>

#include "nephele/modeling/base/error.h"

namespace nephele::detail {

Vec3d nearestWeights(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const Vec3d ab = b - a, ac = c - a, ap = p - a;
  const double bb = dot(ab, ab), cc = dot(ac, ac), bc = dot(ab, ac), pb = dot(ap, ab), pc = dot(ap, ac);
  const double determinant = bb * cc - bc * bc;
  constexpr double kSliver = 1e-14;
  if (determinant > kSliver * bb * cc) {
    const double v = (cc * pb - bc * pc) / determinant, w = (bb * pc - bc * pb) / determinant;
    if (v >= 0 && w >= 0 && v + w <= 1) return {1 - v - w, v, w};
  }
  const Vec3d corners[] = {a, b, c};
  Vec3d best{1, 0, 0};
  double bestSquared = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const Vec3d side = corners[j] - corners[i];
    const double squared = dot(side, side);
    const double t = squared > 0 ? std::clamp(dot(p - corners[i], side) / squared, 0.0, 1.0) : 0.0;
    const Vec3d away = p - corners[i] - side * t;
    if (const double far = dot(away, away); far < bestSquared) {
      bestSquared = far;
      best = {};
      best[i] = 1 - t;
      best[j] = t;
    }
  }
  return best;
}

ReferenceSurface::ReferenceSurface(const Mesh& mesh) {
  require(mesh.faceCount() > 0, "transfer: the reference has no faces");
  const Mesh fans = triangulated(mesh);
  mesh_.corners = fans.corners;
  mesh_.faceStart = fans.faceStart;
  mesh_.positions = fans.positions;
  Vec3d low = mesh_.positions[mesh_.corners[0]], high = low;
  for (const std::uint32_t v : mesh_.corners) {
    require(isFinite(mesh_.positions[v]), "transfer: the reference has positions that are not finite");
    low = min(low, mesh_.positions[v]);
    high = max(high, mesh_.positions[v]);
  }
  origin_ = (low + high) * 0.5;
  for (Vec3d& p : mesh_.positions) p -= origin_;

  const std::vector<std::uint32_t> first = firstEqualPosition(mesh_.positions);
  std::vector<Vec3d> sums(mesh_.positions.size());
  const auto angle = [](const Vec3d& a, const Vec3d& b) {
    return std::atan2(length(cross(a, b)), dot(a, b));
  };
  for (std::size_t t = 0; t < mesh_.faceCount(); ++t) {
    const Vec3d p[] = {corner(t, 0), corner(t, 1), corner(t, 2)};
    const Vec3d normal = normalize(cross(p[1] - p[0], p[2] - p[0]));
    for (int i = 0; i < 3; ++i)
      sums[first[mesh_.corners[3 * t + std::size_t(i)]]] +=
          normal * angle(p[(i + 1) % 3] - p[i], p[(i + 2) % 3] - p[i]);
  }
  normals_.resize(sums.size());
  for (std::size_t v = 0; v < sums.size(); ++v) normals_[v] = Vec3f(normalize(sums[first[v]]));
  tree_ = std::make_unique<NearestOnMesh>(mesh_);
}

ReferenceSurface::Point ReferenceSurface::nearest(const Vec3d& p, float radius) const {
  const Vec3f local(p - origin_);
  auto hit = tree_->nearest(local, radius);
  if (!hit) hit = tree_->nearest(local, std::numeric_limits<float>::infinity());
  if (!hit) return {};
  return {hit->triangle,
          nearestWeights(Vec3d(hit->point), corner(hit->triangle, 0), corner(hit->triangle, 1),
                         corner(hit->triangle, 2)),
          hit->distance};
}

Vec3d ReferenceSurface::normal(const Point& at) const {
  Vec3d sum;
  for (int i = 0; i < 3; ++i)
    sum += Vec3d(normals_[mesh_.corners[3 * std::size_t(at.triangle) + std::size_t(i)]]) * at.weights[i];
  constexpr double kCancelled = 1e-6;
  if (length(sum) > kCancelled) return normalize(sum);
  const Vec3d& a = corner(at.triangle, 0);
  return normalize(cross(corner(at.triangle, 1) - a, corner(at.triangle, 2) - a));
}

}  // namespace nephele::detail

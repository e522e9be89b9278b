// Signed distance to a mesh from its nearest point.
//
// The nearest triangle comes from a bounding volume hierarchy in floats, over a copy of the mesh that is
// moved to the origin and scaled to unit size, so that neither the place nor the unit of a mesh matters. The
// point on that triangle, its distance and the sign are then computed in double precision. The sign is that
// of the angle-weighted pseudo-normal of the nearest feature (surface_geometry.h).
//
// The hierarchy may take one of two triangles whose distances differ by less than float rounding: the
// distance is then too long by less than 1e-6 of the mesh, or of the way to a point farther away than that.
// From afar that may be the far side of a thin shape, so that outside of the box only the box says where a
// point is.
#include "nephele/levelset/mesh/exact_distance.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "nephele/levelset/mesh/surface_geometry.h"
#include "nephele/modeling/base/error.h"

namespace nephele {

namespace {

struct NearestPoint {
  Vec3d weights;
  detail::Feature feature;
};

/// Barycentrics of the point of a triangle nearest to the origin, exactly 0 off the feature it lies on. Where
/// the triangle is a sliver, whose face rounding makes meaningless, the sides decide.
NearestPoint nearestToOrigin(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  using detail::Feature;
  const Vec3d ab = b - a, ac = c - a;
  const double bb = dot(ab, ab), cc = dot(ac, ac), mixed = dot(ab, ac), toB = -dot(a, ab), toC = -dot(a, ac);
  const double determinant = bb * cc - mixed * mixed;
  constexpr double kSliver = 1e-14;
  if (determinant > kSliver * bb * cc) {
    const double v = (cc * toB - mixed * toC) / determinant, w = (bb * toC - mixed * toB) / determinant;
    if (v > 0 && w > 0 && v + w < 1) return {{1 - v - w, v, w}, Feature::face};
  }
  NearestPoint best{};
  double bestSquared = std::numeric_limits<double>::infinity();
  const Vec3d* corners[3] = {&a, &b, &c};
  for (int i = 0; i < 3; ++i) {
    const Vec3d &from = *corners[i], along = *corners[(i + 1) % 3] - from;
    const double squared = dot(along, along);
    const double t = squared > 0 ? std::clamp(-dot(from, along) / squared, 0.0, 1.0) : 0.0;
    const Vec3d q = from + along * t;
    if (const double qq = dot(q, q); qq < bestSquared) {
      bestSquared = qq;
      const bool atStart = t <= 0, atEnd = t >= 1;
      best.weights = {};
      best.weights[i] = 1 - t;
      best.weights[(i + 1) % 3] = t;
      const auto corner = [](int k) { return detail::Feature(int(Feature::cornerA) + k % 3); };
      best.feature = atStart ? corner(i) : atEnd ? corner(i + 1) : detail::Feature(int(Feature::edgeAB) + i);
    }
  }
  return best;
}

class ExactDistanceNode final : public FieldNode<float> {
 public:
  explicit ExactDistanceNode(std::shared_ptr<const ExactDistance> distance)
      : distance_(std::move(distance)) {}

  void eval(const PointBlock& points, const BlockLanes<1>& values, Scratch&) const override {
    evaluate(points, values[0], nullptr);
  }
  void evalGrad(const PointBlock& points, const BlockLanes<1>& values, const BlockLanes<3>& grads,
                Scratch&) const override {
    evaluate(points, values[0], &grads);
  }
  Interval range(const Box& box, RangeMemo&) const override {
    if (box.isEmpty() || !isFinite(box.min) || !isFinite(box.max)) return Interval::everything();
    const Vec3f middle = box.center();
    const double reach = 0.5 * length(Vec3d(box.size()));
    const double slack = 1e-5 * (distance_->size() + reach + length(Vec3d(middle)));
    const double value = distance_->at(Vec3d(middle)).distance;
    return {float(value - reach - slack), float(value + reach + slack)};
  }
  float differenceStep() const override { return 1e-3f * float(distance_->size()); }

 private:
  void evaluate(const PointBlock& points, float* values, const BlockLanes<3>* grads) const {
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    ExactDistance::Cursor cursor;
    for (int i = 0; i < points.count; ++i) {
      const Vec3d p(points.x[i], points.y[i], points.z[i]);
      const bool known = isFinite(p);
      const ExactDistance::Hit hit = known ? distance_->at(p, cursor) : ExactDistance::Hit{};
      values[i] = known ? float(hit.distance) : kNan;
      if (!grads) continue;
      for (int c = 0; c < 3; ++c) (*grads)[std::size_t(c)][i] = known ? float(hit.gradient[c]) : kNan;
    }
  }

  std::shared_ptr<const ExactDistance> distance_;
};

class ExactClosestNode final : public FieldNode<Vec3f> {
 public:
  explicit ExactClosestNode(std::shared_ptr<const ExactDistance> distance) : distance_(std::move(distance)) {}

  void eval(const PointBlock& points, const BlockLanes<3>& values, Scratch&) const override {
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    ExactDistance::Cursor cursor;
    for (int i = 0; i < points.count; ++i) {
      const Vec3d p(points.x[i], points.y[i], points.z[i]);
      const Vec3f q = isFinite(p) ? Vec3f(distance_->at(p, cursor).point) : Vec3f(kNan, kNan, kNan);
      for (int c = 0; c < 3; ++c) values[std::size_t(c)][i] = q[c];
    }
  }
  float differenceStep() const override { return 1e-4f * float(distance_->size()); }

 private:
  std::shared_ptr<const ExactDistance> distance_;
};

}  // namespace

ExactDistance::ExactDistance(const Mesh& mesh) {
  requireValid(mesh);
  require(mesh.faceCount() > 0, "exact distance: the mesh has no faces");
  require(mesh.isTriangles(), "exact distance: the mesh must be triangulated");
  Vec3d low(1, 1, 1), high;
  low *= std::numeric_limits<double>::infinity();
  high = -low;
  for (const std::uint32_t v : mesh.corners) {
    require(v < mesh.positions.size(),
            fmt::format("exact distance: a face names position {} of {}", v, mesh.positions.size()));
    const Vec3d& p = mesh.positions[v];
    require(isFinite(p), "exact distance: the mesh has positions that are not finite");
    low = min(low, p);
    high = max(high, p);
  }
  mesh_.positions = mesh.positions;
  mesh_.corners = mesh.corners;
  mesh_.faceStart = mesh.faceStart;
  centre_ = (low + high) * 0.5;
  low_ = low;
  high_ = high;
  size_ = std::max({high.x - low.x, high.y - low.y, high.z - low.z});
  require(size_ > 0 && std::isfinite(size_), "exact distance: all faces of the mesh are one point");
  Mesh local = mesh_;
  for (Vec3d& p : local.positions) p = isFinite(p) ? (p - centre_) / size_ : Vec3d{};
  nearest_ = std::make_unique<NearestOnMesh>(local);
  const detail::SurfaceGeometry surface = detail::surfaceGeometry(local);
  isSolid_ = surface.manifold;
  if (isSolid_ && signedVolume(local) < 0) orientation_ = -1;
  normals_.resize(mesh.faceCount());
  for (std::size_t t = 0; t < normals_.size(); ++t) {
    const Vec3d &a = local.positions[mesh.corners[3 * t]], &b = local.positions[mesh.corners[3 * t + 1]],
                &c = local.positions[mesh.corners[3 * t + 2]];
    const Vec3d across = cross(b - a, c - a);
    area_ += 0.5 * length(across);
    normals_[t].fill(normalize(across) * orientation_);
    if (!isSolid_) continue;
    for (std::size_t f = 1; f < 7; ++f) {
      const Vec3d sum = normalize(Vec3d(surface.normals[t][f]));
      if (sum != Vec3d{}) normals_[t][f] = sum * orientation_;
    }
    if (normals_[t][0] == Vec3d{}) normals_[t][0] = normals_[t][4];
  }
  area_ *= size_ * size_;
}

ExactDistance::Hit ExactDistance::at(const Vec3d& p, Cursor& cursor) const {
  constexpr float kAnywhere = std::numeric_limits<float>::infinity();
  const Vec3d local = (p - centre_) / size_;
  // A little more than the distance to a point of the mesh, so that rounding cannot hide that point.
  const float bound = cursor.hasPoint ? float(length(cursor.point - p) / size_ * 1.0001 + 1e-6) : kAnywhere;
  auto found = nearest_->nearest(Vec3f(local), bound);
  if (!found) found = nearest_->nearest(Vec3f(local), kAnywhere);
  Hit hit;
  // Nothing is found only for points too far away for floats: any triangle is as near as another.
  hit.triangle = found ? found->triangle : 0;
  const std::uint32_t* corner = mesh_.corners.data() + 3 * std::size_t(hit.triangle);
  const Vec3d &a = mesh_.positions[corner[0]], &b = mesh_.positions[corner[1]],
              &c = mesh_.positions[corner[2]];
  const NearestPoint nearest = nearestToOrigin(a - p, b - p, c - p);
  hit.weights = nearest.weights;
  hit.point = a * nearest.weights.x + b * nearest.weights.y + c * nearest.weights.z;
  cursor = {hit.point, true};
  const Vec3d away = p - hit.point, &normal = normals_[hit.triangle][std::size_t(nearest.feature)];
  const double distance = length(away);
  bool isInBox = true;
  for (int axis = 0; axis < 3; ++axis) isInBox = isInBox && p[axis] >= low_[axis] && p[axis] <= high_[axis];
  const bool isBehind = isSolid_ && dot(away, normal) < 0;
  const double side = isBehind && isInBox ? 1.0 : -1.0;
  hit.distance = side * distance;
  // On a face the normal is the better direction; at edges and corners only where rounding leaves no other.
  constexpr double kOnSurface = 1e-9;
  const bool isOnFace = nearest.feature == detail::Feature::face && isSolid_ && (isInBox || !isBehind);
  hit.gradient = isOnFace || distance <= kOnSurface * size_ ? -normal : away * (side / distance);
  return hit;
}

ScalarField exactDistance(std::shared_ptr<const ExactDistance> distance) {
  require(distance != nullptr, "exact distance: no distance is given");
  return ScalarField(std::make_shared<ExactDistanceNode>(std::move(distance)));
}

VectorField closestPoint(std::shared_ptr<const ExactDistance> distance) {
  require(distance != nullptr, "closest point: no distance is given");
  return VectorField(std::make_shared<ExactClosestNode>(std::move(distance)));
}

ScalarField exactDistance(const Mesh& mesh) {
  return exactDistance(std::make_shared<ExactDistance>(mesh));
}

}  // namespace nephele

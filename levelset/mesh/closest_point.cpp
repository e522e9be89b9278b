// What nearest points need with every hierarchy: triangles from close by, and the field of nearest points.
// Within a block of points each query starts from the distance to the last answer, which is a bound.
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "nephele/levelset/mesh/detail/triangle_discs.h"
#include "nephele/levelset/mesh/nearest_on_mesh.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/field_node.h"

namespace nephele {

namespace detail {

std::vector<TriangleDisc> discsOf(const Mesh& mesh, const BoxUnits& units) {
  std::vector<TriangleDisc> discs(mesh.faceCount());
  const float slack = 1e-6f * float(units.own(boundingBox(mesh).longestSide()));
  for (std::size_t t = 0; t < mesh.faceCount(); ++t) {
    // In double precision: the plane of a sliver would tilt with its rounded corners.
    const Vec3d a = units.own(mesh.positions[mesh.corners[3 * t]]),
                b = units.own(mesh.positions[mesh.corners[3 * t + 1]]),
                c = units.own(mesh.positions[mesh.corners[3 * t + 2]]);
    const Vec3d middle = (a + b + c) * (1.0 / 3.0);
    const double radius = std::max({length(a - middle), length(b - middle), length(c - middle)});
    const Vec3d normal = cross(b - a, c - a);
    constexpr double kFlat = 1e-9;
    const bool hasPlane = length(normal) > kFlat * radius * radius;
    discs[t] = {Vec3f(middle), float(radius) + slack, hasPlane ? Vec3f(normalize(normal)) : Vec3f{}, slack};
  }
  return discs;
}

void requireTriangles(const Mesh& mesh) {
  require(mesh.faceCount() > 0, "closest point: the mesh has no faces");
  require(mesh.isTriangles(), "closest point: the mesh must be triangulated");
  const Box box = boundingBox(mesh);
  require(isFinite(box.min) && isFinite(box.max),
          "closest point: the mesh has positions that are not finite");
}

}  // namespace detail

namespace {

class ClosestPointNode final : public FieldNode<Vec3f> {
 public:
  explicit ClosestPointNode(const Mesh& mesh) : mesh_(mesh) {}

  void eval(const PointBlock& points, const BlockLanes<3>& values, Scratch&) const override {
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    std::optional<Vec3f> last;
    for (int i = 0; i < points.count; ++i) {
      const Vec3f p(points.x[i], points.y[i], points.z[i]);
      // A little more than the distance to a point of the mesh, so that rounding cannot hide that point.
      constexpr float kSlack = 1.0001f;
      const float bound = last ? length(*last - p) * kSlack : std::numeric_limits<float>::infinity();
      std::optional<NearestOnMesh::Hit> hit = mesh_.nearest(p, bound);
      if (!hit && last) hit = mesh_.nearest(p, std::numeric_limits<float>::infinity());
      if (hit) last = hit->point;
      const Vec3f q = hit ? hit->point : Vec3f(kNan, kNan, kNan);
      for (int c = 0; c < 3; ++c) values[std::size_t(c)][i] = q[c];
    }
  }

  std::array<Interval, 3> range(const Box&, RangeMemo&) const override {
    return rangeOf(mesh_.box().expanded(differenceStep()));
  }

  float differenceStep() const override { return 1e-4f * mesh_.box().longestSide(); }

 private:
  NearestOnMesh mesh_;
};

}  // namespace

VectorField closestPoint(const Mesh& mesh) {
  return VectorField(std::make_shared<ClosestPointNode>(mesh));
}

}  // namespace nephele

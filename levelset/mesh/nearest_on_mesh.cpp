// Nearest point of a mesh by Embree's point queries.
//
// Embree keeps the triangles relative to the centre of their box, so that floats resolve the mesh and not its
// place in the world. Within a block of points each query starts from the distance to the last answer, which
// is a bound.
#include "nephele/levelset/mesh/nearest_on_mesh.h"

#include <embree3/rtcore.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/field_node.h"

namespace nephele {

namespace {

/// The point of triangle (a, b, c) nearest to the origin: its foot on the face if that lies inside, else the
/// nearest point of the sides. Always a point of the triangle; where it is a sliver, whose face rounding
/// makes meaningless, the sides compete with the face.
Vec3f nearestToOrigin(const Vec3f& a, const Vec3f& b, const Vec3f& c) {
  const Vec3f ab = b - a, bc = c - b, ca = a - c;
  // Barycentrics of the foot from the two sides at a (normal equations).
  const float bb = dot(ab, ab), cc = dot(ca, ca), mixed = -dot(ab, ca), toB = -dot(a, ab), toC = dot(a, ca);
  const float determinant = bb * cc - mixed * mixed;
  constexpr float kSliver = 1e-3f;
  std::optional<Vec3f> face;
  if (determinant > 0.0f) {
    const float v = (cc * toB - mixed * toC) / determinant, w = (bb * toC - mixed * toB) / determinant;
    if (v >= 0.0f && w >= 0.0f && v + w <= 1.0f) face = a + ab * v - ca * w;
    if (face && determinant > kSliver * bb * cc) return *face;
  }
  Vec3f best = face.value_or(Vec3f{});
  float bestSquared = face ? dot(best, best) : std::numeric_limits<float>::infinity();
  const auto trySide = [&](const Vec3f& start, const Vec3f& along) {
    const float squared = dot(along, along);
    const float t = squared > 0 ? std::min(std::max(-dot(start, along) / squared, 0.0f), 1.0f) : 0.0f;
    const Vec3f q = start + along * t;
    if (const float qq = dot(q, q); qq < bestSquared) {
      bestSquared = qq;
      best = q;
    }
  };
  trySide(a, ab);
  trySide(b, bc);
  trySide(c, ca);
  return best;
}

}  // namespace

struct NearestOnMesh::Hierarchy {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  Vec3d centre;
  const Vec3f* positions = nullptr;
  const std::uint32_t* corners = nullptr;

  /// A disc around each triangle in its plane: settles most of those that the hierarchy offers.
  struct Disc {
    Vec3f middle;
    float radius;
    Vec3f normal;  ///< Unit, or zero for a triangle without area: then the disc is a ball.
    float slack;   ///< What rounding may cost.

    bool isBeyond(const Vec3f& p, float distance) const {
      const Vec3f away = p - middle;
      const float height = dot(away, normal);
      const float aside = std::sqrt(std::max(dot(away, away) - height * height, 0.0f)) - radius;
      const float reach = distance + slack;
      return height * height + (aside > 0.0f ? aside * aside : 0.0f) > reach * reach;
    }
  };
  std::vector<Disc> discs;

  struct Answer {
    const Hierarchy* hierarchy;
    Vec3f offset{};
    float squared;
    std::uint32_t triangle = RTC_INVALID_GEOMETRY_ID;
    /// Where to list what is near, if that is what is asked for.
    std::vector<std::uint32_t>* list = nullptr;
    std::size_t most = 0;
  };

  static bool visit(RTCPointQueryFunctionArguments* arguments) {
    auto& answer = *static_cast<Answer*>(arguments->userPtr);
    const Vec3f p(arguments->query->x, arguments->query->y, arguments->query->z);
    if (answer.hierarchy->discs[arguments->primID].isBeyond(p, arguments->query->radius)) return false;
    if (answer.list) {
      answer.list->push_back(arguments->primID);
      if (answer.list->size() <= answer.most) return false;
      arguments->query->radius = 0.0f;
      return true;
    }
    const std::uint32_t* corner = answer.hierarchy->corners + 3 * std::size_t(arguments->primID);
    const Vec3f* positions = answer.hierarchy->positions;
    const Vec3f q =
        nearestToOrigin(positions[corner[0]] - p, positions[corner[1]] - p, positions[corner[2]] - p);
    const float squared = dot(q, q);
    // Equally near triangles: the lower index, whatever order the hierarchy visits them in.
    if (squared > answer.squared || (squared == answer.squared && arguments->primID > answer.triangle))
      return false;
    answer.squared = squared;
    answer.offset = q;
    answer.triangle = arguments->primID;
    arguments->query->radius = std::sqrt(squared);
    return true;
  }

  ~Hierarchy() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
};

NearestOnMesh::NearestOnMesh(const Mesh& mesh)
    : hierarchy_(std::make_unique<Hierarchy>()), box_(boundingBox(requireValid(mesh))) {
  require(mesh.faceCount() > 0, "closest point: the mesh has no faces");
  require(mesh.isTriangles(), "closest point: the mesh must be triangulated");
  require(isFinite(box_.min) && isFinite(box_.max),
          "closest point: the mesh has positions that are not finite");
  Hierarchy& h = *hierarchy_;
  h.device = rtcNewDevice(nullptr);
  require(h.device != nullptr, "closest point: Embree cannot be started");
  h.scene = rtcNewScene(h.device);
  h.centre = Vec3d(box_.center());
  const RTCGeometry geometry = rtcNewGeometry(h.device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* positions = static_cast<Vec3f*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vec3f), mesh.positions.size()));
  auto* corners = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), mesh.faceCount()));
  if (!positions || !corners) {
    rtcReleaseGeometry(geometry);
    throw Error(fmt::format("closest point: no memory for {} triangles", mesh.faceCount()));
  }
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) positions[i] = Vec3f(mesh.positions[i] - h.centre);
  std::copy(mesh.corners.begin(), mesh.corners.end(), corners);
  h.positions = positions;
  h.corners = corners;
  h.discs.resize(mesh.faceCount());
  const float slack = 1e-6f * box_.longestSide();
  for (std::size_t t = 0; t < mesh.faceCount(); ++t) {
    // In double precision: the plane of a sliver would tilt with its rounded corners.
    const Vec3d a = mesh.positions[corners[3 * t]] - h.centre,
                b = mesh.positions[corners[3 * t + 1]] - h.centre,
                c = mesh.positions[corners[3 * t + 2]] - h.centre;
    const Vec3d middle = (a + b + c) * (1.0 / 3.0);
    const double radius = std::max({length(a - middle), length(b - middle), length(c - middle)});
    const Vec3d normal = cross(b - a, c - a);
    constexpr double kFlat = 1e-9;
    const bool hasPlane = length(normal) > kFlat * radius * radius;
    h.discs[t] = {Vec3f(middle), float(radius) + slack, hasPlane ? Vec3f(normalize(normal)) : Vec3f{}, slack};
  }
  rtcSetGeometryPointQueryFunction(geometry, Hierarchy::visit);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(h.scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(h.scene);
  require(rtcGetDeviceError(h.device) == RTC_ERROR_NONE, "closest point: Embree cannot build its hierarchy");
}

NearestOnMesh::~NearestOnMesh() = default;

std::optional<NearestOnMesh::Hit> NearestOnMesh::nearest(const Vec3f& p, float radius) const {
  const Vec3f local(Vec3d(p) - hierarchy_->centre);
  if (!isFinite(local)) return std::nullopt;
  RTCPointQuery query;
  query.x = local.x;
  query.y = local.y;
  query.z = local.z;
  query.time = 0.0f;
  query.radius = radius;
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  Hierarchy::Answer answer{hierarchy_.get(), {}, radius * radius};
  rtcPointQuery(hierarchy_->scene, &query, &context, nullptr, &answer);
  if (answer.triangle == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return Hit{Vec3f(Vec3d(local + answer.offset) + hierarchy_->centre), std::sqrt(answer.squared),
             answer.triangle};
}

std::optional<std::vector<std::uint32_t>> NearestOnMesh::trianglesNear(const Vec3f& p, float radius,
                                                                       std::size_t most) const {
  std::vector<std::uint32_t> triangles;
  const Vec3f local(Vec3d(p) - hierarchy_->centre);
  if (!isFinite(local)) return triangles;
  RTCPointQuery query{local.x, local.y, local.z, 0.0f, radius};
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  Hierarchy::Answer answer{hierarchy_.get(), {}, 0.0f, RTC_INVALID_GEOMETRY_ID, &triangles, most};
  rtcPointQuery(hierarchy_->scene, &query, &context, nullptr, &answer);
  if (triangles.size() > most) return std::nullopt;
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

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

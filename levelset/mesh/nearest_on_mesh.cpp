// Nearest point of a mesh by Embree's point queries.
//
// Embree keeps the triangles in BoxUnits, so that floats resolve the mesh and not its place in the world.
#include "nephele/levelset/mesh/nearest_on_mesh.h"

#include <embree3/rtcore.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "nephele/levelset/mesh/detail/triangle_discs.h"
#include "nephele/modeling/base/error.h"

namespace nephele {

struct NearestOnMesh::Hierarchy {
  explicit Hierarchy(const Box& box) : units(box) {}
  Hierarchy(const Hierarchy&) = delete;
  Hierarchy& operator=(const Hierarchy&) = delete;

  BoxUnits units;
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  const Vec3f* positions = nullptr;
  const std::uint32_t* corners = nullptr;

  std::vector<detail::TriangleDisc> discs;

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
        detail::nearestToOrigin(positions[corner[0]] - p, positions[corner[1]] - p, positions[corner[2]] - p);
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

NearestOnMesh::NearestOnMesh(const Mesh& mesh, const Progress& progress)
    : box_(boundingBox(requireValid(mesh))) {
  detail::requireTriangles(mesh);
  hierarchy_ = std::make_unique<Hierarchy>(box_);
  Hierarchy& h = *hierarchy_;
  h.device = rtcNewDevice(nullptr);
  require(h.device != nullptr, "closest point: Embree cannot be started");
  h.scene = rtcNewScene(h.device);
  const RTCGeometry geometry = rtcNewGeometry(h.device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* positions = static_cast<Vec3f*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vec3f), mesh.positions.size()));
  auto* corners = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), mesh.faceCount()));
  if (!positions || !corners) {
    rtcReleaseGeometry(geometry);
    throw Error(fmt::format("closest point: no memory for {} triangles", mesh.faceCount()));
  }
  for (std::size_t i = 0; i < mesh.positions.size(); ++i)
    positions[i] = Vec3f(h.units.own(mesh.positions[i]));
  std::copy(mesh.corners.begin(), mesh.corners.end(), corners);
  h.positions = positions;
  h.corners = corners;
  h.discs = detail::discsOf(mesh, h.units);
  rtcSetGeometryPointQueryFunction(geometry, Hierarchy::visit);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(h.scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcSetSceneProgressMonitorFunction(
      h.scene, [](void* p, double) { return !static_cast<const Progress*>(p)->cancelled(); },
      const_cast<Progress*>(&progress));
  progress.check();
  rtcCommitScene(h.scene);
  progress.check();
  rtcSetSceneProgressMonitorFunction(h.scene, nullptr, nullptr);
  require(rtcGetDeviceError(h.device) == RTC_ERROR_NONE, "closest point: Embree cannot build its hierarchy");
}

NearestOnMesh::~NearestOnMesh() = default;

std::optional<NearestOnMesh::Hit> NearestOnMesh::nearest(const Vec3f& p, float radius) const {
  const BoxUnits& units = hierarchy_->units;
  const Vec3f local(units.own(Vec3d(p)));
  if (!isFinite(local)) return std::nullopt;
  radius = float(units.own(radius));
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
  return Hit{Vec3f(units.world(Vec3d(local + answer.offset))), float(units.world(std::sqrt(answer.squared))),
             answer.triangle};
}

std::optional<std::vector<std::uint32_t>> NearestOnMesh::trianglesNear(const Vec3f& p, float radius,
                                                                       std::size_t most) const {
  std::vector<std::uint32_t> triangles;
  const BoxUnits& units = hierarchy_->units;
  const Vec3f local(units.own(Vec3d(p)));
  if (!isFinite(local)) return triangles;
  RTCPointQuery query{local.x, local.y, local.z, 0.0f, float(units.own(radius))};
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  Hierarchy::Answer answer{hierarchy_.get(), {}, 0.0f, RTC_INVALID_GEOMETRY_ID, &triangles, most};
  rtcPointQuery(hierarchy_->scene, &query, &context, nullptr, &answer);
  if (triangles.size() > most) return std::nullopt;
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

}  // namespace nephele

// Opaque objects by Embree.
//
// Triangles are kept relative to the middle of their box, so that floats resolve the objects and not their
// place in the world. Rays of shadows see a scene of their own, without what casts none.
//
// Normals are interpolated between vertices, but for corners where the surface turns by more than 40 degrees
// from its vertex: edges stay edges.
//
// Limits: surfaces scatter evenly, and no light from each other.
#include "nephele/render/scene/surfaces.h"

#include <embree3/rtcore.h>
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "nephele/modeling/base/box_units.h"
#include "nephele/modeling/base/error.h"

namespace nephele {

namespace {

const MeshAttribute* textureCoordinates(const Mesh& mesh) {
  for (const MeshAttribute& attribute : mesh.attributes)
    if (attribute.name == "uv" && attribute.domain == MeshAttribute::Domain::corner && attribute.width == 2)
      return &attribute;
  return nullptr;
}

// Sums of the faces around every vertex, weighted by their areas, made one long.
std::vector<Vec3f> vertexNormals(const Mesh& mesh) {
  std::vector<Vec3d> sums(mesh.positions.size());
  for (std::size_t f = 0; f != mesh.faceCount(); ++f) {
    const auto face = mesh.face(f);
    const Vec3d& a = mesh.positions[face[0]];
    const Vec3d normal = cross(mesh.positions[face[1]] - a, mesh.positions[face[2]] - a);
    for (const std::uint32_t corner : face) sums[corner] += normal;
  }
  std::vector<Vec3f> normals;
  for (const Vec3d& sum : sums) normals.push_back(Vec3f(normalize(sum)));
  return normals;
}

double fraction(double x) {
  return x - std::floor(x);
}

// The texture at (u, v), which repeats. Where it is transparent, white shows through: times the colour of the
// object it lies on that.
Vec3f texel(const Image& image, double u, double v) {
  const double x = fraction(u) * image.width - 0.5, y = fraction(1 - v) * image.height - 0.5;
  const double x0 = std::floor(x), y0 = std::floor(y);
  const auto wrapped = [](double place, int count) { return (int(place) % count + count) % count; };
  const int columns[] = {wrapped(x0, image.width), wrapped(x0 + 1, image.width)},
            rows[] = {wrapped(y0, image.height), wrapped(y0 + 1, image.height)};
  const auto valueOf = [&](const Image::Channel& channel) {
    const auto at = [&](int row, int column) {
      return double(channel.values[std::size_t(rows[row]) * image.width + columns[column]]);
    };
    const double top = at(0, 0) + (at(0, 1) - at(0, 0)) * (x - x0),
                 bottom = at(1, 0) + (at(1, 1) - at(1, 0)) * (x - x0);
    return float(top + (bottom - top) * (y - y0));
  };
  const Image::Channel* opacity = image.find("A");
  const float beside = opacity ? std::clamp(1 - valueOf(*opacity), 0.0f, 1.0f) : 0.0f;
  return Vec3f{valueOf(image.channel("R")), valueOf(image.channel("G")), valueOf(image.channel("B"))} +
         Vec3f{1, 1, 1} * beside;
}

std::size_t meshBytes(const Mesh& mesh) {
  std::size_t bytes = mesh.positions.size() * sizeof(Vec3d) +
                      (mesh.corners.size() + mesh.faceStart.size()) * sizeof(std::uint32_t);
  for (const MeshAttribute& attribute : mesh.attributes) bytes += attribute.values.size() * sizeof(float);
  return bytes;
}

}  // namespace

struct Surfaces::Scene {
  // What Embree holds; in front of what frees it.
  std::atomic<std::ptrdiff_t> bytes{0};
  RTCDevice device = nullptr;
  RTCScene seen = nullptr, shading = nullptr;
  BoxUnits units;
  /// Per object and vertex.
  std::vector<std::vector<Vec3f>> normals;

  ~Scene() {
    if (seen) rtcReleaseScene(seen);
    if (shading) rtcReleaseScene(shading);
    if (device) rtcReleaseDevice(device);
  }

  // Embree's form of a ray; false where it begins farther away than Embree can tell, and meets nothing.
  template <class EmbreeRay>
  [[nodiscard]] bool set(EmbreeRay& out, const Ray& ray, double distance) const {
    constexpr float kFarthest = 1e18f;
    const Vec3f origin(units.own(ray.origin)), direction(ray.direction);
    for (int axis = 0; axis != 3; ++axis)
      if (!(std::abs(origin[axis]) < kFarthest)) return false;
    out.org_x = origin.x, out.org_y = origin.y, out.org_z = origin.z;
    out.dir_x = direction.x, out.dir_y = direction.y, out.dir_z = direction.z;
    out.tnear = 0;
    out.tfar = float(units.own(distance));
    out.time = 0;
    out.mask = ~0u;
    out.id = out.flags = 0;
    return true;
  }
};

Surfaces::Surfaces(std::vector<SurfaceObject> objects, const Progress& progress)
    : scene_(std::make_unique<Scene>()), objects_(std::move(objects)) {
  for (std::size_t i = 0; i != objects_.size(); ++i) {
    SurfaceObject& object = objects_[i];
    progress.check();
    object.mesh = triangulated(object.mesh);
    const std::string name = fmt::format("object {}", i + 1);
    require(object.mesh.faceCount() > 0, name + ": the mesh has no faces");
    progress.check();
    const Box box = boundingBox(object.mesh);
    for (const Vec3d& p : object.mesh.positions)
      require(isFinite(p), name + ": the mesh has positions that are not finite");
    require((object.checkers == 0 && !object.texture) || textureCoordinates(object.mesh),
            name + ": a checker or texture needs texture coordinates, and the mesh has none");
    if (object.texture)
      for (const char* channel : {"R", "G", "B"}) object.texture->channel(channel);
    for (int axis = 0; axis != 3; ++axis) {
      box_.min[axis] = i == 0 ? box.min[axis] : std::min(box_.min[axis], box.min[axis]);
      box_.max[axis] = i == 0 ? box.max[axis] : std::max(box_.max[axis], box.max[axis]);
    }
    if (object.castsShadows) shadeBox_ = shadeBox_.including(box);
  }
  Scene& scene = *scene_;
  scene.units = BoxUnits(box_);
  clearance_ = 1e-5 * double(std::max(shadeBox_.longestSide(), 1e-30f));
  scene.device = rtcNewDevice(nullptr);
  require(scene.device != nullptr, "objects: Embree cannot be started");
  rtcSetDeviceMemoryMonitorFunction(
      scene.device,
      [](void* counter, ssize_t bytes, bool) {
        *static_cast<std::atomic<std::ptrdiff_t>*>(counter) += bytes;
        return true;
      },
      &scene.bytes);
  scene.seen = rtcNewScene(scene.device);
  scene.shading = rtcNewScene(scene.device);
  rtcSetSceneFlags(scene.seen, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneFlags(scene.shading, RTC_SCENE_FLAG_ROBUST);
  for (std::size_t i = 0; i != objects_.size(); ++i) {
    const SurfaceObject& object = objects_[i];
    progress.check();
    scene.normals.push_back(vertexNormals(object.mesh));
    progress.check();
    const RTCGeometry geometry = rtcNewGeometry(scene.device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* positions = static_cast<Vec3f*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vec3f), object.mesh.positions.size()));
    auto* corners = static_cast<std::uint32_t*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof(std::uint32_t), object.mesh.faceCount()));
    if (!positions || !corners) {
      rtcReleaseGeometry(geometry);
      throw Error(fmt::format("objects: no memory for {} triangles", object.mesh.faceCount()));
    }
    for (std::size_t p = 0; p != object.mesh.positions.size(); ++p)
      positions[p] = Vec3f(scene.units.own(object.mesh.positions[p]));
    std::copy(object.mesh.corners.begin(), object.mesh.corners.end(), corners);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene.seen, geometry, unsigned(i));
    if (object.castsShadows) {
      rtcAttachGeometryByID(scene.shading, geometry, unsigned(i));
      castsShadows_ = true;
    }
    rtcReleaseGeometry(geometry);
  }
  for (const RTCScene built : {scene.seen, scene.shading}) {
    rtcSetSceneProgressMonitorFunction(
        built, [](void* p, double) { return !static_cast<const Progress*>(p)->cancelled(); },
        const_cast<Progress*>(&progress));
    progress.check();
    rtcCommitScene(built);
    progress.check();
    rtcSetSceneProgressMonitorFunction(built, nullptr, nullptr);
  }
}

Surfaces::~Surfaces() = default;

std::optional<Surfaces::Hit> Surfaces::hit(const Ray& ray) const {
  RTCRayHit query{};
  if (!scene_->set(query.ray, ray, std::numeric_limits<double>::infinity())) return std::nullopt;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene_->seen, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  const SurfaceObject& object = objects_[query.hit.geomID];
  Hit result;
  result.distance = scene_->units.world(query.ray.tfar);
  result.normal = normalize(Vec3f{query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z});
  const float b = query.hit.u, c = query.hit.v, a = 1 - b - c;
  const Vec3f flat = result.normal;
  const auto cornerNormal = [&](std::size_t corner) {
    const Vec3f& smooth =
        scene_->normals[query.hit.geomID][object.mesh.corners[3 * std::size_t(query.hit.primID) + corner]];
    return dot(smooth, flat) > 0.766f ? smooth : flat;
  };
  result.normal = normalize(cornerNormal(0) * a + cornerNormal(1) * b + cornerNormal(2) * c);
  result.faceNormal = flat;
  if (dot(Vec3d(flat), ray.direction) > 0) {
    result.normal = -result.normal;
    result.faceNormal = -flat;
  }
  result.isHoldout = object.isHoldout;
  result.colour = object.colour;
  if (object.checkers == 0 && !object.texture) return result;

  const float* uv = textureCoordinates(object.mesh)->values.data() + 6 * std::size_t(query.hit.primID);
  const double u = a * uv[0] + b * uv[2] + c * uv[4], v = a * uv[1] + b * uv[3] + c * uv[5];
  if (!std::isfinite(u) || !std::isfinite(v)) return result;
  if (object.texture) result.colour = result.colour * texel(*object.texture, u, v);
  const int fields = object.checkers;
  if (fields > 0 && (int(fraction(u) * fields) + int(fraction(v) * fields)) % 2 == 1)
    result.colour = result.colour * 0.25f;
  return result;
}

bool Surfaces::occluded(const Ray& ray, double distance) const {
  if (!castsShadows_) return false;
  RTCRay query{};
  if (!scene_->set(query, ray, distance)) return false;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene_->shading, &context, &query);
  return query.tfar < 0;
}

double Surfaces::distanceToShade(const Ray& ray) const {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  if (!castsShadows_) return infinite;
  RTCRayHit query{};
  if (!scene_->set(query.ray, ray, infinite)) return infinite;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene_->shading, &context, &query);
  return query.hit.geomID == RTC_INVALID_GEOMETRY_ID ? infinite : scene_->units.world(query.ray.tfar);
}

std::size_t Surfaces::memoryBytes() const {
  std::size_t bytes = std::size_t(std::max<std::ptrdiff_t>(scene_->bytes, 0));
  std::vector<const Image*> textures;
  for (const SurfaceObject& object : objects_) {
    bytes += meshBytes(object.mesh);
    if (object.texture && std::ranges::count(textures, object.texture.get()) == 0)
      textures.push_back(object.texture.get());
  }
  for (const std::vector<Vec3f>& normals : scene_->normals) bytes += normals.size() * sizeof(Vec3f);
  for (const Image* texture : textures)
    for (const Image::Channel& channel : texture->channels) bytes += channel.values.size() * sizeof(float);
  return bytes;
}

double Surfaces::estimateBytes(const Mesh& mesh) {
  requireValid(mesh);
  // Embree's two trees while they are built, and their triangles.
  constexpr double perTriangle = 400;
  const double triangles = double(mesh.corners.size()) - 2 * double(mesh.faceCount());
  return double(meshBytes(mesh)) + double(mesh.positions.size()) * 2 * sizeof(Vec3f) +
         std::max(triangles, 0.0) * (perTriangle + 4 * sizeof(std::uint32_t));
}

}  // namespace nephele

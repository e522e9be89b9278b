// Two shapes side by side: each is turned so that the camera, which looks straight ahead, sees it from the
// side asked for, made one unit long, and put on the ground.
#include "nephele/render/preview/transfer_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "nephele/modeling/base/error.h"
#include "nephele/render/preview/surface_picture.h"

namespace nephele {

namespace {

struct Bounds {
  Vec3d low, high;
};

Bounds boundsOf(const Mesh& mesh) {
  Bounds box{mesh.positions[mesh.corners[0]], mesh.positions[mesh.corners[0]]};
  for (const std::uint32_t v : mesh.corners) {
    box.low = min(box.low, mesh.positions[v]);
    box.high = max(box.high, mesh.positions[v]);
  }
  return box;
}

/// `mesh` turned, of unit size, on the ground, with `left` as the left end of it.
SurfaceObject placed(const Mesh& mesh, const TransferPictureOptions& options, double& left) {
  requireValid(mesh);
  require(mesh.faceCount() > 0, "picture of a transfer: a mesh has no faces");
  SurfaceObject object{.mesh = mesh};
  const double a = -double(options.azimuthDegrees) * M_PI / 180;
  const Bounds first = boundsOf(mesh);
  const Vec3d centre = (first.low + first.high) * 0.5, size = first.high - first.low;
  const double scale = 1 / std::max({size.x, size.y, size.z, 1e-300});
  for (Vec3d& p : object.mesh.positions) {
    const Vec3d q = (p - centre) * scale;
    p = {q.x * std::cos(a) + q.z * std::sin(a), q.y, q.z * std::cos(a) - q.x * std::sin(a)};
  }
  const Bounds box = boundsOf(object.mesh);
  for (Vec3d& p : object.mesh.positions) p += Vec3d{left - box.low.x, -box.low.y, 0};
  left += box.high.x - box.low.x;
  return object;
}

constexpr double kGap = 0.18;

Image picture(std::vector<SurfaceObject> objects, const TransferPictureOptions& options,
              const Progress& progress) {
  return pictureSurfaces(std::move(objects),
                         {.width = options.width,
                          .height = options.height,
                          .elevationDegrees = options.elevationDegrees,
                          .samples = options.samples},
                         progress);
}

/// Colours from kept over stretched to wrong, side by side.
Image paintBox() {
  constexpr Vec3f kGrey{0.5f, 0.54f, 0.56f}, kYellow{0.85f, 0.6f, 0.1f}, kRed{0.7f, 0.05f, 0.03f},
      kViolet{0.16f, 0.01f, 0.3f};
  Image image;
  image.width = 256;
  image.height = 1;
  std::array<std::vector<float>*, 3> channels{};
  for (const char* name : {"R", "G", "B"}) image.add(name, false);
  for (std::size_t c = 0; c != 3; ++c) channels[c] = &image.channels[c].values;
  for (int x = 0; x != image.width; ++x) {
    const float u = (float(x) + 0.5f) / float(image.width);
    const auto mix = [](const Vec3f& a, const Vec3f& b, float share) {
      return a + (b - a) * std::clamp(share, 0.0f, 1.0f);
    };
    const Vec3f colour = u > 0.85f   ? kViolet
                         : u > 0.35f ? mix(kYellow, kRed, (u - 0.35f) / 0.3f)
                                     : mix(kGrey, kYellow, (u - 0.05f) / 0.3f);
    for (int c = 0; c != 3; ++c) (*channels[std::size_t(c)])[std::size_t(x)] = colour[c];
  }
  return image;
}

/// Triangles with a place in the box of colours each.
Mesh painted(const Mesh& mesh, std::size_t count, const std::function<float(std::size_t)>& placeOf) {
  Mesh result = triangulated(requireValid(mesh));
  require(result.faceCount() == count, "picture of a transfer: the quality is that of other meshes");
  result.attributes = {{"uv", MeshAttribute::Domain::corner, 2, {}}};
  for (std::size_t t = 0; t != count; ++t)
    for (int corner = 0; corner != 3; ++corner)
      for (const float value : {placeOf(t), 0.5f}) result.attributes[0].values.push_back(value);
  return result;
}

/// Side by side, first the reference; both meshes have what they are painted by on their texture coordinates.
std::vector<SurfaceObject> sideBySide(const Mesh& reference, const Mesh& object,
                                      const TransferPictureOptions& options) {
  double left = 0;
  std::vector<SurfaceObject> objects;
  objects.push_back(placed(reference, options, left));
  left += kGap;
  objects.push_back(placed(object, options, left));
  return objects;
}

std::vector<SurfaceObject> transferRow(const Mesh& reference, const Mesh& object,
                                       const std::shared_ptr<const Image>& texture,
                                       const std::shared_ptr<const Image>& objectTexture,
                                       const TransferPictureOptions& options) {
  constexpr Vec3f kCanvas{0.92f, 0.92f, 0.92f}, kBoard{0.82f, 0.52f, 0.24f};
  std::vector<SurfaceObject> objects = sideBySide(reference, object, options);
  objects[0].texture = texture;
  objects[1].texture = objectTexture ? objectTexture : texture;
  for (SurfaceObject& o : objects) {
    o.colour = o.texture ? kCanvas : kBoard;
    o.checkers = o.texture ? 0 : options.checkers;
  }
  return objects;
}

std::vector<SurfaceObject> distortionRow(const Mesh& reference, const Mesh& object,
                                         const TransferQuality& quality,
                                         const TransferPictureOptions& options) {
  const auto paint = std::make_shared<const Image>(paintBox());
  // Where a triangle's colour stands in the box.
  constexpr float kKept = 0.02f, kBad = 0.7f, kWrong = 0.95f;
  const auto ofReference = [&](std::size_t t) { return quality.isCovered[t] ? kKept : kWrong; };
  const auto ofObject = [&](std::size_t t) {
    const float stretch = quality.stretch[t];
    if (std::isinf(stretch)) return kWrong;
    const float share = std::log(std::max(stretch, 1.0f)) / std::log(TransferQuality::kBadStretch);
    return kKept + (kBad - kKept) * std::min(share, 1.0f);
  };
  std::vector<SurfaceObject> objects = sideBySide(painted(reference, quality.isCovered.size(), ofReference),
                                                  painted(object, quality.stretch.size(), ofObject), options);
  for (SurfaceObject& o : objects) {
    o.texture = paint;
    o.colour = {1, 1, 1};
  }
  return objects;
}

/// Turns a row that stands across the view of azimuth 0 so that it stands across that of `azimuthDegrees`,
/// and the shapes in it as they were.
std::vector<SurfaceObject> turnedBack(std::vector<SurfaceObject> objects, float azimuthDegrees) {
  const double a = double(azimuthDegrees) * M_PI / 180;
  const double middle = boundsOf(objects[1].mesh).low.x - kGap / 2;
  for (SurfaceObject& object : objects)
    for (Vec3d& p : object.mesh.positions) {
      const double x = p.x - middle;
      p = {x * std::cos(a) + p.z * std::sin(a), p.y, p.z * std::cos(a) - x * std::sin(a)};
    }
  return objects;
}

}  // namespace

Image pictureTransfer(const Mesh& reference, const Mesh& object, std::shared_ptr<const Image> texture,
                      std::shared_ptr<const Image> objectTexture, const TransferPictureOptions& options,
                      const Progress& progress) {
  return picture(transferRow(reference, object, texture, objectTexture, options), options, progress);
}

Image pictureDistortion(const Mesh& reference, const Mesh& object, const TransferQuality& quality,
                        const TransferPictureOptions& options, const Progress& progress) {
  return picture(distortionRow(reference, object, quality, options), options, progress);
}

std::vector<SurfaceObject> transferObjects(const Mesh& reference, const Mesh& object,
                                           std::shared_ptr<const Image> texture,
                                           std::shared_ptr<const Image> objectTexture,
                                           const TransferPictureOptions& options) {
  return turnedBack(transferRow(reference, object, texture, objectTexture, options), options.azimuthDegrees);
}

std::vector<SurfaceObject> distortionObjects(const Mesh& reference, const Mesh& object,
                                             const TransferQuality& quality,
                                             const TransferPictureOptions& options) {
  return turnedBack(distortionRow(reference, object, quality, options), options.azimuthDegrees);
}

}  // namespace nephele

// Two shapes side by side: each is turned so that the camera, which looks straight ahead, sees it from the
// side asked for, made one unit long, and put on the ground.
#include "nephele/render/preview/transfer_picture.h"

#include <algorithm>
#include <cmath>

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

}  // namespace

Image pictureTransfer(const Mesh& reference, const Mesh& object, std::shared_ptr<const Image> texture,
                      std::shared_ptr<const Image> objectTexture, const TransferPictureOptions& options,
                      const Progress& progress) {
  constexpr double kGap = 0.18;
  constexpr Vec3f kCanvas{0.92f, 0.92f, 0.92f}, kBoard{0.82f, 0.52f, 0.24f};
  double left = 0;
  std::vector<SurfaceObject> objects;
  objects.push_back(placed(reference, options, left));
  left += kGap;
  objects.push_back(placed(object, options, left));
  objects[0].texture = texture;
  objects[1].texture = objectTexture ? objectTexture : texture;
  for (SurfaceObject& o : objects) {
    o.colour = o.texture ? kCanvas : kBoard;
    o.checkers = o.texture ? 0 : options.checkers;
  }
  return pictureSurfaces(std::move(objects),
                         {.width = options.width,
                          .height = options.height,
                          .elevationDegrees = options.elevationDegrees,
                          .samples = options.samples},
                         progress);
}

}  // namespace nephele

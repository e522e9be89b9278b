#include "apps/look/picture.h"

#include "nephele/render/preview/surface_picture.h"

namespace nephele::apps {
namespace {

Extent extentOf(const std::vector<SurfaceObject>& objects) {
  Extent extent;
  for (const SurfaceObject& object : objects) {
    std::vector<bool> isUsed(object.mesh.positions.size());
    for (const std::uint32_t v : object.mesh.corners) isUsed[v] = true;
    for (std::size_t v = 0; v != isUsed.size(); ++v)
      if (isUsed[v]) extent.outline.emplace_back(object.mesh.positions[v]);
  }
  for (const Vec3f& p : extent.outline) extent.box = extent.box.including(p);
  extent.longestSide = double(extent.box.longestSide());
  return extent;
}

}  // namespace

LookSurfaces::LookSurfaces(std::vector<SurfaceObject> objects)
    : extent(extentOf(objects)), surfaces(std::move(objects)) {}

double secondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

PictureOptions optionsOfSurfaces(const LookPlan& plan, const LookFrame& frame) {
  PictureOptions options = plan.picture.withView(ViewCurve::standard);
  options.frame.width = frame.width;
  options.frame.height = frame.height;
  return options;
}

LookPicture pictureOf(const LookSurfaces& shown, PictureOptions options, const LookFrame& frame, Run& run) {
  const int samples = frame.samples == 1 ? 2 : 8;
  static_cast<CameraOptions&>(options) = options.placed(shown.extent, run);
  const Camera camera = options.camera();
  run.requireMemory(estimateSurfacePictureBytes(frame.width, frame.height), "make the picture smaller");
  run.begin("picture");
  const auto start = std::chrono::steady_clock::now();
  auto image = std::make_shared<const Image>(pictureSurfaces(shown.surfaces, camera, samples, run));
  return {image,
          camera,
          options,
          shown.extent.box,
          std::uint64_t(frame.width) * frame.height * samples,
          0,
          secondsSince(start)};
}

}  // namespace nephele::apps

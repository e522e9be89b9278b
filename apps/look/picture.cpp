#include "apps/look/picture.h"

#include <array>
#include <optional>

#include "nephele/render/preview/surface_picture.h"

namespace nephele::apps {
namespace {

/// Of many points those that a camera frames, but for less than half a percent: of columns along each axis,
/// 64 by 64 of them, the first and the last.
std::vector<Vec3f> outermost(const std::vector<Vec3f>& points, const Box& box) {
  constexpr std::size_t kColumns = 64;
  std::vector<bool> isKept(points.size());
  for (int axis = 0; axis != 3; ++axis) {
    std::vector<std::array<std::optional<std::size_t>, 2>> ends(kColumns * kColumns);
    const auto column = [&](const Vec3f& p, int across) {
      const float size = box.max[across] - box.min[across];
      const float place = size > 0 ? (p[across] - box.min[across]) / size : 0.0f;
      return std::min(std::size_t(place * float(kColumns)), kColumns - 1);
    };
    for (std::size_t i = 0; i != points.size(); ++i) {
      auto& [first, last] =
          ends[column(points[i], (axis + 1) % 3) * kColumns + column(points[i], (axis + 2) % 3)];
      if (!first || points[i][axis] < points[*first][axis]) first = i;
      if (!last || points[i][axis] > points[*last][axis]) last = i;
    }
    for (const auto& both : ends)
      for (const std::optional<std::size_t>& end : both)
        if (end) isKept[*end] = true;
  }
  std::vector<Vec3f> result;
  for (std::size_t i = 0; i != points.size(); ++i)
    if (isKept[i]) result.push_back(points[i]);
  return result;
}

Extent extentOf(const std::vector<SurfaceObject>& objects) {
  Extent extent;
  for (const SurfaceObject& object : objects) {
    std::vector<bool> isUsed(object.mesh.positions.size());
    for (const std::uint32_t v : object.mesh.corners) isUsed[v] = true;
    for (std::size_t v = 0; v != isUsed.size(); ++v)
      if (isUsed[v]) extent.outline.emplace_back(object.mesh.positions[v]);
  }
  for (const Vec3f& p : extent.outline) extent.box = extent.box.including(p);
  constexpr std::size_t kMany = 30000;
  if (extent.outline.size() > kMany) extent.outline = outermost(extent.outline, extent.box);
  extent.longestSide = double(extent.box.longestSide());
  return extent;
}

}  // namespace

LookSurfaces::LookSurfaces(std::vector<SurfaceObject> objects, const Progress& progress)
    : extent(extentOf(objects)), surfaces(std::move(objects), progress) {}

double secondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

PictureOptions optionsOfSurfaces(const LookPlan& plan, const LookFrame& frame) {
  PictureOptions options = plan.picture.withView(ViewCurve::standard);
  options.frame.width = frame.width;
  options.frame.height = frame.height;
  return options;
}

LookPicture pictureOf(const LookSurfaces& shown, PictureOptions options, const LookFrame& frame,
                      LookPace& pace, Run& run) {
  const bool isQuick = frame.samples == 1;
  const int samples = isQuick ? 2 : 8;
  const auto start = std::chrono::steady_clock::now();
  static_cast<CameraOptions&>(options) = options.placed(shown.extent, run);
  const Camera camera = options.camera();
  run.requireMemory(estimateSurfacePictureBytes(frame.width, frame.height), "make the picture smaller");
  run.begin("picture");
  auto image = std::make_shared<const Image>(pictureSurfaces(shown.surfaces, camera, samples, run));
  const double pixels = double(frame.width) * frame.height;
  if (isQuick) pace.learn(pixels, secondsSince(start));
  return {image, camera, options, shown.extent.box, std::uint64_t(pixels) * std::uint64_t(samples), 0};
}

}  // namespace nephele::apps

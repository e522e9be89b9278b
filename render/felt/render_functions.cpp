#include "nephele/render/felt/render_functions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "nephele/levelset/felt/domain_samples.h"
#include "nephele/levelset/felt/field_extent.h"
#include "nephele/levelset/felt/written_file.h"
#include "nephele/modeling/felt/argument.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/image/png_io.h"
#include "nephele/render/march/raymarch.h"
#include "nephele/render/volume/field_volume.h"

namespace nephele::felt {

namespace {

using S = ScalarField;
using V = VectorField;

/// The share of the memory allowed that the samples may take; the light takes as much again.
constexpr double kMemoryShare = 0.25, kMostBytes = 4e9;
constexpr int kMostPixels = 16384;

Camera cameraOf(const Vec3d& camera, const Vec3d& lookat, double fov, std::int64_t width,
                std::int64_t height) {
  if (!(fov >= 0.01 && fov <= 179))
    throw CallError(Code::outOfRange, fmt::format("fov is {:g}, and may be from 0.01 to 179 degrees", fov));
  Camera::Frame frame{.width = inRange("width", width, 1, kMostPixels),
                      .height = inRange("height", height, 1, kMostPixels),
                      .fovDegrees = float(fov)};
  const Vec3f from = finite("camera", camera), to = finite("lookat", lookat);
  const Vec3f way = to - from;
  // Straight up or down the picture's top is where -z is.
  const bool isUpright = std::max(std::abs(way.x), std::abs(way.z)) <= 1e-4f * std::abs(way.y);
  return Camera::lookingAt(from, to, isUpright ? Vec3f{0, 0, -1} : Vec3f{0, 1, 0}, frame);
}

Lights lightsOf(const Vec3d& sun, const Vec3d& sky) {
  Lights lights;
  lights.sky = finite("sky", sky);
  const Vec3f said = finite("sun", sun);
  if (!(said.y >= -90 && said.y <= 90 && said.z >= 0))
    throw CallError(
        Code::outOfRange,
        fmt::format("sun is ({:g}, {:g}, {:g}), an azimuth, an elevation from -90 to 90 degrees, and "
                    "an irradiance of at least 0",
                    sun.x, sun.y, sun.z));
  if (said.z > 0)
    lights.suns.push_back(
        {.direction = directionTowards(said.x, said.y), .irradiance = Vec3f{1, 1, 1} * said.z});
  lights.check();
  return lights;
}

/// Whether a field is one number everywhere in the box.
bool isOnly(const V& field, float number, const Box& box) {
  for (int c = 0; c < 3; ++c) {
    const Interval range = component(field, c).range(box);
    if (!(range.isPoint() && range.min == number)) return false;
  }
  return true;
}

/// The file that a picture goes into, of which is known that it can be written.
struct PictureFile {
  PictureFile(const Context& context, const std::string& path_)
      : path(path_), isForScreens(requireWritable(context, path, {".exr", ".png"}) == ".png") {}

  void write(const Image& image, const Camera& camera, const Vec3f& sky) const {
    const std::map<std::string, std::string> metadata{{"creator", "nephele"}};
    if (isForScreens)
      writePng(path, image, {.background = sky, .curve = ViewCurve::filmic}, metadata);
    else
      writeExr(path, image, camera, metadata);
  }

  std::string path;
  bool isForScreens;
};

void render(Context& context, const PictureFile& file, const S& density, const Box& box, const Camera& camera,
            double extinction, const V& color, const V& emission, const Lights& lights,
            std::int64_t samples) {
  if (!(extinction >= 0 && extinction <= 1e9))
    throw CallError(Code::outOfRange,
                    fmt::format("extinction is {:g}, and may be from 0 to 1e9", extinction));
  RenderOptions options;
  options.samples = inRange("samples", samples, 1, 1024);
  FieldParts parts{.density = density, .box = box};
  if (!isOnly(color, 1, box)) parts.colour = color;
  if (!isOnly(emission, 0, box)) parts.emission = emission;

  FieldVolumeOptions looked{.box = box,
                            .mostBytes = std::min(kMostBytes, kMemoryShare * allowedBytes(context))};
  if (parts.colour || parts.emission) looked.mostBytes /= 4;
  const Progress& progress = *context.progress;
  const RenderVolume volume =
      sampledVolume(parts, fieldVoxelSize(density, camera, looked, progress), progress);
  Medium medium;
  medium.extinction = extinction > 0 ? float(extinction) : defaultExtinction(volume);
  requireBytes(double(volume.memoryBytes()) + estimateRenderBytes(volume, lights, camera, options),
               "the picture", "make it smaller", context);
  const RenderResult result = renderImage(volume, medium, lights, camera, options, progress);
  file.write(result.image, camera, lights.sky);
}

}  // namespace

void addRenderFunctions(Registry& r) {
  const std::string what =
      "Makes a picture of a density, .exr or .png, as the verb `render` does, in a sky of one radiance. It "
      "is sampled as finely as the camera sees it. `camera` is where the camera stands, `fov` its horizontal "
      "angle of view in degrees; `extinction` is per world unit, 0 stands for one that suits; `color` "
      "multiplies the albedo, 0 to 1; `emission` glows; `sun` has azimuth, elevation and irradiance.";
  const std::string others =
      "vector camera, vector lookat, float fov = 35, int width = 640, int height = 360, "
      "float extinction = 0, vectorfield color = (1,1,1), vectorfield emission = (0,0,0), "
      "vector sun = (90,38,3.6), vector sky = (0.1,0.17,0.28), int samples = 4)";
  r.group("pictures");
  r.add("void render(string path, scalarfield density, " + others, what,
        "scalarfield ball = mask(sphere((0,0,0), 1), 0.2);\n"
        "render(\"ball.png\", ball, (0,0,5), (0,0,0), width = 32, height = 18, color = (1,0.5,0.2));",
        [](Context& context, const std::string& path, const S& density, const Vec3d& camera,
           const Vec3d& lookat, double fov, std::int64_t width, std::int64_t height, double extinction,
           const V& color, const V& emission, const Vec3d& sun, const Vec3d& sky, std::int64_t samples) {
          const PictureFile file(context, path);
          render(context, file, density, extentOf(density, *context.progress),
                 cameraOf(camera, lookat, fov, width, height), extinction, color, emission,
                 lightsOf(sun, sky), samples);
        });
  r.add(
      "void render(string path, scalarfield density, domain box, " + others,
      what + " What is outside of `box` is not seen: for fields that end nowhere.",
      "domain box = domain((-1,-1,-1), (2,2,2), 0.1);\n"
      "render(\"fog.exr\", 0.2 + 0.1 * perlin(2), box, (0,0,5), (0,0,0), width = 32, height = 18);",
      [](Context& context, const std::string& path, const S& density, const Domain& box, const Vec3d& camera,
         const Vec3d& lookat, double fov, std::int64_t width, std::int64_t height, double extinction,
         const V& color, const V& emission, const Vec3d& sun, const Vec3d& sky, std::int64_t samples) {
        const PictureFile file(context, path);
        requireValid(box);
        render(context, file, density, box.bounds(), cameraOf(camera, lookat, fov, width, height), extinction,
               color, emission, lightsOf(sun, sky), samples);
      });
}

}  // namespace nephele::felt

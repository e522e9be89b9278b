// Pictures by random paths: tiles of pixels in parallel, and the layers beside the light.
//
// Limits: suns that shine through a narrow forward peak make noise that falls slowly, since they are points
// and no direction but the exact one finds them.
#include "nephele/render/march/path_trace.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/render/march/detail/path_tracer.h"

namespace nephele {

namespace {

constexpr int kTile = 8;
float largest(const Vec3f& v) {
  return std::max({v.x, v.y, v.z});
}

void check(const Medium& medium, const Lights& lights, const PathOptions& options) {
  require(options.samplesPerPixel >= 1 && options.samplesPerPixel <= 1 << 20,
          fmt::format("spp: expected 1 to {}, got {}", 1 << 20, options.samplesPerPixel));
  require(options.maxScatterings >= 0,
          fmt::format("scatterings: expected 0 (no limit) or more, got {}", options.maxScatterings));
  medium.check();
  lights.check();
  bool deep = lights.deepTolerance.has_value();
  for (const DistantLight& sun : lights.suns) deep = deep || sun.deepShadow;
  for (const LocalLight& light : lights.locals) deep = deep || light.deepShadow;
  require(!deep, "path tracing: deep shadow maps can only be marched");
}

// Adds the layers of `aovs` to `image`; all that is no light comes from a march without light.
void addLayers(Image& image, const RenderVolume& volume, const Medium& medium, const Lights& lights,
               const Camera& camera, const PathOptions& pathOptions) {
  const auto add = [&](const std::string& name) -> Image::Channel& {
    require(!image.find(name), fmt::format("aov: {} is named twice", name));
    return image.add(name, false);
  };
  for (const std::string& layer : pathOptions.aovs) {
    if (layer == "transmittance") {
      for (const char* c : {"R", "G", "B"}) add(std::string("transmittance.") + c);
    } else if (layer == "light") {
      for (const std::string& name : lights.names())
        for (const char* c : {".R", ".G", ".B"}) add("light_" + name + c);
    } else {
      RenderOptions options;
      options.octaves.count = 1;
      options.shutter = pathOptions.shutter;
      options.volumeMotion = pathOptions.volumeMotion;
      options.nextCamera = pathOptions.nextCamera;
      options.aovs = {layer};
      Image marched = renderImage(volume, medium, {}, camera, options).image;
      for (std::size_t i = 4; i != marched.channels.size(); ++i)
        add(marched.channels[i].name).values = std::move(marched.channels[i].values);
    }
  }
}

}  // namespace

RenderResult pathTraceImage(const RenderVolume& volume, const Medium& medium, const Lights& lights,
                            const Camera& camera, const PathOptions& options, const Progress& progress) {
  check(medium, lights, options);
  require(!volume.field(), "path tracing: needs a density that is a grid; fieldVolume makes one of a field");
  RenderResult result;
  Image& image = result.image;
  const PixelBox window = camera.window();
  image.setWindow(window, camera.width(), camera.height());
  const int width = image.width, height = image.height;
  for (const char* name : {"R", "G", "B", "A"}) image.add(name);
  addLayers(image, volume, medium, lights, camera, options);
  result.rays = std::uint64_t(width) * std::uint64_t(height) * std::uint64_t(options.samplesPerPixel);
  const auto indexOf = [&](const std::string& name) {
    const auto at = std::find_if(image.channels.begin(), image.channels.end(),
                                 [&](const Image::Channel& channel) { return channel.name == name; });
    return at - image.channels.begin();
  };
  const auto end = std::ptrdiff_t(image.channels.size());
  const auto through = indexOf("transmittance.R"), first = indexOf("light_" + lights.names()[0] + ".R");
  if (through != end)
    for (int c = 0; c != 3; ++c)
      std::fill_n(image.channels[std::size_t(through + c)].values.begin(), std::size_t(width) * height, 1.0f);
  if (volume.isEmpty() || medium.extinction * largest(medium.extinctionColour) == 0) return result;

  const auto start = std::chrono::steady_clock::now();
  progress.begin("trace");
  const detail::PathTracer tracer(volume, medium, lights, camera, options);
  const int across = (width + kTile - 1) / kTile, down = (height + kTile - 1) / kTile;
  const double share = 1.0 / options.samplesPerPixel;
  std::atomic<std::uint64_t> scatterings{0};
  parallelFor(
      std::size_t(across) * down, 1,
      [&](std::size_t begin, std::size_t tileEnd) {
        detail::PathSums sums;
        for (std::size_t tile = begin; tile != tileEnd; ++tile) {
          const int x0 = int(tile % std::size_t(across)) * kTile,
                    y0 = int(tile / std::size_t(across)) * kTile;
          for (int y = y0; y < std::min(y0 + kTile, height); ++y)
            for (int x = x0; x < std::min(x0 + kTile, width); ++x) {
              progress.check();
              sums = {sums.scatterings, {}, {}, std::vector<Vec3d>(lights.names().size())};
              tracer.pixel(window.x0 + x, window.y0 + y, sums);
              const std::size_t at = std::size_t(y) * std::size_t(width) + std::size_t(x);
              const auto set = [&](std::ptrdiff_t channel, double value) {
                image.channels[std::size_t(channel)].values[at] = float(value * share);
              };
              set(3, (sums.opacity.x + sums.opacity.y + sums.opacity.z) / 3);
              for (int c = 0; c != 3; ++c) {
                double total = sums.emission[c];
                for (const Vec3d& light : sums.light) total += light[c];
                set(c, total);
                if (through != end) set(through + c, double(options.samplesPerPixel) - sums.opacity[c]);
                for (std::size_t i = 0; first != end && i != sums.light.size(); ++i)
                  set(first + std::ptrdiff_t(3 * i) + c, sums.light[i][c]);
              }
            }
        }
        scatterings += sums.scatterings;
      },
      progress);
  result.samples = scatterings;
  progress.count("rays", double(result.rays));
  progress.count("samples", double(result.samples));
  result.marchSeconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace nephele

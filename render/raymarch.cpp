// From volumes, lights and a camera to a picture: light first (baked_light), then tiles of the picture in
// parallel (picture).
#include "render/raymarch.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>

#include "modeling/error.h"
#include "modeling/parallel.h"
#include "render/film.h"
#include "render/light_volume.h"
#include "render/picture.h"
#include "render/projected_light_volume.h"
#include "render/scattered_light.h"

namespace nephele {

namespace {

constexpr int kTile = 16;

double secondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void check(const Medium& medium, const Lights& lights, const Octaves& octaves) {
  require(std::isfinite(medium.extinction) && medium.extinction >= 0,
          fmt::format("extinction: expected a finite number >= 0, got {}", medium.extinction));
  for (int c = 0; c != 3; ++c) {
    require(medium.albedo[c] >= 0 && medium.albedo[c] <= 1,
            fmt::format("albedo: expected three numbers within [0, 1], got {}", medium.albedo[c]));
  }
  for (int c = 0; c != 3; ++c)
    require(std::isfinite(medium.extinctionColour[c]) && medium.extinctionColour[c] >= 0,
            fmt::format("extinction colour: expected three finite numbers >= 0, got {}",
                        medium.extinctionColour[c]));
  lights.check();
  require(octaves.count >= 1 && octaves.count <= MarchScene::kMostOctaves,
          fmt::format("octaves: expected 1 to {}, got {}", MarchScene::kMostOctaves, octaves.count));
}

void check(const RenderOptions& options) {
  require(options.samples >= 1 && options.samples <= 4096,
          fmt::format("samples: expected 1 to 4096, got {}", options.samples));
  require(!options.step || (std::isfinite(*options.step) && *options.step > 0),
          fmt::format("step: expected a length > 0, got {}", options.step.value_or(0)));
  require(std::isfinite(options.refinement.threshold) && options.refinement.threshold > 0,
          fmt::format("refinement: expected a threshold > 0, got {}", options.refinement.threshold));
  require(options.refinement.halvings >= 0 && options.refinement.halvings <= 16,
          fmt::format("refinement: expected 0 to 16 halvings, got {}", options.refinement.halvings));
  require(std::isfinite(options.shutter.open) && std::isfinite(options.shutter.close) &&
              options.shutter.open <= options.shutter.close,
          fmt::format("shutter: expected an opening not after the closing, got {}, {}", options.shutter.open,
                      options.shutter.close));
}

// In the order of PixelSum::light.
std::vector<std::string> lightNames(const Lights& lights, const RenderOptions& options) {
  std::vector<std::string> names = lights.names();
  if (options.surfaces) names.push_back("objects");
  return names;
}

// Null where there is nothing to see.
std::shared_ptr<const detail::BakedLight> bake(const RenderVolume& volume, const Medium& medium,
                                               const Lights& lights, const Octaves& octaves,
                                               const detail::BakedLight* before, const Progress& progress,
                                               const Surfaces* surfaces) {
  check(medium, lights, octaves);
  const bool isSeen = !volume.isEmpty() && medium.extinction > 0 && medium.extinctionColour != Vec3f{};
  require(isSeen || !surfaces, "objects: need a volume that is not empty and has an extinction");
  if (!isSeen) return nullptr;
  return std::make_shared<const detail::BakedLight>(volume, medium, lights, octaves, before, progress,
                                                    surfaces);
}

RenderResult look(const detail::BakedLight* lit, const Camera& camera, const RenderOptions& options,
                  Film& film, const Progress& progress) {
  RenderResult result;
  const PixelBox window = camera.window();
  const int width = window.width(), height = window.height();
  result.rays = std::uint64_t(width) * std::uint64_t(height) * std::uint64_t(options.samples);
  if (options.deep)
    result.deep = DeepImage{width, height, film.image().display,
                            std::vector<std::vector<DeepSample>>(std::size_t(width) * std::size_t(height))};
  if (!lit) {
    for (std::size_t i = 0; i != std::size_t(width) * height; ++i) {
      film.set(i, PixelSum{});
      film.set(i, PixelPoint{});
    }
    result.image = std::move(film.image());
    return result;
  }

  const auto start = std::chrono::steady_clock::now();
  const detail::Picture picture(*lit, camera, options, film);
  progress.begin("march");
  const int across = (width + kTile - 1) / kTile, down = (height + kTile - 1) / kTile;
  std::atomic<std::uint64_t> samples{0};
  parallelFor(
      std::size_t(across) * down, 1,
      [&](std::size_t begin, std::size_t end) {
        detail::Picture::Scratch scratch(options);
        const int together = picture.pixelsTogether();
        for (std::size_t tile = begin; tile != end; ++tile) {
          const int x0 = int(tile % std::size_t(across)) * kTile,
                    y0 = int(tile / std::size_t(across)) * kTile;
          const int x1 = std::min(x0 + kTile, width), y1 = std::min(y0 + kTile, height);
          std::uint64_t taken = 0;
          for (int y = y0; y < y1; ++y)
            for (int x = x0; x < x1; ++x) {
              const std::size_t at = std::size_t(y) * width + x;
              if ((x - x0) % together == 0)
                picture.march(window.x0 + x, window.y0 + y, std::min(together, x1 - x), scratch);
              taken += picture.gather((x - x0) % together, scratch);
              film.set(at, scratch.sum);
              if (result.deep) result.deep->pixels[at] = std::move(scratch.samples);
            }
          if (film.wantsPoints()) {
            picture.points({window.x0 + x0, window.y0 + y0, window.x0 + x1, window.y0 + y1}, scratch);
            const PixelPoint* point = scratch.points.data();
            for (int y = y0; y < y1; ++y)
              for (int x = x0; x < x1; ++x) film.set(std::size_t(y) * width + x, *point++);
          }
          samples += taken;
        }
      },
      progress);
  result.samples = samples;
  progress.count("rays", double(result.rays));
  progress.count("samples", double(result.samples));
  result.marchSeconds = secondsSince(start);
  result.image = std::move(film.image());
  return result;
}

}  // namespace

float defaultExtinction(const RenderVolume& volume) {
  const float side = volume.worldBounds().longestSide();
  return side > 0 ? 150.0f / (side * std::max(volume.typicalDensity(), 1.0f)) : 1.0f;
}

double estimateRenderBytes(const RenderVolume& volume, const Lights& lights, const Camera& camera,
                           const RenderOptions& options) {
  double floats = double(Film::channelCount(options.aovs, lights.names().size()));
  // A dozen samples where there is something.
  if (options.deep) floats += 12 * sizeof(DeepSample) / sizeof(float);
  const ScatteredLight::Bytes scattered = ScatteredLight::estimateBytes(volume);
  // The sky's map may hold suns of its own.
  const int spots = lights.map ? MarchScene::kMostSuns - int(Lights::kMost) : 0;
  const double others = (options.surfaces ? double(options.surfaces->memoryBytes()) : 0.0) +
                        (options.holdout ? double(options.holdout->memoryBytes()) : 0.0);
  const double perNode = double(lights.shadowDetail) * lights.shadowDetail * lights.shadowDetail;
  const double shadows =
      perNode * (double(lights.suns.size() + std::size_t(spots)) * LightVolume::estimateBytes(volume) +
                 double(lights.locals.size()) * ProjectedLightVolume::estimateBytes(volume));
  const double finer =
      perNode > 1 ? perNode * double(volume.occupiedBricks().size()) * BrickGrid::kVolume * sizeof(float) : 0;
  return others + shadows + finer + scattered.working +
         3.0 * double(lights.names().size() + std::size_t(spots) + volume.hasEmission()) * scattered.kept +
         double(camera.window().width()) * camera.window().height() * floats * sizeof(float);
}

LitVolume::LitVolume(const RenderVolume& volume, const Medium& medium, const Lights& lights,
                     const Octaves& octaves, const Progress& progress,
                     std::shared_ptr<const Surfaces> surfaces)
    : volume_(&volume), medium_(medium), lights_(lights), octaves_(octaves), surfaces_(std::move(surfaces)) {
  const auto start = std::chrono::steady_clock::now();
  light_ = bake(volume, medium, lights, octaves, nullptr, progress, surfaces_.get());
  lightSeconds_ = secondsSince(start);
}

LitVolume LitVolume::underOther(const Lights& lights, const Progress& progress) const {
  LitVolume other = *this;
  const auto start = std::chrono::steady_clock::now();
  other.lights_ = lights;
  other.light_ = bake(*volume_, medium_, lights, octaves_, light_.get(), progress, surfaces_.get());
  other.lightSeconds_ = secondsSince(start);
  return other;
}

RenderResult LitVolume::render(const Camera& camera, const RenderOptions& options,
                               const Progress& progress) const {
  check(options);
  require(options.octaves == octaves_, "octaves: differ from those that the light was made with");
  require(options.surfaces == surfaces_, "objects: differ from those that the light was made with");
  Film film(camera, lightNames(lights_, options), options.aovs);
  return look(light_.get(), camera, options, film, progress);
}

RenderResult renderImage(const RenderVolume& volume, const Medium& medium, const Lights& lights,
                         const Camera& camera, const RenderOptions& options, const Progress& progress) {
  check(medium, lights, options.octaves);
  check(options);
  // First of all, since it refuses unknown layers.
  Film film(camera, lightNames(lights, options), options.aovs);
  const auto start = std::chrono::steady_clock::now();
  const auto light = bake(volume, medium, lights, options.octaves, nullptr, progress, options.surfaces.get());
  const double lightSeconds = secondsSince(start);
  RenderResult result = look(light.get(), camera, options, film, progress);
  if (light) result.lightSeconds = lightSeconds;
  return result;
}

}  // namespace nephele

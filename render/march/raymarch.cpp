// From volumes, lights and a camera to a picture: light first (baked_light), then tiles of the picture in
// parallel (picture).
#include "nephele/render/march/raymarch.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/render/light/light_volume.h"
#include "nephele/render/light/projected_light_volume.h"
#include "nephele/render/light/scattered_light.h"
#include "nephele/render/march/detail/picture.h"
#include "nephele/render/march/film.h"
#include "nephele/render/scene/environment.h"

namespace nephele {

namespace {

constexpr int kTile = 16;
// Where only some pixels are marched: wide enough that few of them are at a border.
constexpr int kAdaptiveTile = 32;
// How far apart the first of these are.
constexpr int kApart = 4;

double secondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void check(const Medium& medium, const Lights& lights, const Octaves& octaves) {
  medium.check();
  lights.check();
  require(octaves.count >= 1 && octaves.count <= MarchScene::kMostOctaves,
          fmt::format("octaves: expected 1 to {}, got {}", MarchScene::kMostOctaves, octaves.count));
}

void check(const RenderOptions& options) {
  require(options.samples >= 1 && options.samples <= 4096,
          fmt::format("samples: expected 1 to 4096, got {}", options.samples));
  require(!options.step || (std::isfinite(*options.step) && *options.step > 0),
          fmt::format("step: expected a length > 0, got {}", options.step.value_or(0)));
  require(options.adaptiveThreshold >= 0 && options.adaptiveThreshold <= 1,
          fmt::format("adaptive threshold: expected 0 to 1, got {}", options.adaptiveThreshold));
  require(!(options.adaptiveThreshold > 0 && options.deep),
          "adaptive threshold: deep pictures need every pixel to be marched");
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

// A fiftieth of what a thin white medium sends back of suns and sky: what is darker need not be told apart
// as finely.
float faintRadiance(const detail::BakedLight& lit) {
  Vec3f sum = lit.sky ? lit.sky->mean() : lit.lights.sky;
  for (const DistantLight& sun : lit.distant) sum += sun.irradiance / (4 * kPi);
  return 0.02f * std::max({sum.x, sum.y, sum.z});
}

// Marches the pixels of tiles into a film.
class TileMarcher {
 public:
  TileMarcher(const detail::Picture& picture, const PixelBox& window, const RenderOptions& options,
              float faint, Film& film, DeepImage* deep)
      : picture_(picture),
        film_(film),
        deep_(deep),
        window_(window),
        threshold_(options.adaptiveThreshold),
        faint_(faint),
        raysPerPixel_(options.samples),
        scratch_(options) {}

  // `tile` counts from the picture's first pixel.
  void march(const PixelBox& tile) {
    if (threshold_ > 0)
      marchWhereNeeded(tile);
    else
      for (int y = tile.y0; y != tile.y1; ++y) marchRow(tile.x0, tile.x1, y);
    if (!film_.wantsPoints()) return;
    picture_.points({window_.x0 + tile.x0, window_.y0 + tile.y0, window_.x0 + tile.x1, window_.y0 + tile.y1},
                    scratch_);
    const PixelPoint* point = scratch_.points.data();
    for (int y = tile.y0; y != tile.y1; ++y)
      for (int x = tile.x0; x != tile.x1; ++x) film_.set(at(x, y), *point++);
  }

  std::uint64_t samples = 0, rays = 0;

 private:
  std::size_t at(int x, int y) const {
    return std::size_t(y) * std::size_t(window_.width()) + std::size_t(x);
  }

  void marchRow(int x0, int x1, int y) {
    const int together = picture_.pixelsTogether();
    for (int x = x0; x < x1; x += together) {
      const int count = std::min(together, x1 - x);
      picture_.march(window_.x0 + x, window_.y0 + y, count, scratch_);
      for (int i = 0; i != count; ++i) {
        samples += picture_.gather(i, scratch_);
        film_.set(at(x + i, y), scratch_.sum);
        if (deep_) deep_->pixels[at(x + i, y)] = std::move(scratch_.samples);
      }
      rays += std::uint64_t(count) * std::uint64_t(raysPerPixel_);
    }
  }

  // Pixels far apart first, then those in the middle of four, then those between, and so on half as far
  // apart. Neighbours beyond the tile are not asked, so that tiles do not depend on each other.
  void marchWhereNeeded(const PixelBox& tile) {
    for (int y = tile.y0; y < tile.y1; y += kApart)
      for (int x = tile.x0; x < tile.x1; x += kApart) marchRow(x, x + 1, y);
    for (int apart = kApart; apart != 1; apart /= 2) {
      const int half = apart / 2;
      for (int y = tile.y0 + half; y < tile.y1; y += apart)
        for (int x = tile.x0 + half; x < tile.x1; x += apart)
          fill(tile, x, y, {{{-half, -half}, {half, -half}, {-half, half}, {half, half}}});
      for (int y = tile.y0; y < tile.y1; y += half)
        for (int x = tile.x0 + ((y - tile.y0) % apart == 0 ? half : 0); x < tile.x1; x += apart)
          fill(tile, x, y, {{{-half, 0}, {half, 0}, {0, -half}, {0, half}}});
    }
  }

  void fill(const PixelBox& tile, int x, int y, const std::array<std::array<int, 2>, 4>& around) {
    std::array<std::size_t, 4> from;
    for (std::size_t i = 0; i != 4; ++i) {
      const int nextX = x + around[i][0], nextY = y + around[i][1];
      if (nextX < tile.x0 || nextY < tile.y0 || nextX >= tile.x1 || nextY >= tile.y1)
        return marchRow(x, x + 1, y);
      from[i] = at(nextX, nextY);
    }
    if (!film_.interpolate(at(x, y), from, threshold_, faint_)) marchRow(x, x + 1, y);
  }

  const detail::Picture& picture_;
  Film& film_;
  DeepImage* deep_;
  PixelBox window_;
  float threshold_, faint_;
  int raysPerPixel_;
  detail::Picture::Scratch scratch_;
};

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
  const float faint = faintRadiance(*lit);
  const int side = options.adaptiveThreshold > 0 ? kAdaptiveTile : kTile;
  const int across = (width + side - 1) / side, down = (height + side - 1) / side;
  std::atomic<std::uint64_t> samples{0}, rays{0};
  parallelFor(
      std::size_t(across) * down, 1,
      [&](std::size_t begin, std::size_t end) {
        TileMarcher marcher(picture, window, options, faint, film, result.deep ? &*result.deep : nullptr);
        for (std::size_t tile = begin; tile != end; ++tile) {
          const int x0 = int(tile % std::size_t(across)) * side, y0 = int(tile / std::size_t(across)) * side;
          marcher.march({x0, y0, std::min(x0 + side, width), std::min(y0 + side, height)});
        }
        samples += marcher.samples;
        rays += marcher.rays;
      },
      progress);
  result.rays = rays;
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

// From volumes, lights and a camera to a picture: light first (baked_light), then a film that the marcher
// fills.
#include "nephele/render/march/raymarch.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "nephele/modeling/base/error.h"
#include "nephele/render/light/deep_shadow.h"
#include "nephele/render/light/light_volume.h"
#include "nephele/render/light/projected_light_volume.h"
#include "nephele/render/light/scattered_light.h"
#include "nephele/render/march/detail/march_integrator.h"
#include "nephele/render/march/film.h"

namespace nephele {

namespace {

double secondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

float defaultExtinction(float longestSide, float typicalDensity) {
  return longestSide > 0 ? 150.0f / (longestSide * std::max(typicalDensity, 1.0f)) : 1.0f;
}

float defaultExtinction(const RenderVolume& volume) {
  return defaultExtinction(volume.worldBounds().longestSide(), volume.typicalDensity());
}

// Maps that were read stay; the others are made one after the other.
static double deepShadowBytes(const RenderVolume& volume, const Lights& lights) {
  double read = 0, made = 0;
  const auto look = [&](const auto& light) {
    if (light.deepShadow)
      read += double(light.deepShadow->memoryBytes());
    else if (lights.deepTolerance && !volume.isEmpty())
      made = std::max(made, DeepShadowMap::estimateBytes(volume, light));
  };
  for (const DistantLight& sun : lights.suns) look(sun);
  for (const LocalLight& light : lights.locals) look(light);
  return read + made;
}

double estimateRenderBytes(const RenderVolume& volume, const Lights& lights, const Camera& camera,
                           const RenderOptions& options) {
  double floats = double(Film::channelCount(options.aovs, lights.names().size()));
  // A dozen samples where there is something.
  if (options.deep) floats += 12 * sizeof(DeepSample) / sizeof(float);
  const ScatteredLight::Bytes scattered = ScatteredLight::estimateBytes(
      volume, {.longestSide = options.octaves.longestSide(), .order = options.octaves.order});
  // The sky's map may hold suns of its own.
  const std::size_t spots =
      lights.map ? Environment(*lights.map).takeSpots(MarchScene::kMostSuns - int(Lights::kMost)).size() : 0;
  const double others = (options.surfaces ? double(options.surfaces->memoryBytes()) : 0.0) +
                        (options.holdout ? double(options.holdout->memoryBytes()) : 0.0);
  const double perNode = double(lights.shadowDetail) * lights.shadowDetail * lights.shadowDetail;
  const bool coded =
      !options.surfaces && !lights.deepTolerance &&
      std::ranges::none_of(lights.suns, [](const DistantLight& sun) { return bool(sun.deepShadow); });
  const double shadows =
      perNode * (double(lights.suns.size() + spots) * LightVolume::estimateBytes(volume, {.coded = coded}) +
                 double(lights.locals.size()) * ProjectedLightVolume::estimateBytes(volume));
  const double finer =
      perNode > 1 ? perNode * double(volume.occupiedBricks().size()) * BrickGrid::kVolume * sizeof(float) : 0;
  return others + shadows + deepShadowBytes(volume, lights) + finer +
         double(ScatteredLight::kMadeTogether) * scattered.working +
         3.0 * double(lights.names().size() + spots + volume.hasEmission()) * scattered.kept +
         double(camera.window().width()) * camera.window().height() * floats * sizeof(float);
}

LitVolume::LitVolume(const RenderVolume& volume, const Medium& medium, const Lights& lights,
                     const Octaves& octaves, const Progress& progress,
                     std::shared_ptr<const Surfaces> surfaces)
    : volume_(&volume), medium_(medium), octaves_(octaves), surfaces_(std::move(surfaces)) {
  relight(lights, progress);
}

void LitVolume::relight(const Lights& lights, const Progress& progress) {
  const auto start = std::chrono::steady_clock::now();
  RenderScene::check(*volume_, medium_, lights, surfaces_.get());
  detail::MarchIntegrator::check(octaves_);
  if (light_) skyPart_ = std::make_shared<const detail::SkyPart>(light_->skyPart());
  lights_ = lights;
  light_.reset();
  isLit_ = false;
  lightSeconds_ = 0;
  if (isSeen(*volume_, medium_)) {
    light_ = std::make_shared<const detail::BakedLight>(*volume_, medium_, lights_, octaves_, &skyPart_,
                                                        progress, surfaces_.get());
    lightSeconds_ = secondsSince(start);
  }
  skyPart_.reset();
  isLit_ = true;
}

std::unique_ptr<Integrator> LitVolume::integrator(const RenderOptions& options) const {
  require(isLit_, "light: has not been made to its end");
  require(options.octaves == octaves_, "octaves: differ from those that the light was made with");
  require(options.surfaces == surfaces_, "objects: differ from those that the light was made with");
  return std::make_unique<detail::MarchIntegrator>(light_, options);
}

RenderResult LitVolume::render(const Camera& camera, const RenderOptions& options,
                               const Progress& progress) const {
  const RenderScene scene(*volume_, medium_, lights_, camera, options);
  return nephele::render(scene, *integrator(options), Film(scene, options), progress);
}

RenderResult renderImage(const RenderVolume& volume, const Medium& medium, const Lights& lights,
                         const Camera& camera, const RenderOptions& options, const Progress& progress) {
  // What is wrong with the options is said before the light is made.
  const RenderScene scene(volume, medium, lights, camera, options);
  scene.check();
  detail::MarchIntegrator::check(options);
  Film film(scene, options);
  const LitVolume lit(volume, medium, lights, options.octaves, progress, options.surfaces);
  RenderResult result = render(scene, *lit.integrator(options), std::move(film), progress);
  result.lightSeconds = lit.lightSeconds();
  return result;
}

}  // namespace nephele

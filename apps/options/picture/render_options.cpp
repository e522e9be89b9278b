#include "apps/options/picture/render_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/options/picture/live_picture.h"
#include "nephele/render/march/film.h"
#include "nephele/render/scene/aerial_perspective.h"
#include "nephele/render/scene/backdrop.h"

namespace nephele::apps {
namespace {

constexpr double kBrightest = 1e30;

void addMedium(CLI::App& app, PictureOptions& options) {
  addNumber(
      app, "--extinction", 0, 1e30, [&options](double value) { options.extinction = float(value); },
      "Extinction per world unit where the density is 1.")
      ->default_str("150 / longest side of the volume");
  addNumbers(
      app, "--albedo", "R,G,B", 3, 0, 1,
      [&options](const Vec3d& v) {
        options.medium.albedo = Vec3f(v);
        options.albedoGiven = true;
      },
      "Share of the light met that is scattered.")
      ->default_str(fmt::format("{:g},{:g},{:g}", options.medium.albedo.x, options.medium.albedo.y,
                                options.medium.albedo.z));
  addNumbers(
      app, "--extinction-color", "R,G,B", 3, 0, 1e6,
      [&options](const Vec3d& v) { options.medium.extinctionColour = Vec3f(v); },
      "Multiplies the extinction, per colour.")
      ->default_str("1,1,1");
  app.add_option_function<std::string>(
         "--phase",
         [&options](const std::string& text) {
           options.phaseGiven = true;
           try {
             options.medium.phase = Phase::parse(text);
           } catch (const Error&) {
             refuseValue("--phase", text, Phase::forms());
           }
         },
         "Where scattered light goes: Henyey-Greenstein with mean cosine G, Schlick's form, two "
         "Henyey-Greenstein lobes of which the second has the share MIX, or water droplets by their "
         "diameter.")
      ->type_name("isotropic|rayleigh|hg:G|schlick:K|two-lobe:G1,G2,MIX|mie:MICROMETRES")
      ->default_str(fmt::format("hg:{:g}", options.medium.phase.meanCosine()));
  addCount(app, "--octaves", options.render.octaves.count, 1, 16,
           "Terms of the light that is scattered forward several times on its way; 1 is single scattering.");
}

void addIntegrator(CLI::App& app, PictureOptions& options) {
  addChoice(app, "--integrator", options.pathTraced, {{"march", false}, {"path", true}},
            "march: without noise; path: the unbiased and noisy reference.");
  addCount(app, "--spp", options.path.samplesPerPixel, 1, 1 << 20, "Paths per pixel of --integrator path.")
      ->group("")
      ->each([&options](const std::string&) { options.pathsGiven = true; });
  addCount(app, "--scatterings", options.path.maxScatterings, 0, 1000000,
           "Scatterings at which paths end, 0: never.");
}

/// Shorter steps than a thousandth of a voxel show nothing more, and rays of too many steps never end.
float stepIn(const RenderVolume& volume, const Length& step, double longest) {
  const double length = step.worldUnits(longest), shortest = double(volume.density().voxelSize()) / 1000;
  if (!volume.isEmpty() && length < shortest * (1 - 1e-6))
    refuseValue("--step", fmt::format("{:g}{}", step.value, step.relative ? "%" : ""),
                fmt::format("at least {:.3g}, a thousandth of a voxel", shortest));
  return float(length);
}

}  // namespace

void addPictureOptions(CLI::App& app, PictureOptions& options) {
  addVolumeOptions(app, options.volumes);
  addCameraOptions(app, options);
  addLightOptions(app, options.light);
  addMedium(app, options);
  addScaleOptions(app, options.scale);
  addChoice<Quality>(
      app, "--quality", options.quality,
      {{"draft", Quality::draft}, {"good", Quality::good}, {"final", Quality::final}},
      "Sets --samples, --step, --adaptive and --light-quality together, for a first look, a picture, "
      "or the last one; each of them still says more where it is given.");
  addChoice<std::optional<Quality>>(
      app, "--light-quality", options.lightQuality,
      {{"draft", Quality::draft}, {"good", Quality::good}, {"final", Quality::final}},
      "Directions in which scattered light is solved for, and cells along the longest side: 24 and 72, 48 "
      "and "
      "84, or 80 and 160. Time and memory grow with both.")
      ->default_str("as --quality");
  addLength(app, "--step", options.step, "Longest step along a ray.", Sign::positive)
      ->default_str("one voxel");
  addCount(app, "--samples", options.render.samples, 1, 1 << 20,
           "Rays per pixel, at most 4096, or paths with --integrator path.")
      ->each([&options](const std::string&) { options.samplesGiven = true; })
      ->default_str("4, or 64 with depth of field or motion blur; 64 paths");
  addNumber(
      app, "--adaptive", options.adaptiveThreshold, 0, 1,
      "March only pixels whose neighbours differ by more than this share of brightness or opacity; 0: all.")
      ->each([&options](const std::string&) { options.adaptiveGiven = true; });
  addIntegrator(app, options);
  addCount(app, "--seed", options.seed, 0, 1 << 30, "Moves the pattern of the samples.");
  std::vector<std::string> layers = Film::layerNames();
  std::string names = layers.front();
  for (std::size_t i = 1; i != layers.size(); ++i) names += "," + layers[i];
  layers.push_back("none");
  auto* aov = app.add_option("--aov", options.render.aovs,
                             "Layers beside R, G, B and A: none, or several of " + names + ".")
                  ->type_name("LIST")
                  ->delimiter(',')
                  ->allow_extra_args(false)
                  ->default_str("Z");
  allowWords(aov, layers);
  addViewOptions(app, options.view);
  addNumbers(
      app, "--background", "R,G,B", 3, 0, kBrightest,
      [&options](const Vec3d& v) { options.background = Vec3f(v); }, "Linear colour behind the preview.")
      ->default_str("the sky's");
  addDisplayServer(app, options.displayServer);
}

PictureOptions PictureOptions::withView(ViewCurve otherwise) const {
  PictureOptions result = *this;
  result.screen = view.read(otherwise);
  return result;
}

Extent extentOf(const RenderVolume& volume) {
  return {volume.worldBounds(), double(volume.worldBounds().longestSide()), volume.outline()};
}

PictureOptions PictureOptions::resolved(const RenderVolume& volume, const Run& run,
                                        const LitVolume* lit) const {
  PictureOptions result = *this;
  static_cast<CameraOptions&>(result) = placed(extentOf(volume), run);
  result.chooseByScale(volume, run);
  result.medium.extinction = *result.extinction;
  if (adaptiveThreshold > 0 && pathTraced)
    refuseValue("--adaptive", fmt::format("{:g}", adaptiveThreshold), "0 with --integrator path");
  result.render.adaptiveThreshold = float(adaptiveThreshold);
  result.chooseByQuality();
  result.render.step = result.stepThrough(volume);
  result.lights = lit ? lit->lights() : light.resolved(result.seen.longestSide, run.memoryLimitBytes);
  if (lit) result.render.surfaces = lit->surfaces();
  result.screen.background =
      background.value_or(result.lights.map ? result.lights.map->mean() : result.lights.sky);
  if (std::erase(result.render.aovs, "none") > 0 && !result.render.aovs.empty())
    refuseValue("--aov", "none", "none alone, or layers without it");
  if (scale.aerialPerspective) {
    if (!result.lights.clear)
      throw CLI::ValidationError("--aerial-perspective", "needs the air of --sky clear");
    result.dropsMeanDepth_ = std::ranges::count(result.render.aovs, "Z_mean") == 0;
    if (result.dropsMeanDepth_) result.render.aovs.push_back("Z_mean");
  }
  result.render.shutter = shutter;
  result.volumeFlows = volumeFlows || !volumes.velocityGrids.empty();
  result.render.volumeMotion = result.motion();
  if (result.volumeFlows && std::ranges::count(result.render.aovs, "motion") > 0)
    run.note(
        "--aov motion: is that of the camera and of --volume-motion; velocities of the volume are not in it");
  if (shutter.isInstant() && std::ranges::count(result.render.aovs, "motion") > 0)
    result.render.nextCamera = result.laterCamera(1);
  result.render.seed = std::uint32_t(seed);
  return result;
}

void PictureOptions::chooseByScale(const RenderVolume& volume, const Run& run) {
  if (!extinction) {
    const bool isInRange = run.part && run.part->range;
    const float density = isInRange ? seen.typicalDensity : volume.typicalDensity();
    if (scale.longestSide && !volume.isEmpty())
      extinction = RealCloud::kExtinction * scale.metresPerUnit(seen.longestSide) / std::max(density, 1.0f);
    else
      extinction =
          isInRange ? defaultExtinction(float(seen.longestSide), density) : defaultExtinction(volume);
  }
  if (!scale.longestSide) return;
  if (!albedoGiven) medium.albedo = Vec3f{1, 1, 1} * RealCloud::kAlbedo;
  if (!phaseGiven) medium.phase = Phase::parse(fmt::format("mie:{:g}", RealCloud::kDiameter));
}

std::optional<float> PictureOptions::stepThrough(const RenderVolume& volume) const {
  if (step.value > 0) return stepIn(volume, step, seen.longestSide);
  // The standard step is the marcher's own: longer where the density hardly varies.
  const float voxels = QualityChoices::of(quality).stepVoxels;
  if (voxels == 1 || volume.isEmpty()) return std::nullopt;
  return voxels * volume.density().voxelSize();
}

void PictureOptions::chooseByQuality() {
  const QualityChoices choices = QualityChoices::of(quality);
  render.octaves.order = QualityChoices::of(lightQuality.value_or(quality)).lightOrder;
  if (!samplesGiven) render.samples = choices.samples;
  if (!pathsGiven) path.samplesPerPixel = samplesGiven ? render.samples : choices.pathsPerPixel;
  constexpr int kMostRays = 4096;
  if (!pathTraced && render.samples > kMostRays)
    refuseValue("--samples", std::to_string(render.samples),
                fmt::format("a whole number from 1 to {}, but with --integrator path", kMostRays));
  if (pathTraced) render.samples = std::min(render.samples, kMostRays);
  if (!adaptiveGiven && !pathTraced) render.adaptiveThreshold = choices.adaptiveThreshold;
}

bool PictureOptions::needsSamples() const {
  return pathTraced || std::ranges::count(render.aovs, "normal") > 0;
}

bool PictureOptions::lightNeedsSamples(const RenderVolume& volume) const {
  return !light.readsCodes() || volume.hasEmission();
}

std::shared_ptr<const LitCloud> PictureOptions::lit(PictureStages& stages, const PictureStages::Keys& keys,
                                                    const Progress& progress) {
  auto result =
      stages.light(keys.medium, keys.lights, {medium, lights, render.octaves, render.surfaces}, progress);
  render.surfaces = result->light.surfaces();
  return result;
}

RenderOptions PictureOptions::marched(const Camera& camera) const {
  RenderOptions options = render;
  if (!samplesGiven && (camera.hasLens() || camera.isMoving() || render.volumeMotion))
    options.samples = QualityChoices::of(quality).blurredSamples;
  return options;
}

PathOptions PictureOptions::traced() const {
  PathOptions options = path;
  static_cast<FrameOptions&>(options) = render;
  return options;
}

double PictureOptions::estimateBytes(const RenderVolume& volume, const Camera& camera) const {
  return estimateRenderBytes(volume, lights, camera, render) +
         (pathTraced ? estimatePathBytes(camera, traced()) : 0);
}

RenderResult PictureOptions::picture(const RenderVolume& volume, const Camera& camera,
                                     const Progress& progress) const {
  if (pathTraced) return pathTraceImage(volume, medium, lights, camera, traced(), progress);
  return renderImage(volume, medium, lights, camera, marched(camera), progress);
}

void PictureOptions::addSky(Image& image, const Camera& camera, const Lights& its) const {
  if (backdrop) addBackdrop(image, camera, its);
  if (!scale.aerialPerspective) return;
  addAir(image, camera, {*its.clear, scale.metresPerUnit(seen.longestSide), light.sky.intensity});
  if (dropsMeanDepth_)
    std::erase_if(image.channels, [](const Image::Channel& channel) { return channel.name == "Z_mean"; });
}

std::map<std::string, std::string> PictureOptions::metadata(const Run& run) const {
  auto metadata = run.metadata();
  metadata["seed"] = std::to_string(render.seed);
  metadata["extinction"] = fmt::format("{:g}", *extinction);
  return metadata;
}

void tellWork(const RenderResult& result, Run& run) {
  run.stats["rays"] = result.rays;
  run.stats["samples"] = result.samples;
  if (result.deep) run.stats["deep_samples"] = result.deep->sampleCount();
  run.stats["light_seconds"] = result.lightSeconds;
  run.stats["march_seconds"] = result.marchSeconds;
}

std::size_t noteNotFinite(const std::string& path, const Image& image, const Run& run) {
  const std::size_t count = notFiniteCount(image);
  if (count > 0)
    run.note(fmt::format("{}: {} value{} of the picture {} not finite; 16 bit channels get 0 or 65504 there",
                         path, count, count == 1 ? "" : "s", count == 1 ? "is" : "are"));
  return count;
}

}  // namespace nephele::apps

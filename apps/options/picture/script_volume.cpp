#include "apps/options/picture/script_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>

#include "apps/felt/felt_scripts.h"
#include "nephele/levelset/felt/field_extent.h"
#include "nephele/modeling/felt/program.h"
#include "nephele/modeling/field/operations.h"

namespace nephele::apps {

namespace {

/// What a script declares of a volume.
struct ScriptScene {
  FieldParts parts;
  std::optional<double> extinction;
  std::optional<Vec3d> sky, sun;
};

/// The share of the memory allowed that the samples of a script may take; the light takes as much again.
constexpr double kMemoryShare = 0.25;
constexpr double kMostBytes = 4e9;
/// Voxels along the box in which a script is looked at to frame it.
constexpr int kCoarse = 96;
constexpr int kSizesPerOctave = 8;

class Declared {
 public:
  Declared(const std::string& path, std::vector<felt::Named> names) : path_(path), names_(std::move(names)) {}

  /// The value called `name` as one of `kind`, or nothing if it is not declared.
  template <class T>
  std::optional<T> as(const std::string& name, felt::Kind kind) const {
    for (const felt::Named& named : names_) {
      if (named.name != name) continue;
      const felt::Type type{kind, false};
      if (!named.value.isSet()) throw Error(path_ + ": '" + name + "' has no value at the end of the script");
      if (!felt::conversionCost(named.type, type))
        throw Error(fmt::format("{}: '{}' is {}, and of a volume it is {}", path_, name,
                                felt::articledName(named.type), felt::articledName(type)));
      return felt::converted(named.value, type).as<T>();
    }
    return std::nullopt;
  }
  bool isScalar(const std::string& name) const {
    return std::any_of(names_.begin(), names_.end(), [&](const felt::Named& named) {
      return named.name == name && felt::conversionCost(named.type, {felt::Kind::scalarField, false});
    });
  }

 private:
  std::string path_;
  std::vector<felt::Named> names_;
};

ScriptScene runScript(const std::string& path, const ScriptOptions& options, const PictureOptions& picture,
                      Run& run) {
  run.begin("script");
  const ExpressionNames names = namesOfPlace(picture.time(run), picture.seed);
  const felt::Program program = felt::Program::fromFile(path, feltFunctions(), names.given);
  for (const felt::Diagnostic& warning : program.warnings())
    run.note(felt::formatted(warning, program.sources()));
  felt::Context context;
  context.print = [&run](const std::string& line) { run.note(line); };
  context.progress = &run;
  context.limits.memoryBytes = run.memoryLimitBytes;
  const Declared declared(path, program.run(context, {.settings = settingsOf(options.settings, program)}));

  ScriptScene scene;
  FieldParts& parts = scene.parts;
  const auto density = declared.as<ScalarField>("density", felt::Kind::scalarField);
  if (!density)
    throw Error(path +
                ": declares no 'density'; a script that is looked at says 'scalarfield density = ...;'");
  parts.density = *density;
  if (const auto bounds = declared.as<felt::Domain>("bounds", felt::Kind::domain))
    parts.box = bounds->bounds();
  else
    parts.box = namingFile(path, [&] { return felt::extentOf(parts.density, run); });
  parts.colour = declared.as<VectorField>("color", felt::Kind::vectorField);
  if (declared.isScalar("emission")) {
    const auto white = *declared.as<ScalarField>("emission", felt::Kind::scalarField);
    parts.emission = vectorField(white, white, white);
  } else {
    parts.emission = declared.as<VectorField>("emission", felt::Kind::vectorField);
  }
  parts.temperature = declared.as<ScalarField>("temperature", felt::Kind::scalarField);
  parts.emissionScale = float(picture.volumes.emissionScale);
  if (!picture.shutter.isInstant()) {
    parts.velocity = declared.as<VectorField>("velocity", felt::Kind::vectorField);
    if (parts.velocity)
      *parts.velocity = *parts.velocity * ScalarField(float(picture.volumes.velocityFactor()));
    parts.shutter = picture.shutter;
  }
  if (!picture.volumes.densityScales.empty()) parts.share = float(picture.volumes.densityScales[0]);
  scene.extinction = declared.as<double>("extinction", felt::Kind::number);
  scene.sky = declared.as<Vec3d>("sky", felt::Kind::vector);
  scene.sun = declared.as<Vec3d>("sun", felt::Kind::vector);
  return scene;
}

/// Refuses what a script cannot say of a picture.
void check(const std::string& path, const ScriptScene& scene) {
  constexpr double kMost = 1e9;
  const auto isWithin = [](double x, double least, double most) { return x >= least && x <= most; };
  if (scene.extinction && !isWithin(*scene.extinction, 0, kMost))
    throw Error(fmt::format("{}: 'extinction' is {:g}, allowed: 0 to 1e9", path, *scene.extinction));
  if (scene.sky)
    for (int c = 0; c < 3; ++c)
      if (!isWithin((*scene.sky)[c], 0, kMost))
        throw Error(fmt::format("{}: 'sky' has {:g}, allowed: 0 to 1e9", path, (*scene.sky)[c]));
  if (scene.sun && !(isWithin(scene.sun->x, -36000, 36000) && isWithin(scene.sun->y, -90, 90) &&
                     isWithin(scene.sun->z, 0, kMost)))
    throw Error(
        fmt::format("{}: 'sun' is ({:g}, {:g}, {:g}), allowed: an azimuth, an elevation from -90 to 90, "
                    "and an irradiance from 0 to 1e9",
                    path, scene.sun->x, scene.sun->y, scene.sun->z));
}

}  // namespace

void addScriptOptions(CLI::App& app, ScriptOptions& options) {
  using Detail = ScriptOptions::Detail;
  addChoice<Detail>(app, "--detail", options.detail, {{"camera", Detail::camera}, {"exact", Detail::exact}},
                    "How a script is looked at: sampled as finely as the picture shows it, or asked by every "
                    "ray, without a grid.");
  app.add_option("--set", options.settings, "A parameter of the script; may be given again.")
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

void requireNoSettings(const ScriptOptions& options) {
  if (!options.settings.empty())
    throw CLI::ValidationError("--set", "is for scripts (.felt), which have parameters");
}

bool isScript(const std::vector<std::string>& paths) {
  const auto script = std::find_if(paths.begin(), paths.end(),
                                   [](const std::string& path) { return path.ends_with(".felt"); });
  if (script == paths.end()) return false;
  if (paths.size() > 1)
    throw Error(*script +
                ": a script is looked at alone; it can read the other files itself, by readfield(...)");
  return true;
}

ScriptVolume::ScriptVolume(const std::string& path, const ScriptOptions& options, PictureOptions& picture,
                           Run& run)
    : path_(path), isExact_(options.detail == ScriptOptions::Detail::exact) {
  ScriptScene scene = runScript(path, options, picture, run);
  check(path, scene);
  extinction_ = scene.extinction;
  sky_ = scene.sky;
  sun_ = scene.sun;
  parts_ = std::move(scene.parts);
  suggestTo(picture);
}

void ScriptVolume::suggestTo(PictureOptions& picture) const {
  if (extinction_ && !picture.extinction) picture.extinction = float(*extinction_);
  if (sky_) picture.light.suggestSky(felt::toFloat(*sky_));
  if (sun_) picture.light.suggestSun(sun_->x, sun_->y, sun_->z);
  if (parts_.velocity) picture.volumeFlows = true;
}

RenderVolume ScriptVolume::forCameraOf(const PictureOptions& picture, Run& run) {
  const std::optional<float> size = voxelSizeFor(picture, run);
  if (!size) return sampledVolume({.density = parts_.density, .box = parts_.box}, coarseVoxels(), run);
  const float side = parts_.box.longestSide();
  run.detail(fmt::format("{}: voxels of {:g}, {:.0f} along the longest side", path_, *size, side / *size));
  run.stats["script"] = {{"voxel_size", *size}, {"exact", isExact_}};
  return withVoxels(*size, run);
}

float ScriptVolume::coarseVoxels() const {
  return parts_.box.longestSide() / kCoarse;
}

std::optional<float> ScriptVolume::voxelSizeFor(const PictureOptions& picture, Run& run) {
  return namingFile(path_, [&]() -> std::optional<float> {
    if (!seen_) {
      // What the camera frames shows only once the script has been looked at.
      seen_ = extentOf(sampledVolume({.density = parts_.density, .box = parts_.box}, coarseVoxels(), run));
      const bool hasOthers = parts_.colour || parts_.emission || parts_.velocity || parts_.temperature;
      const double bytes = std::min(kMostBytes, kMemoryShare * run.memoryLimitBytes);
      if (!seen_->box.isEmpty())
        resolution_.emplace(parts_.density,
                            FieldVolumeOptions{.box = parts_.box,
                                               .voxelsPerPixel = isExact_ ? 0.5f : 1.0f,
                                               .mostBytes = hasOthers ? bytes / 4 : bytes,
                                               .sizesPerOctave = kSizesPerOctave},
                            run);
    }
    if (seen_->box.isEmpty()) return std::nullopt;
    return voxelSize(static_cast<const CameraOptions&>(picture).placed(*seen_, run).camera(), run);
  });
}

float ScriptVolume::voxelSize(const Camera& camera, const Progress& progress) {
  return resolution_->voxelSize(camera, progress);
}

RenderVolume ScriptVolume::withVoxels(float voxelSize, const Progress& progress) const {
  return namingFile(path_, [&] {
    return isExact_ ? gridlessVolume(parts_, voxelSize, progress)
                    : sampledVolume(parts_, voxelSize, progress);
  });
}

}  // namespace nephele::apps

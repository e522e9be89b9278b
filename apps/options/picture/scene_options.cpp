#include "apps/options/picture/scene_options.h"

#include <fmt/format.h>

#include "apps/options/expression_names.h"
#include "apps/options/picture/shapes_picture.h"

namespace nephele::apps {

std::optional<float> SceneVolume::otherVoxels(const Camera& camera, const Progress& progress) {
  if (!script_ || !script_->isSampled() || volume_->isEmpty()) return std::nullopt;
  const float voxelSize = script_->voxelSize(camera, progress);
  return voxelSize == volume_->density().voxelSize() ? std::nullopt : std::optional(voxelSize);
}

void SceneVolume::resample(float voxelSize, const Progress& progress) {
  volume_.reset();
  volume_ = script_->withVoxels(voxelSize, progress);
}

SceneVolume SceneOptions::sceneVolume(PictureOptions& picture, Run& run) const {
  const auto made = [&]() -> SceneVolume {
    if (!isScript(inputs)) {
      requireNoSettings(script);
      return SceneVolume(readVolumes(
          inputs, picture.volumes,
          {picture.shutter, picture.readsCodes(), objects.any(), picture.time(run), picture.seed}, run));
    }
    requireNoGrids(picture.volumes);
    ScriptVolume ran(inputs.front(), script, picture, run);
    RenderVolume sampled = ran.forCameraOf(picture, run);
    return {std::move(sampled), std::move(ran)};
  };
  SceneVolume result = made();
  if (result.volume().isEmpty()) run.note(inputs.front() + ": the volume is empty, and so is its picture");
  return result;
}

RenderVolume SceneOptions::volume(PictureOptions& picture, Run& run) const {
  return sceneVolume(picture, run).taken();
}

bool SceneOptions::changesWithTime(const PictureOptions& picture) const {
  const std::string& color = picture.volumes.color;
  ExpressionNames names = namesOfPlace(0, 0);
  // Who does without the name does not read it.
  std::erase_if(names.given, [](const felt::Given& one) { return one.name == "time"; });
  try {
    if (isScript(inputs)) felt::Program::fromFile(inputs.front(), *names.registry, names.given);
    if (!color.empty()) checkedExpression("--color", color, {felt::Kind::vectorField}, names);
    return false;
  } catch (const felt::ScriptError&) {
    return true;
  }
}

Extent SceneOptions::measured(const PictureOptions& picture, Run& run) const {
  if (!isScript(inputs))
    if (const auto grids = picture.volumes.seenGrids(inputs.size()); areShapes(inputs, grids))
      return extentOfShapes(inputs, grids, objects, run);
  PictureOptions own = picture;
  const RenderVolume read = volume(own, run);
  Extent extent = extentOf(read);
  if (!own.extinction) extent.typicalDensity = read.typicalDensity();
  return extent;
}

Extent SceneOptions::extent(const PictureOptions& picture, Run& run) const {
  Extent extent = measured(picture, run);
  CameraOptions camera = picture;
  objects.lift(camera);
  extent.outline = camera.outermost(extent.outline);
  return extent;
}

void SceneOptions::addTo(PictureOptions& picture, const RenderVolume& volume, bool isShown,
                         const Run& run) const {
  objects.lift(picture);
  objects.addTo(picture, volume, isShown, run.memoryLimitBytes);
  if (deep.empty()) return;
  picture.render.deep.emplace();
  if (picture.adaptiveThreshold > 0)
    refuseValue("--adaptive", fmt::format("{:g}", picture.adaptiveThreshold), "0 with --deep");
  picture.render.adaptiveThreshold = 0;
}

void noteColouredHoldout(const SceneOptions& scene, const PictureOptions& picture, const Run& run) {
  const Vec3f& share = picture.medium.extinctionColour;
  if (!scene.holdout.empty() && (share.x != share.y || share.y != share.z))
    run.note(
        "--holdout: a deep picture has one opacity for all colours, so that with --extinction-color the "
        "elements add up in the mean of the colours only");
}

void addSceneInputs(CLI::App& app, SceneOptions& options, const std::string& inputs) {
  app.add_option("input", options.inputs, inputs)->required()->type_name("FILE");
  addScriptOptions(app, options.script);
}

void addSceneOptions(CLI::App& app, SceneOptions& options, OutputTrial trial) {
  // Air is put before deep pictures when they are merged.
  addOutput(app, "--deep", options.deep, {".exr"},
            "The picture with depth: samples that give the picture when they are flattened.", trial)
      ->excludes("--aerial-perspective");
  app.add_option(
         "--holdout", options.holdout,
         "Deep picture (.exr) of what stands in front, for the same camera: of what is behind it only "
         "the share is kept that it lets through.")
      ->type_name("FILE");
  addObjectOptions(app, options.objects);
}

}  // namespace nephele::apps

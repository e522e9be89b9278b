#include <fmt/format.h>

#include "apps/options/picture/live_picture.h"
#include "apps/options/picture/picture_files.h"
#include "apps/options/picture/picture_keys.h"
#include "apps/options/picture/render_options.h"
#include "apps/options/picture/scene_options.h"
#include "apps/options/picture/shapes_picture.h"
#include "nephele/render/session/picture_stages.h"

namespace nephele::apps {
namespace {

struct RenderVerbOptions {
  SceneOptions scene;
  PictureFiles files;
  PictureOptions picture;
  const CLI::App* app = nullptr;
};

void bindOptions(CLI::App& app, RenderVerbOptions& options) {
  addSceneInputs(app, options.scene,
                 "Densities to look at (.vdb, .nvdb); where they overlap they add up. Or a script (.felt) "
                 "that declares one, or "
                 "meshes and level sets alone, shaded quickly in a light of their own.");
  addPictureFiles(app, options.files);
  addPictureOptions(app, options.picture);
  addShadowOutput(app, options.picture.light);
  addSceneOptions(app, options.scene);
  requireOneOutput(app, {"--output", "--preview", "--deep"});
  options.app = &app;
}

/// Marches or path traces `volume`, which is that of the stages. Light that is made stays with them.
RenderResult pictureOf(PictureOptions& picture, const RenderVolume& volume, const Camera& camera,
                       const PictureStages::Keys& keys, PictureStages& stages, Run& run) {
  if (picture.pathTraced) return picture.picture(volume, camera, run);
  const bool isLit = stages.isLit(keys);
  const auto lit = picture.lit(stages, keys, run);
  RenderResult result = lit->light.render(camera, picture.marched(camera), run);
  if (!isLit) result.lightSeconds = lit->light.lightSeconds();
  return result;
}

void renderVolume(const RenderVerbOptions& options, Run& run) {
  const SceneOptions& scene = options.scene;
  const PictureFiles files{options.files.output, options.files.preview, scene.deep};
  PictureOptions picture = options.picture.withView();
  if (!isScript(scene.inputs) && areShapes(scene.inputs, picture.volumes.seenGrids(scene.inputs.size())))
    // Nothing is bright there, and textures are to look as they do.
    return writeShapesPicture(*options.app, scene, options.picture.withView(ViewCurve::standard), files, run);
  // Keys take the contents of all files.
  const PictureStages::Keys keys =
      run.pictureStages ? pictureKeys(*options.app, scene, picture, run) : PictureStages::Keys{};
  const auto stages = run.pictureStages ? run.pictureStages : std::make_shared<PictureStages>();
  std::shared_ptr<const RenderVolume> volume = keys.volume.empty() ? nullptr : stages->volumeAt(keys);
  std::shared_ptr<RenderVolume> made;
  if (!volume) {
    // Two volumes never stand side by side.
    stages->forget();
    volume = made = std::make_shared<RenderVolume>(scene.volume(picture, run));
    stages->volume(keys.volume, volume);
  }
  picture = picture.resolved(*volume, run, stages->isLit(keys) ? &stages->lit()->light : nullptr);
  scene.addTo(picture, *volume, !options.files.preview.empty(), run);
  const Camera camera = picture.camera();
  noteColouredHoldout(scene, picture, run);
  if (!scene.holdout.empty())
    picture.render.holdout = readHoldout(scene.holdout, camera, run.memoryLimitBytes);
  run.requireMemory(double(volume->memoryBytes()) + picture.estimateBytes(*volume, camera),
                    "make the picture smaller (--size), or the volume with larger voxels");
  picture.light.writeShadows(*volume, picture.lights, picture.medium, run);
  // Other light in the same volume needs what this one does.
  if (made && !picture.needsSamples() && !(run.pictureStages && picture.lightNeedsSamples(*volume)))
    made->giveUpSamples();
  LivePicture live(picture.displayServer, files.name(), picture.render);
  RenderResult result = pictureOf(picture, *volume, camera, keys, *stages, run);
  picture.addSky(result.image, camera, picture.lights);
  run.begin("write");
  files.write(result, camera, picture.screen, picture.metadata(run));
  live.complete(result.image);
  live.finish(run);
  run.stats["values_not_finite"] = noteNotFinite(files.name(), result.image, run);
  tellWork(result, run);
  run.stats["extinction"] = *picture.extinction;
  run.result(fmt::format("{}: {}x{}, extinction {:g} per world unit", files.name(), camera.width(),
                         camera.height(), *picture.extinction));
}

}  // namespace

Verb renderVerb() {
  return verbOf(
      "render", "Makes a picture of a density (a cloud, smoke, any fog volume), or a quick one of meshes.",
      "nephele render cloud.vdb -o cloud.exr --preview cloud.png --view 25,5 --sun 90,38", bindOptions,
      renderVolume, {},
      [](const RenderVerbOptions& options, Run& run) { return options.scene.extent(options.picture, run); });
}

}  // namespace nephele::apps

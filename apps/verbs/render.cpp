#include <fmt/format.h>

#include "apps/options/live_picture.h"
#include "apps/options/render_options.h"
#include "apps/options/scene_options.h"
#include "apps/options/shapes_picture.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/image/png_io.h"

namespace nephele::apps {
namespace {

struct RenderVerbOptions {
  SceneOptions scene;
  PictureFiles files;
  PictureOptions picture;
};

void bindOptions(CLI::App& app, RenderVerbOptions& options) {
  addSceneInputs(
      app, options.scene,
      "Densities to look at (.vdb, .nvdb); where they overlap they add up. Or meshes and level sets "
      "alone, shaded quickly in a light of their own.");
  addOutput(app, "-o,--output", options.files.output, {".exr"}, "Picture to write: linear, premultiplied.")
      ->required();
  addOutput(app, "--preview", options.files.preview, {".png"}, "The same for the screen, before the sky.");
  addPictureOptions(app, options.picture);
  addShadowOutput(app, options.picture.light);
  addSceneOptions(app, options.scene);
}

void renderVolume(const RenderVerbOptions& options, Run& run) {
  const SceneOptions& scene = options.scene;
  PictureOptions picture = options.picture.withView();
  if (areShapes(scene.inputs))
    // Nothing is bright there, and textures are to look as they do.
    return writeShapesPicture(scene.inputs, scene.objects, options.picture.withView(ViewCurve::standard),
                              options.files, run);
  RenderVolume volume = scene.volume(options.picture, run);
  picture = picture.resolved(volume, run);
  scene.addTo(picture, volume, !options.files.preview.empty(), run);
  const Camera camera = picture.camera();
  if (!scene.holdout.empty())
    picture.render.holdout = readHoldout(scene.holdout, camera, run.memoryLimitBytes);
  run.requireMemory(double(volume.memoryBytes()) + picture.estimateBytes(volume, camera),
                    "make the picture smaller (--size), or the volume with larger voxels");
  picture.light.writeShadows(volume, picture.lights, picture.medium, run);
  if (!picture.needsSamples()) volume.giveUpSamples();
  LivePicture live(picture.displayServer, options.files.output, picture.render);
  RenderResult result = picture.picture(volume, camera, run);
  picture.addSky(result.image, camera, picture.lights);
  const auto metadata = picture.metadata(run);
  run.begin("write");
  if (result.deep)
    writeExrPair({options.files.output, scene.deep}, result.image, *result.deep, camera, metadata);
  else
    writeExr(options.files.output, result.image, camera, metadata);
  if (!options.files.preview.empty()) writePng(options.files.preview, result.image, picture.screen, metadata);
  live.complete(result.image);
  live.finish(run);
  run.stats["values_not_finite"] = noteNotFinite(options.files.output, result.image, run);
  tellWork(result, run);
  run.stats["extinction"] = *picture.extinction;
  run.result(fmt::format("{}: {}x{}, extinction {:g} per world unit", options.files.output, camera.width(),
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

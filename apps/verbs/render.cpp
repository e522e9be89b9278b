#include <fmt/format.h>

#include "apps/options/live_picture.h"
#include "apps/options/object_options.h"
#include "apps/options/render_options.h"
#include "apps/options/shapes_picture.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/image/png_io.h"
#include "nephele/render/scene/backdrop.h"

namespace nephele::apps {
namespace {

struct RenderVerbOptions {
  std::vector<std::string> inputs;
  std::string output, preview, deep, holdout;
  ObjectOptions objects;
  PictureOptions picture;
};

void bindOptions(CLI::App& app, RenderVerbOptions& options) {
  app.add_option(
         "input", options.inputs,
         "Densities to look at (.vdb, .nvdb); where they overlap they add up. Or meshes and level sets "
         "alone, shaded quickly in a light of their own.")
      ->required()
      ->type_name("FILE");
  addOutput(app, "-o,--output", options.output, {".exr"}, "Picture to write: linear, premultiplied.")
      ->required();
  addOutput(app, "--preview", options.preview, {".png"}, "The same for the screen, before the sky.");
  addOutput(app, "--deep", options.deep, {".exr"},
            "The picture with depth: samples that give the picture when they are flattened.");
  app.add_option(
         "--holdout", options.holdout,
         "Deep picture (.exr) of what stands in front, for the same camera: of what is behind it only "
         "the share is kept that it lets through.")
      ->type_name("FILE");
  addPictureOptions(app, options.picture);
  addShadowOutput(app, options.picture.light);
  addObjectOptions(app, options.objects);
}

// What there is beside the volume, and depth.
void addOthers(const RenderVerbOptions& options, const RenderVolume& volume, const Camera& camera,
               PictureOptions& picture, const Run& run) {
  options.objects.addTo(picture, volume, run.memoryLimitBytes);
  if (!options.deep.empty()) picture.render.deep.emplace();
  if (!options.deep.empty() && picture.adaptiveThreshold > 0)
    refuseValue("--adaptive", fmt::format("{:g}", picture.adaptiveThreshold), "0 with --deep");
  if (!options.deep.empty()) picture.render.adaptiveThreshold = 0;
  if (!options.holdout.empty())
    picture.render.holdout = readHoldout(options.holdout, camera, run.memoryLimitBytes);
}

void renderVolume(const RenderVerbOptions& options, Run& run) {
  PictureOptions picture = options.picture.withView();
  if (areShapes(options.inputs))
    // Nothing is bright there, and textures are to look as they do.
    return writeShapesPicture(options.inputs, options.objects, options.picture.withView(ViewCurve::standard),
                              {options.output, options.preview}, run);
  RenderVolume volume =
      readVolumes(options.inputs, options.picture.volumes,
                  {options.picture.shutter, options.picture.readsCodes(), options.objects.any()}, run);
  if (volume.isEmpty()) run.note(options.inputs.front() + ": the volume is empty, and so is its picture");
  picture = picture.resolved(volume, run.memoryLimitBytes);
  const Camera camera = picture.camera(volume);
  addOthers(options, volume, camera, picture, run);
  run.requireMemory(double(volume.memoryBytes()) + picture.estimateBytes(volume, camera),
                    "make the picture smaller (--size), or the volume with larger voxels");
  picture.light.writeShadows(volume, picture.lights, picture.medium, run);
  if (!picture.needsSamples()) volume.giveUpSamples();
  LivePicture live(picture.displayServer, options.output, picture.render);
  RenderResult result = picture.picture(volume, camera, run);
  if (options.objects.backdrop) addBackdrop(result.image, camera, picture.lights);
  const auto metadata = picture.metadata(run);
  run.begin("write");
  if (result.deep)
    writeExrPair({options.output, options.deep}, result.image, *result.deep, camera, metadata);
  else
    writeExr(options.output, result.image, camera, metadata);
  if (!options.preview.empty()) writePng(options.preview, result.image, picture.screen, metadata);
  live.complete(result.image);
  live.finish(run);
  run.stats["values_not_finite"] = noteNotFinite(options.output, result.image, run);
  tellWork(result, run);
  run.stats["extinction"] = *picture.extinction;
  run.result(fmt::format("{}: {}x{}, extinction {:g} per world unit", options.output, camera.width(),
                         camera.height(), *picture.extinction));
}

}  // namespace

Verb renderVerb() {
  return verbOf("render",
                "Makes a picture of a density (a cloud, smoke, any fog volume), or a quick one of meshes.",
                "nephele render cloud.vdb -o cloud.exr --preview cloud.png --view 25,5 --sun 90,38",
                bindOptions, renderVolume);
}

}  // namespace nephele::apps

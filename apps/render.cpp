#include <fmt/format.h>

#include <memory>

#include "apps/render_options.h"
#include "render/exr_io.h"
#include "render/png_io.h"

namespace nephele::apps {
namespace {

struct RenderVerbOptions {
  std::string input, output, preview;
  PictureOptions picture;
};

void bindOptions(CLI::App& app, RenderVerbOptions& options) {
  app.add_option("input", options.input, "Density to look at (.vdb, .nvdb).")->required()->type_name("FILE");
  addOutput(app, "-o,--output", options.output, {".exr"}, "Picture to write: linear, premultiplied.")
      ->required();
  addOutput(app, "--preview", options.preview, {".png"}, "The same for the screen, before the sky.");
  addPictureOptions(app, options.picture);
}

void renderVolume(const RenderVerbOptions& options, Run& run) {
  const RenderVolume volume = readDensity(options.input, options.picture.grid, run);
  if (volume.isEmpty()) run.note(options.input + ": the volume is empty, and so is its picture");
  const PictureOptions picture = options.picture.resolved(volume);
  const Camera camera = picture.camera(volume);
  run.requireMemory(
      double(volume.memoryBytes()) + estimateRenderBytes(volume, picture.lights, camera, picture.render),
      "make the picture smaller (--size), or the volume with larger voxels");

  const RenderResult result =
      renderImage(volume, picture.medium, picture.lights, camera, picture.render, run);
  run.begin("write");
  auto metadata = run.metadata();
  metadata["seed"] = std::to_string(picture.render.seed);
  metadata["extinction"] = fmt::format("{:g}", *picture.extinction);
  writeExr(options.output, result.image, camera, metadata);
  if (!options.preview.empty()) writePng(options.preview, result.image, picture.screen, metadata);

  run.stats["rays"] = result.rays;
  run.stats["samples"] = result.samples;
  run.stats["light_seconds"] = result.lightSeconds;
  run.stats["march_seconds"] = result.marchSeconds;
  run.stats["extinction"] = *picture.extinction;
  run.result(fmt::format("{}: {}x{}, extinction {:g} per world unit", options.output, camera.width(),
                         camera.height(), *picture.extinction));
}

}  // namespace

Verb renderVerb() {
  const auto options = std::make_shared<RenderVerbOptions>();
  return {"render", "Makes a picture of a density: a cloud, smoke, any fog volume.",
          "nephele render cloud.vdb -o cloud.exr --preview cloud.png --view 25,5 --sun 90,38",
          [options](CLI::App& app) { bindOptions(app, *options); },
          [options](Run& run) { renderVolume(*options, run); }};
}

}  // namespace nephele::apps

#include <fmt/format.h>

#include <algorithm>

#include "apps/detail/turntable_scene.h"
#include "apps/options/picture/live_picture.h"
#include "nephele/modeling/base/error.h"

namespace nephele::apps {
namespace {

void bindOptions(CLI::App& app, TurntableOptions& options) {
  addSceneInputs(
      app, options.scene,
      "Densities to look at (.vdb, .nvdb); where they overlap they add up. A name with ####, %04d or $F4 "
      "is a volume for each frame.");
  CLI::Option* output = addOutput(
      app, "-o,--output", options.output, {".exr"},
      "Pictures to write; ####, %04d or $F4 in the name stands for the frame number.", OutputTrial::verb);
  app.add_option("--frames", options.frames,
                 "Frames to make: 1-48, 1001-1100x2,1150. The turn takes from the first to the last of them.")
      ->required()
      ->type_name("FRAMES");
  addOutput(app, "--preview", options.preview, {".png"}, "The same for the screen, named like the output.",
            OutputTrial::verb);
  addNumber(app, "--turns", options.turns, -1000, 1000, "Turns from the first frame to the last.");
  addChoice<Orbit>(
      app, "--orbit", options.orbit,
      {{"camera", Orbit::camera}, {"model", Orbit::model}, {"light", Orbit::light}},
      "What turns: the camera around the cloud, the cloud before camera and lights, or the lights.");
  CLI::Option* movie = addOutput(app, "--movie", options.movie, {".mp4", ".mov", ".mkv"},
                                 "Movie of all frames, H.264; needs the program ffmpeg.", OutputTrial::verb);
  addNumber(app, "--fps", options.movieOptions.framesPerSecond, 0.1, 1000, "Frames per second of the movie.")
      ->needs(movie);
  addOutput(app, "--contact-sheet", options.contactSheet, {".png"}, "All frames, small, on one picture.",
            OutputTrial::verb);
  app.add_flag("--skip-existing", options.skipExisting,
               "Keep the frames that are there and whole; without it all are made again.")
      ->needs(output);
  app.add_option("--only", options.only, "Make only those of --frames that are in this range, too.")
      ->type_name("FRAMES");
  app.add_option("--shard", options.shard, "Make the share of machine I of N (from 1): every N-th frame.")
      ->type_name("I/N");
  addPictureOptions(app, options.picture);
  addSceneOptions(app, options.scene, OutputTrial::verb);
  requireOneOutput(app, {"--output", "--preview", "--movie", "--contact-sheet", "--deep"});
  options.app = &app;
}

// The camera of the first frame, which frames all that any frame shows. The shutter and what it blurs come
// later.
Camera firstCamera(const TurntableOptions& options, const PictureOptions& picture) {
  CameraOptions camera = picture;
  if (options.orbit != Orbit::light && !camera.seen.box.isEmpty())
    camera.seen.outline = sweptOutline(camera.seen.outline, camera.seen.box.center());
  if (camera.file.empty()) {
    camera.shutter = {};
    camera.volumeMotion.reset();
  }
  return camera.camera();
}

void makeTurntable(const TurntableOptions& options, Run& run) {
  if (options.turns == 0) refuseValue("--turns", "0", "a number from -1000 to 1000 that is not 0");
  TurntablePlan plan(options, run);
  if (plan.frames.empty()) return run.note("no frame of --frames is in this share; nothing to do");
  PictureOptions picture = options.picture.withView();
  prepareFolders(options, plan);
  plan.measure(picture, run);
  plan.setDigests(run);
  noteColouredHoldout(options.scene, picture, run);
  run.expect(0, 0.05, 4);
  LivePicture live(picture.displayServer, options.name(), picture.render);
  TurntableScene scene(options, picture, plan.frames.front(), run);
  const Camera start = firstCamera(options, scene.picture());
  const int width = start.window().width(), height = start.window().height();
  scene.requireMemory(start, run);
  if (!options.movie.empty()) MovieWriter::tryOut(options.movie, width, height, options.movieOptions);
  if (options.skipExisting) skipExisting(plan, start, run);
  makeFrames(plan, options, scene, start, live, run);
  const float extinction = *scene.picture().extinction;
  run.stats["extinction"] = extinction;
  run.result(fmt::format("{}: {} frames, {} of them skipped, {}x{}, extinction {:g} per world unit",
                         options.name(), plan.frames.size(),
                         std::ranges::count_if(plan.frames, &TurntableFrame::skipped), width, height,
                         extinction));
}

}  // namespace

Verb turntableVerb() {
  return verbOf("turntable", "Makes the frames of a turn around a density, and a movie of them.",
                "nephele turntable cloud.vdb -o frames/cloud.####.exr --frames 1-48 --movie cloud.mp4",
                bindOptions, makeTurntable);
}

}  // namespace nephele::apps

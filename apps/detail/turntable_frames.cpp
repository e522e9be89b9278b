// Frames, movie and contact sheet of the verb turntable.
//
// The light is made once where it does not move as the volume sees it, and the sky's part of it once in any
// case. The movie and the sheet are made of the files in the end, so that they are the same whether frames
// were made now or by an earlier call.
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <atomic>
#include <chrono>
#include <future>

#include "apps/detail/turntable_plan.h"
#include "apps/options/live_picture.h"
#include "nephele/modeling/base/error.h"
#include "nephele/render/image/contact_sheet.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/image/png_io.h"

namespace nephele::apps {
namespace {

// Poses of a camera that turns while its shutter is open.
constexpr int kPoses = 5;

double secondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// The part that one frame has in the progress of all.
class FrameProgress : public SubProgress {
 public:
  FrameProgress(const Progress& whole, std::size_t done, std::size_t count)
      : SubProgress(whole, double(done) / double(count), double(done + 1) / double(count)) {}

  // Light takes a small part of a frame, where it is made for each at all.
  void begin(std::string_view stage) const override { isPicture_ = stage == "march" || stage == "trace"; }
  void advance(double fraction) const override {
    if (isPicture_) SubProgress::advance(fraction);
  }

 private:
  mutable std::atomic<bool> isPicture_{false};
};

// Makes one frame after another of a volume.
class FrameMaker {
 public:
  FrameMaker(const PictureOptions& picture, const RenderVolume& volume, const Turntable& turntable,
             const Camera& start, const Progress& progress)
      : picture_(picture), volume_(volume), turntable_(turntable), start_(start) {
    if (!picture.pathTraced && !turntable.lightsMove())
      light_.emplace(volume, picture.medium, picture.lights, picture.render.octaves, progress,
                     picture.render.surfaces);
    lightSeconds_ = light_ ? light_->lightSeconds() : 0;
  }

  Camera camera(int frame) const {
    const Camera camera = turntable_.camera(start_, frame);
    const Shutter& shutter = picture_.shutter;
    if (shutter.isInstant() || start_.isMoving() || !turntable_.cameraMoves()) return camera;
    std::vector<Camera> poses;
    for (int i = 0; i != kPoses; ++i)
      poses.push_back(turntable_.camera(
          start_, frame + shutter.open + (shutter.close - shutter.open) * i / (kPoses - 1)));
    return camera.withShutter(poses);
  }

  RenderResult make(int frame, const Camera& camera, const std::shared_ptr<const Holdout>& holdout,
                    const Progress& progress) {
    if (picture_.pathTraced) {
      PictureOptions picture = picture_;
      picture.render.holdout = holdout;
      picture.lights = turntable_.lights(picture_.lights, frame);
      if (picture_.shutter.isInstant()) picture.render.nextCamera = turntable_.camera(start_, frame + 1);
      return picture.picture(volume_, camera, progress);
    }
    if (turntable_.lightsMove()) {
      const Lights lights = turntable_.lights(picture_.lights, frame);
      light_ = light_ ? light_->underOther(lights, progress)
                      : LitVolume(volume_, picture_.medium, lights, picture_.render.octaves, progress,
                                  picture_.render.surfaces);
      lightSeconds_ += light_->lightSeconds();
    }
    RenderOptions options = picture_.marched(camera);
    options.holdout = holdout;
    if (picture_.shutter.isInstant()) options.nextCamera = turntable_.camera(start_, frame + 1);
    return light_->render(camera, options, progress);
  }

  double lightSeconds() const { return lightSeconds_; }

 private:
  const PictureOptions& picture_;
  const RenderVolume& volume_;
  const Turntable& turntable_;
  const Camera& start_;
  std::optional<LitVolume> light_;
  double lightSeconds_ = 0;
};

// Writes a frame while the next one is made, where more than one thread may run.
class FrameWriter {
 public:
  explicit FrameWriter(const ViewTransform& screen) : screen_(screen) {}

  // Returns when the frame before is written. @throws Error if that failed.
  void write(const TurntableFrame& frame, Image image, std::optional<DeepImage> deep, const Camera& camera,
             std::map<std::string, std::string> metadata) {
    finish();
    auto task = [this, &frame, camera, image = std::move(image), deep = std::move(deep),
                 metadata = std::move(metadata)] {
      if (deep)
        writeExrPair({frame.path, frame.deep}, image, *deep, camera, metadata);
      else
        writeExr(frame.path, image, camera, metadata);
      if (!frame.preview.empty()) writePng(frame.preview, image, screen_, metadata);
    };
    if (tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism) == 1)
      task();
    else
      written_ = std::async(std::launch::async, std::move(task));
  }
  void finish() {
    if (written_.valid()) written_.get();
  }

 private:
  const ViewTransform& screen_;
  std::future<void> written_;
};

std::map<std::string, std::string> metadataOf(const PictureOptions& picture, const Run& run, int frame) {
  auto metadata = picture.metadata(run);
  metadata["frame"] = std::to_string(frame);
  return metadata;
}

}  // namespace

void makeFrames(TurntablePlan& plan, const TurntableOptions& options, const PictureOptions& given,
                const RenderVolume& volume, const Camera& start, Run& run) {
  PictureOptions picture = given;
  LivePicture live(picture.displayServer, options.output, picture.render);
  const Vec3f middle = volume.isEmpty() ? Vec3f{} : volume.worldBounds().center();
  const Turntable turntable(options.orbit, middle, plan.first, plan.last, options.turns);
  std::vector<TurntableFrame*> missing;
  for (TurntableFrame& frame : plan.frames) {
    if (frame.skipped && !frame.preview.empty() && !frame.previewSkipped)
      writePng(frame.preview, readImage(frame.path), picture.screen, metadataOf(picture, run, frame.number));
    if (!frame.skipped) missing.push_back(&frame);
  }
  double marchSeconds = 0;
  std::uint64_t rays = 0, samples = 0, deepSamples = 0;
  std::size_t notFinite = 0;
  FrameWriter writer(picture.screen);
  std::optional<FrameMaker> maker;
  if (!missing.empty()) maker.emplace(picture, volume, turntable, start, run);
  run.expect(0.05, options.movie.empty() && options.contactSheet.empty() ? 1.0 : 0.95);
  run.begin("frames");
  for (std::size_t i = 0; i != missing.size(); ++i) try {
      TurntableFrame& frame = *missing[i];
      const auto began = std::chrono::steady_clock::now();
      const FrameProgress progress(run, i, missing.size());
      const Camera camera = maker->camera(frame.number);
      const auto holdout =
          frame.holdout.empty() ? nullptr : readHoldout(frame.holdout, camera, run.memoryLimitBytes);
      RenderResult result = maker->make(frame.number, camera, holdout, progress);
      picture.addSky(result.image, camera, turntable.lights(picture.lights, frame.number));
      live.complete(result.image);
      // Also where a frame has no work that would ask.
      run.check();
      notFinite += noteNotFinite(frame.path, result.image, run);
      auto metadata = metadataOf(picture, run, frame.number);
      metadata[kPartDigest] = plan.digest;
      deepSamples += result.deep ? result.deep->sampleCount() : 0;
      writer.write(frame, std::move(result.image), std::move(result.deep), camera, std::move(metadata));
      if (i + 1 == missing.size()) writer.finish();
      frame.seconds = secondsSince(began);
      marchSeconds += result.marchSeconds;
      rays += result.rays;
      samples += result.samples;
      run.advance(double(i + 1) / double(missing.size()));
    } catch (const Cancelled&) {
      writer.finish();
      run.note(fmt::format("stopped after {} of {} frames; the same call with --skip-existing makes the rest",
                           i, missing.size()));
      throw;
    }
  live.finish(run);
  run.count("frames", double(missing.size()));
  run.stats["values_not_finite"] = notFinite;
  run.stats["rays"] = rays;
  run.stats["samples"] = samples;
  if (!options.scene.deep.empty()) run.stats["deep_samples"] = deepSamples;
  run.stats["light_seconds"] = maker ? maker->lightSeconds() : 0.0;
  run.stats["march_seconds"] = marchSeconds;
}

void makeMovieAndSheet(const TurntablePlan& plan, const TurntableOptions& options,
                       const PictureOptions& picture, Run& run) {
  if (options.movie.empty() && options.contactSheet.empty()) return;
  run.expect(0.95, 1.0);
  run.begin("movie");
  std::optional<MovieWriter> movie;
  std::optional<ContactSheet> sheet;
  int place = 0;
  const int count = int(plan.frames.size());
  for (int i = 0; i != count; ++i) {
    run.check();
    const Image image = readImage(plan.frames[std::size_t(i)].path);
    if (!options.movie.empty()) {
      if (!movie) movie.emplace(options.movie, image.width, image.height, options.movieOptions);
      movie->add(image, picture.screen);
    }
    if (!options.contactSheet.empty()) {
      if (!sheet) sheet.emplace(count, image.width, image.height);
      if (place < int(sheet->shown().size()) && sheet->shown()[std::size_t(place)] == i)
        sheet->set(place++, image);
    }
    run.advance((i + 1.0) / count);
  }
  if (movie) movie->finish();
  if (sheet) writePng(options.contactSheet, sheet->image(), picture.screen, run.metadata());
}

}  // namespace nephele::apps

// Frames, movie and contact sheet of the verb turntable.
//
// The light is made once for each volume where it does not move as the volume sees it, and the sky's part of
// it once in any case; with a script that is sampled anew, anew. The movie and the sheet are made of the
// files in the end, so that they are the same whether frames were made now or by an earlier call; or of the
// frames as they are made, rounded as files would, where there are to be no files.
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <future>

#include "apps/detail/turntable_scene.h"
#include "apps/options/picture/live_picture.h"
#include "apps/options/picture/picture_files.h"
#include "nephele/modeling/base/error.h"
#include "nephele/render/image/contact_sheet.h"
#include "nephele/render/image/deep_image.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/image/png_io.h"
#include "nephele/render/scene/backdrop.h"
#include "nephele/render/session/picture_stages.h"

namespace nephele::apps {
namespace {

// Poses of a camera that turns while its shutter is open.
constexpr int kPoses = 5;

double secondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void roundAsFile(Image::Channel& channel) {
  for (float& value : channel.values) value = std::isnan(value) ? 0.0f : roundedToHalf(value);
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

// Makes one frame after another.
class FrameMaker {
 public:
  FrameMaker(TurntableScene& scene, const Turntable& turntable, const Camera& start, const Run& run)
      : scene_(scene), turntable_(turntable), start_(start), run_(run) {}

  // Whether nothing is left to be done before the picture of `frame`.
  bool isReadyFor(const TurntableFrame& frame) const { return scene_.isOf(frame) && isReady_; }

  void prepare(const TurntableFrame& frame, Run& run) {
    if (!scene_.isOf(frame)) {
      // They refer to the volume.
      stages_.forget();
      scene_.turnTo(frame, run);
      scene_.requireMemory(start_, run);
    }
    sampleFor(camera(frame.number), run);
    const PictureOptions& picture = scene_.picture();
    if (!picture.pathTraced && !turntable_.lightsMove()) makeLight(picture.lights, "still", run);
    isReady_ = true;
  }

  const PictureOptions& picture() const { return scene_.picture(); }
  Lights lights(int frame) const { return turntable_.lights(scene_.picture().lights, frame); }

  Camera camera(int frame) const {
    const Camera camera = turntable_.camera(start_, frame);
    const Shutter& shutter = scene_.picture().shutter;
    if (shutter.isInstant() || start_.isMoving() || !turntable_.cameraMoves()) return camera;
    std::vector<Camera> poses;
    for (int i = 0; i != kPoses; ++i)
      poses.push_back(turntable_.camera(
          start_, frame + shutter.open + (shutter.close - shutter.open) * i / (kPoses - 1)));
    return camera.withShutter(poses);
  }

  RenderResult make(int frame, const Camera& camera, const std::shared_ptr<const Holdout>& holdout,
                    const Progress& progress) {
    sampleFor(camera, progress);
    const PictureOptions& picture = scene_.picture();
    if (picture.pathTraced) {
      PictureOptions own = picture;
      own.render.holdout = holdout;
      own.lights = lights(frame);
      if (picture.shutter.isInstant()) own.render.nextCamera = turntable_.camera(start_, frame + 1);
      return own.picture(scene_.volume(), camera, progress);
    }
    const LitVolume& light = makeLight(
        lights(frame), turntable_.lightsMove() ? fmt::format("frame {}", frame) : "still", progress);
    RenderOptions options = picture.marched(camera);
    options.holdout = holdout;
    if (picture.shutter.isInstant()) options.nextCamera = turntable_.camera(start_, frame + 1);
    return light.render(camera, options, progress);
  }

  double lightSeconds() const { return lightSeconds_; }
  float voxelSize() const { return scene_.volume().density().voxelSize(); }

 private:
  // What is looked at, as this camera shows it; with other voxels, the light of before is of no use.
  void sampleFor(const Camera& camera, const Progress& progress) {
    const std::optional<float> voxelSize = scene_.otherVoxels(camera, progress);
    if (!voxelSize) return;
    stages_.forget();
    scene_.resample(*voxelSize, progress);
    scene_.requireMemory(camera, run_);
  }

  // The light under these, which are called so, unless it is there.
  const LitVolume& makeLight(const Lights& lights, const std::string& key, const Progress& progress) {
    const PictureOptions& picture = scene_.picture();
    const bool isThere = stages_.isLit({"", "", "", "", key});
    stages_.volume("", std::shared_ptr<const RenderVolume>(std::shared_ptr<void>(), &scene_.volume()));
    const auto lit = stages_.light(
        "", key, {picture.medium, lights, picture.render.octaves, picture.render.surfaces}, progress);
    if (!isThere) lightSeconds_ += lit->light.lightSeconds();
    return lit->light;
  }

  TurntableScene& scene_;
  const Turntable& turntable_;
  const Camera& start_;
  const Run& run_;
  PictureStages stages_;
  bool isReady_ = false;
  double lightSeconds_ = 0;
};

// The movie and the contact sheet of all frames, one after the other.
class Reel {
 public:
  Reel(const TurntableOptions& options, int count, const ViewTransform& screen)
      : options_(options), count_(count), screen_(screen) {}

  bool isWanted() const { return !options_.movie.empty() || !options_.contactSheet.empty(); }

  void add(const Image& image) {
    if (!options_.movie.empty()) {
      if (!movie_) movie_.emplace(options_.movie, image.width, image.height, options_.movieOptions);
      movie_->add(image, screen_);
    }
    if (!options_.contactSheet.empty()) {
      if (!sheet_) sheet_.emplace(count_, image.width, image.height);
      if (place_ < sheet_->shown().size() && sheet_->shown()[place_] == frame_)
        sheet_->set(int(place_++), image);
    }
    ++frame_;
  }

  void addAsFile(Image image) {
    for (Image::Channel& channel : image.channels)
      if (channel.half) roundAsFile(channel);
    add(image);
  }

  void finish(const std::map<std::string, std::string>& metadata) {
    if (movie_) movie_->finish();
    if (sheet_) writePng(options_.contactSheet, sheet_->image(), screen_, metadata);
  }

 private:
  const TurntableOptions& options_;
  const int count_;
  const ViewTransform& screen_;
  std::optional<MovieWriter> movie_;
  std::optional<ContactSheet> sheet_;
  int frame_ = 0;
  std::size_t place_ = 0;
};

void writePreview(const TurntableFrame& frame, const Image& image, const ViewTransform& screen,
                  std::map<std::string, std::string> metadata) {
  metadata[kPartDigest] = frame.previewDigest;
  writePng(frame.preview, image, screen, metadata);
}

// Writes a frame while the next one is made, where more than one thread may run.
class FrameWriter {
 public:
  FrameWriter(const ViewTransform& screen, Reel& reel) : screen_(screen), reel_(reel) {}

  // Returns when the frame before is written. @throws Error if that failed.
  void write(const TurntableFrame& frame, RenderResult picture, const Camera& camera,
             std::map<std::string, std::string> metadata) {
    finish();
    auto task = [this, &frame, camera, picture = std::move(picture),
                 metadata = std::move(metadata)]() mutable {
      metadata[kPartDigest] = frame.digest;
      PictureFiles{frame.path, "", frame.deep}.write(picture, camera, screen_, metadata);
      if (!frame.preview.empty()) writePreview(frame, picture.image, screen_, std::move(metadata));
      if (frame.path.empty() && reel_.isWanted()) reel_.addAsFile(picture.image);
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
  Reel& reel_;
  std::future<void> written_;
};

std::map<std::string, std::string> metadataOf(const PictureOptions& picture, const Run& run, int frame) {
  auto metadata = picture.metadata(run);
  metadata["frame"] = std::to_string(frame);
  return metadata;
}

// Reads a frame as it is to be shown: whether it was written with a backdrop was up to another call.
Image readShown(const TurntableFrame& frame, const FrameMaker& maker) {
  Image image = readImage(frame.path);
  const auto isBackdrop = [](const Image::Channel& channel) { return channel.name.starts_with("backdrop."); };
  const bool hasBackdrop = std::ranges::any_of(image.channels, isBackdrop);
  if (hasBackdrop && !maker.picture().backdrop) std::erase_if(image.channels, isBackdrop);
  if (hasBackdrop || !maker.picture().backdrop) return image;
  addBackdrop(image, maker.camera(frame.number), maker.lights(frame.number));
  for (Image::Channel& channel : image.channels)
    if (isBackdrop(channel)) roundAsFile(channel);
  return image;
}

void makeReel(const TurntablePlan& plan, const TurntableOptions& options, const FrameMaker& maker, Reel& reel,
              Run& run) {
  if (!reel.isWanted()) return;
  if (!options.output.empty()) {
    run.expect(0.95, 1.0);
    run.begin("movie");
    for (std::size_t i = 0; i != plan.frames.size(); ++i) {
      run.check();
      reel.add(readShown(plan.frames[i], maker));
      run.advance(double(i + 1) / double(plan.frames.size()));
    }
  }
  reel.finish(run.metadata());
}

}  // namespace

void makeFrames(TurntablePlan& plan, const TurntableOptions& options, TurntableScene& scene,
                const Camera& start, LivePicture& live, Run& run) {
  const Box& box = scene.picture().seen.box;
  const Turntable turntable(options.orbit, box.isEmpty() ? Vec3f{} : box.center(), plan.first(), plan.last(),
                            options.turns);
  // The same for all volumes.
  const ViewTransform screen = scene.picture().screen;
  std::vector<TurntableFrame*> missing;
  FrameMaker maker(scene, turntable, start, run);
  for (TurntableFrame& frame : plan.frames) {
    if (frame.skipped && !frame.preview.empty() && !frame.previewSkipped)
      writePreview(frame, readShown(frame, maker), screen, metadataOf(scene.picture(), run, frame.number));
    if (!frame.skipped) missing.push_back(&frame);
  }
  double marchSeconds = 0;
  std::uint64_t rays = 0, samples = 0, deepSamples = 0;
  std::size_t notFinite = 0;
  Reel reel(options, int(plan.frames.size()), screen);
  FrameWriter writer(screen, reel);
  const double end = reel.isWanted() && !options.output.empty() ? 0.95 : 1.0;
  // The stage of frames begins anew behind every new volume.
  std::size_t stageBegin = 0;
  for (std::size_t i = 0; i != missing.size(); ++i) try {
      TurntableFrame& frame = *missing[i];
      const auto began = std::chrono::steady_clock::now();
      if (!maker.isReadyFor(frame)) {
        const double share = (end - 0.05) / double(missing.size()), from = 0.05 + share * double(i);
        if (i > 0) run.expect(from, from + 0.5 * share, 4);
        maker.prepare(frame, run);
        stageBegin = i;
        run.expect(from, end);
        run.begin("frames");
      }
      const PictureOptions& picture = scene.picture();
      const FrameProgress progress(run, i - stageBegin, missing.size() - stageBegin);
      const Camera camera = maker.camera(frame.number);
      const auto holdout =
          frame.holdout.empty() ? nullptr : readHoldout(frame.holdout, camera, run.memoryLimitBytes);
      RenderResult result = maker.make(frame.number, camera, holdout, progress);
      picture.addSky(result.image, camera, maker.lights(frame.number));
      live.complete(result.image);
      // Also where a frame has no work that would ask.
      run.check();
      notFinite += noteNotFinite(
          frame.path.empty() ? fmt::format("{}: frame {}", options.name(), frame.number) : frame.path,
          result.image, run);
      auto metadata = metadataOf(picture, run, frame.number);
      deepSamples += result.deep ? result.deep->sampleCount() : 0;
      marchSeconds += result.marchSeconds;
      rays += result.rays;
      samples += result.samples;
      writer.write(frame, std::move(result), camera, std::move(metadata));
      if (i + 1 == missing.size()) writer.finish();
      frame.seconds = secondsSince(began);
      frame.voxelSize = maker.voxelSize();
      run.advance(double(i + 1 - stageBegin) / double(missing.size() - stageBegin));
    } catch (const Cancelled&) {
      writer.finish();
      run.note(
          fmt::format("stopped after {} of {} frames{}", i, missing.size(),
                      options.output.empty() ? "" : "; the same call with --skip-existing makes the rest"));
      throw;
    }
  live.finish(run);
  run.count("frames", double(missing.size()));
  run.stats["values_not_finite"] = notFinite;
  run.stats["rays"] = rays;
  run.stats["samples"] = samples;
  if (!options.scene.deep.empty()) run.stats["deep_samples"] = deepSamples;
  run.stats["light_seconds"] = maker.lightSeconds();
  run.stats["march_seconds"] = marchSeconds;
  for (const TurntableFrame& frame : plan.frames) {
    nlohmann::json made{{"frame", frame.number}, {"seconds", frame.seconds}, {"skipped", frame.skipped}};
    if (!frame.skipped) made["voxel_size"] = frame.voxelSize;
    run.stats["frames"].push_back(std::move(made));
  }
  makeReel(plan, options, maker, reel, run);
}

}  // namespace nephele::apps

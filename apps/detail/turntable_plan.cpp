// What a call of the verb turntable has to make, and what of it is there already.
#include "apps/detail/turntable_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <string_view>

#include "apps/options_digest.h"
#include "apps/sequence.h"
#include "nephele/levelset/io/output_file.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/render/image/exr_io.h"

namespace nephele::apps {
namespace {

// Calls `parse`; its Error becomes a usage error of `option`.
template <class Parse>
auto parsed(const std::string& option, const Parse& parse) {
  try {
    return parse();
  } catch (const Error& error) {
    throw CLI::ValidationError(option, error.what());
  }
}

// Nothing where there is no `text`.
std::optional<FramePattern> patternOf(const std::string& option, const std::string& text) {
  if (text.empty()) return std::nullopt;
  return parsed(option, [&] { return FramePattern::parse(text); });
}

// What a frame does not depend on, or only by its number; and what only its preview does.
constexpr std::string_view kNotOfFrames[]{"frames", "fps", "only", "shard"};
constexpr std::string_view kOfPreviews[]{"exposure", "view-transform", "ocio-config", "background"};

// Why `path` is not a whole picture of the `window` of `camera`; "" if it is.
std::string defect(const std::string& path, const PixelBox& window, const std::string& digest) {
  try {
    const std::string found = outputDigest(path);
    const Image image = readImage(path);
    for (const char* name : {"R", "G", "B"})
      if (!image.find(name)) return fmt::format("has no channel {}", name);
    if (image.width != window.width() || image.height != window.height())
      return fmt::format("is {}x{} and not {}x{}", image.width, image.height, window.width(),
                         window.height());
    return found == digest ? "" : kOtherDigest;
  } catch (const Error& error) {
    return fmt::format("is not whole ({})", error.what());
  }
}

}  // namespace

const std::string& TurntableOptions::name() const {
  for (const std::string* file : {&output, &movie, &contactSheet, &preview})
    if (!file->empty()) return *file;
  return scene.deep;
}

TurntablePlan::TurntablePlan(const TurntableOptions& options, Run& run)
    : options_(options), range_(parsed("--frames", [&] { return FrameRange::parse(options.frames); })) {
  checkSheets();
  const auto output = patternOf("--output", options.output),
             preview = patternOf("--preview", options.preview);
  const std::vector<int> numbers = chosenFrames(range_, options.only, options.shard);
  const auto deep = patternOf("--deep", options.scene.deep);
  const std::string& holdout = options.scene.holdout;
  // One for all will do where nothing but the light moves.
  const auto holdouts = FramePattern::places(holdout) == 0 ? std::nullopt : patternOf("--holdout", holdout);
  const auto holdoutOf = [&](int number) { return holdouts ? holdouts->path(number) : holdout; };
  for (const int number : numbers)
    frames.push_back({number, output ? output->path(number) : "", preview ? preview->path(number) : "",
                      deep ? deep->path(number) : "", holdoutOf(number)});
  if (!holdout.empty()) requireFrames(holdout, numbers, holdoutOf);
  for (const TurntableFrame& frame : frames)
    if (!options.contactSheet.empty() && options.contactSheet == frame.preview)
      refuseValue("--contact-sheet", options.contactSheet, "another file than that of a frame of --preview");
    else if (!frame.deep.empty() && (frame.deep == frame.path || frame.deep == frame.holdout))
      refuseValue("--deep", options.scene.deep, "another file than those of --output and --holdout");
  if (!frames.empty()) findVolumes(run);
}

void TurntablePlan::checkSheets() const {
  for (const auto& [name, path] :
       {std::pair{"--movie", options_.movie}, {"--contact-sheet", options_.contactSheet}})
    for (const auto& [other, value] : {std::pair{"--shard", options_.shard}, {"--only", options_.only}})
      if (!path.empty() && !value.empty())
        throw CLI::ValidationError(name,
                                   fmt::format("shows all frames, and {} makes some of them; when all are "
                                               "there, call again with --skip-existing and without {}",
                                               other, other));
}

void TurntablePlan::findVolumes(Run& run) {
  for (const std::string& input : options_.scene.inputs) {
    // Where such a file is there, the sign is as good a letter as any.
    const bool isPattern = FramePattern::places(input) != 0 && !std::filesystem::exists(input);
    const auto& pattern = inputs_.emplace_back(isPattern ? patternOf("input", input) : std::nullopt);
    if (pattern) requireFrames(input, range_.frames(), [&](int frame) { return pattern->path(frame); });
  }
  for (const auto& pattern : inputs_)
    if (pattern)
      requireSameGrids(
          range_.frames(), [&](int frame) { return pattern->path(frame); }, run);
  SceneOptions scene = options_.scene;
  scene.inputs = inputsOf(first());
  changesWithTime_ = scene.changesWithTime(options_.picture);
  for (TurntableFrame& frame : frames) {
    frame.inputs = inputsOf(frame.number);
    frame.volumeKey = volumeKeyOf(frame.number, run);
  }
}

bool TurntablePlan::volumeChanges() const {
  return changesWithTime_ ||
         std::ranges::any_of(inputs_, [](const auto& pattern) { return pattern.has_value(); });
}

std::vector<std::string> TurntablePlan::inputsOf(int frame) const {
  std::vector<std::string> paths = options_.scene.inputs;
  for (std::size_t i = 0; i != paths.size(); ++i)
    if (inputs_[i]) paths[i] = inputs_[i]->path(frame);
  return paths;
}

std::string TurntablePlan::filesKeyOf(int frame, Run& run) const {
  ContentHash hash;
  for (const std::string& path : inputsOf(frame)) hash.add(run.files.of(path));
  return hash.text();
}

std::string TurntablePlan::volumeKeyOf(int frame, Run& run) const {
  if (!volumeChanges()) return "";
  return filesKeyOf(frame, run) + (changesWithTime_ ? fmt::format(" {}", frame) : "");
}

void TurntablePlan::measure(const PictureOptions& picture, Run& run) const {
  if (!volumeChanges()) return;
  std::optional<Extent> all;
  std::set<std::string> measured;
  // Other colours are as large.
  const bool isScripted = isScript(inputsOf(first()));
  run.expect(0, 0.05, int(range_.frames().size()));
  for (const int frame : range_.frames()) {
    run.check();
    if (!measured.insert(isScripted ? volumeKeyOf(frame, run) : filesKeyOf(frame, run)).second) continue;
    SceneOptions scene = options_.scene;
    scene.inputs = inputsOf(frame);
    run.part = Run::Part{.frame = frame};
    const bool stands = options_.orbit == Orbit::light;
    const Extent one = stands ? scene.extent(picture, run) : scene.measured(picture, run);
    all ? all->include(one) : void(all = one);
    if (!stands) all->outline = sweptCorners(all->outline);
  }
  run.part = Run::Part{.range = all};
}

std::string TurntablePlan::digestWithout(const std::vector<std::string_view>& options, Run& run) const {
  return optionsDigest(
      *options_.app, options,
      fmt::format("{}-{}{}", first(), last(), volumeChanges() ? run.part->range->text() : ""), run.files);
}

void TurntablePlan::setDigests(Run& run) {
  std::vector<std::string_view> others(std::begin(kNotOfFrames), std::end(kNotOfFrames));
  const bool changes = volumeChanges(), hidesAnew = FramePattern::places(options_.scene.holdout) != 0;
  if (changes) others.push_back("input");
  if (hidesAnew) others.push_back("holdout");
  const std::string ofPreviews = digestWithout(others, run);
  others.insert(others.end(), std::begin(kOfPreviews), std::end(kOfPreviews));
  const std::string ofFrames = digestWithout(others, run);
  for (TurntableFrame& frame : frames) {
    const auto digestOf = [&](const std::string& all) {
      ContentHash hash;
      hash.add(fmt::format("{} {}", all, frame.number));
      hash.add(frame.volumeKey);
      if (hidesAnew) hash.add(run.files.of(frame.holdout));
      return hash.text();
    };
    frame.digest = digestOf(ofFrames);
    frame.previewDigest = digestOf(ofPreviews);
  }
}

void prepareFolders(const TurntableOptions& options, const TurntablePlan& plan) {
  std::vector<std::string> paths{options.movie, options.contactSheet};
  if (!plan.frames.empty()) {
    paths.push_back(plan.frames.front().path);
    paths.push_back(plan.frames.front().preview);
    paths.push_back(plan.frames.front().deep);
  }
  for (const std::string& path : paths) {
    if (path.empty()) continue;
    const std::filesystem::path folder = std::filesystem::path(path).parent_path();
    std::error_code error;
    if (!folder.empty()) std::filesystem::create_directories(folder, error);
    require(!error, fmt::format("cannot write {}: the folder cannot be made: {}", path, error.message()));
    const OutputFile trial(path);
  }
}

void skipExisting(TurntablePlan& plan, const Camera& camera, const Run& run) {
  run.begin("check");
  parallelFor(
      plan.frames.size(), 1,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i != end; ++i) {
          TurntableFrame& frame = plan.frames[i];
          const auto isWhole = [&](const std::string& path, const std::string& digest) {
            if (path.empty() || !std::filesystem::exists(path)) return false;
            const std::string what =
                path == frame.deep ? outputDefect(path, digest) : defect(path, camera.window(), digest);
            if (!what.empty()) run.note(fmt::format("{}: {}; it is made again", path, what));
            return what.empty();
          };
          frame.skipped =
              isWhole(frame.path, frame.digest) && (frame.deep.empty() || isWhole(frame.deep, frame.digest));
          frame.previewSkipped = frame.skipped && isWhole(frame.preview, frame.previewDigest);
        }
      },
      run);
  const auto skipped = std::ranges::count_if(plan.frames, &TurntableFrame::skipped);
  if (skipped > 0)
    run.note(fmt::format("skipping {} of {} frames, which are whole", skipped, plan.frames.size()));
}

}  // namespace nephele::apps

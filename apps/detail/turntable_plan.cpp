// What a call of the verb turntable has to make, and what of it is there already.
#include "apps/detail/turntable_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <fstream>

#include "nephele/levelset/io/output_file.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/image/image_file.h"

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

std::vector<int> shardOf(const FrameRange& range, const std::string& text) {
  int index = 0, count = 0;
  const char* end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, index);
  const bool slash = first.ec == std::errc() && first.ptr != end && *first.ptr == '/';
  const auto second = std::from_chars(slash ? first.ptr + 1 : end, end, count);
  if (!slash || second.ec != std::errc() || second.ptr != end || index < 1 || count < index)
    refuseValue("--shard", text, "I/N, machine I of N, with 1 <= I <= N");
  return range.shard(index, count);
}

// A 64 bit FNV-1a hash.
class Hash {
 public:
  void add(std::string_view bytes) {
    for (const char byte : bytes) value_ = (value_ ^ std::uint8_t(byte)) * 0x100000001b3u;
    // So that "ab", "c" and "a", "bc" differ.
    value_ = (value_ ^ bytes.size()) * 0x100000001b3u;
  }
  // A file by what it holds, wherever it is.
  void addFile(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::vector<char> block(std::size_t(1) << 20);
    while (file.read(block.data(), std::streamsize(block.size())) || file.gcount() > 0)
      add({block.data(), std::size_t(file.gcount())});
  }
  std::string text() const { return fmt::format("{:016x}", value_); }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325u;
};

// What the pixels of a frame do not depend on, or only by its number.
constexpr std::array kOthers{"output",        "frames", "preview",       "movie",      "fps",
                             "contact-sheet", "only",   "shard",         "exposure",   "view-transform",
                             "ocio-config",   "config", "skip-existing", "background", "display-server",
                             "threads",       "quiet",  "verbose",       "stats",      "progress",
                             "memory-limit",  "help",   "overwrite"};

std::string digestOf(const TurntableOptions& options, int first, int last) {
  Hash hash;
  hash.add(NEPHELE_VERSION);
  hash.add(fmt::format("{}-{}", first, last));
  for (const CLI::Option* option : options.app->get_options()) {
    const std::string name = option->get_single_name();
    if (option->count() == 0 || std::ranges::count(kOthers, name) > 0) continue;
    hash.add(name);
    for (const std::string& value : option->results()) {
      std::error_code ignored;
      const std::size_t equals = value.find('=');
      const std::string rest = equals == std::string::npos ? value : value.substr(equals + 1);
      const bool isFile = std::filesystem::is_regular_file(rest, ignored);
      hash.add(isFile ? value.substr(0, value.size() - rest.size()) : value);
      if (isFile) hash.addFile(rest);
    }
  }
  return hash.text();
}

// Why `path` is not a whole picture of the `window` of `camera`; "" if it is. Pictures for the screen say
// nothing of what they are made of.
std::string defect(const std::string& path, const PixelBox& window, const std::string& digest) {
  try {
    std::string found;
    if (!digest.empty()) {
      const detail::ImageReader reader{[&](const detail::ImageHeader& header) {
                                         for (const auto& [name, value] : header.attributes)
                                           if (name == TurntablePlan::kDigestName) found = value;
                                       },
                                       [](int, const float*) {}};
      detail::readExrFile(path, reader);
    }
    const Image image = readImage(path);
    for (const char* name : {"R", "G", "B"})
      if (!image.find(name)) return fmt::format("has no channel {}", name);
    if (image.width != window.width() || image.height != window.height())
      return fmt::format("is {}x{} and not {}x{}", image.width, image.height, window.width(),
                         window.height());
    return found == digest ? "" : "was made with other options, of another input or by another version";
  } catch (const Error& error) {
    return fmt::format("is not whole ({})", error.what());
  }
}

}  // namespace

TurntablePlan::TurntablePlan(const TurntableOptions& options) {
  const FrameRange range = parsed("--frames", [&] { return FrameRange::parse(options.frames); });
  first = range.first();
  last = range.last();
  digest = digestOf(options, first, last);
  const FramePattern output = parsed("--output", [&] { return FramePattern::parse(options.output); });
  std::optional<FramePattern> preview;
  if (!options.preview.empty())
    preview = parsed("--preview", [&] { return FramePattern::parse(options.preview); });
  for (const auto& [name, path] :
       {std::pair{"--movie", options.movie}, {"--contact-sheet", options.contactSheet}})
    for (const auto& [other, value] : {std::pair{"--shard", options.shard}, {"--only", options.only}})
      if (!path.empty() && !value.empty())
        throw CLI::ValidationError(name,
                                   fmt::format("shows all frames, and {} makes some of them; when all are "
                                               "there, call again with --skip-existing and without {}",
                                               other, other));

  std::vector<int> numbers = options.shard.empty() ? range.frames() : shardOf(range, options.shard);
  if (!options.only.empty()) {
    const FrameRange only = parsed("--only", [&] { return FrameRange::parse(options.only); });
    std::erase_if(numbers, [&](int number) { return !only.contains(number); });
  }
  for (const int number : numbers)
    frames.push_back({number, output.path(number), preview ? preview->path(number) : ""});
  for (const TurntableFrame& frame : frames)
    if (!options.contactSheet.empty() && options.contactSheet == frame.preview)
      refuseValue("--contact-sheet", options.contactSheet, "another file than that of a frame of --preview");
}

void prepareFolders(const TurntableOptions& options, const TurntablePlan& plan) {
  std::vector<std::string> paths{options.movie, options.contactSheet};
  if (!plan.frames.empty()) {
    paths.push_back(plan.frames.front().path);
    paths.push_back(plan.frames.front().preview);
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
            const std::string what = defect(path, camera.window(), digest);
            if (!what.empty()) run.note(fmt::format("{}: {}; it is made again", path, what));
            return what.empty();
          };
          frame.skipped = isWhole(frame.path, plan.digest);
          frame.previewSkipped = frame.skipped && isWhole(frame.preview, "");
        }
      },
      run);
  const auto skipped = std::ranges::count_if(plan.frames, &TurntableFrame::skipped);
  if (skipped > 0)
    run.note(fmt::format("skipping {} of {} frames, which are whole", skipped, plan.frames.size()));
}

}  // namespace nephele::apps

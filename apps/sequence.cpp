#include "apps/sequence.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>

#include "apps/file_hashes.h"
#include "apps/options/config_file.h"
#include "apps/options/outputs.h"
#include "nephele/levelset/io/output_file.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/error.h"

namespace nephele::apps {
namespace {

namespace fs = std::filesystem;

constexpr const char* kForm = "a name with a place for the frame number, as in NAME.####.EXT";

/// "4, 7-9, 12"
std::string rangesOf(const std::vector<int>& frames) {
  std::string text;
  for (std::size_t i = 0, last = 0; i != frames.size(); i = last + 1) {
    last = i;
    while (last + 1 != frames.size() && frames[last + 1] == frames[last] + 1) ++last;
    text += fmt::format("{}{}", text.empty() ? "" : ", ", frames[i]);
    if (last != i) text += fmt::format("-{}", frames[last]);
  }
  return text;
}

FrameRange parsedFrames(const std::string& option, const std::string& text) {
  try {
    return FrameRange::parse(text);
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

bool namesFile(const CLI::Option& option) {
  return option.get_type_name().find("FILE") != std::string::npos;
}

/// What must not change from frame to frame: which grid is looked at, and that it is a level set, or none.
struct Grids {
  std::string first;
  std::vector<std::string> names;
  Vec3f voxelSize{};

  explicit Grids(const std::string& path) {
    for (const VdbGrid& grid : readVdbHeaders(path)) {
      const VdbGridInfo info = describe(grid);
      const bool isLevel = info.gridClass == VdbGridInfo::Class::levelSet;
      names.push_back(fmt::format("'{}'{}", info.name, isLevel ? " (level set)" : ""));
      if (!first.empty() || valuesOf(grid) != VdbValues::scalar) continue;
      first = names.back();
      voxelSize = info.voxelSize;
    }
    std::ranges::sort(names);
  }
  std::string text() const { return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", ")); }
};

}  // namespace

std::vector<int> chosenFrames(const FrameRange& range, const std::string& only, const std::string& shard) {
  std::vector<int> numbers = shard.empty() ? range.frames() : shardOf(range, shard);
  if (only.empty()) return numbers;
  const FrameRange part = parsedFrames("--only", only);
  std::erase_if(numbers, [&](int number) { return !part.contains(number); });
  return numbers;
}

void requireFrames(const std::string& name, const std::vector<int>& frames,
                   const std::function<std::string(int frame)>& path) {
  std::vector<int> missing;
  for (const int frame : frames)
    if (!fs::exists(path(frame))) missing.push_back(frame);
  if (!missing.empty())
    throw Error(fmt::format("{}: {} of {} frames {} missing: {}", name, missing.size(), frames.size(),
                            missing.size() == 1 ? "is" : "are", rangesOf(missing)));
}

void requireSameGrids(const std::vector<int>& frames, const std::function<std::string(int frame)>& path,
                      const Run& run) {
  const std::string firstPath = path(frames.front());
  if (!isVolumeFile(firstPath)) return;
  const Grids first(firstPath);
  bool isNoted = false;
  for (const int frame : frames) {
    run.check();
    const std::string own = path(frame);
    const Grids other(own);
    const auto listed = [&] {
      return fmt::format("{}: its grids are {}, and those of {} are {}", own, other.text(), firstPath,
                         first.text());
    };
    if (other.first != first.first)
      throw Error(listed() + ": the first of numbers must be the same in all frames");
    const bool differs = other.names != first.names || other.voxelSize != first.voxelSize;
    if (differs && !isNoted)
      run.note(other.names != first.names
                   ? listed()
                   : fmt::format("{}: its voxels are {:g} wide, and those of {} {:g}", own, other.voxelSize.x,
                                 firstPath, first.voxelSize.x));
    isNoted = isNoted || differs;
  }
}

std::optional<Sequence> Sequence::of(const std::vector<std::string>& arguments) {
  if (!givenTo("--frames", arguments)) return std::nullopt;
  return Sequence(arguments);
}

Sequence::Sequence(std::vector<std::string> arguments)
    : arguments_(std::move(arguments)),
      range_(parsedFrames("--frames", *givenTo("--frames", arguments_))),
      chosen_(chosenFrames(range_, givenTo("--only", arguments_).value_or(""),
                           givenTo("--shard", arguments_).value_or(""))) {
  for (std::size_t i = 0; i != arguments_.size(); ++i) try {
      if (FramePattern::places(arguments_[i]) > 0) words_.push_back({i, FramePattern::parse(arguments_[i])});
    } catch (const Error& error) {
      throw CLI::ValidationError("--frames", error.what());
    }
  if (words_.empty()) throw CLI::ValidationError("--frames", fmt::format("no file has {}", kForm));
}

std::vector<std::size_t> Sequence::made() const {
  std::vector<std::size_t> indices;
  for (const int frame : chosen_)
    indices.push_back(
        std::size_t(std::ranges::lower_bound(range_.frames(), frame) - range_.frames().begin()));
  return indices;
}

Call Sequence::call(std::size_t index) const {
  const int frame = range_.frames()[index];
  Call call{fmt::format("frame {}", frame),
            {.frame = frame, .framesSinceFirst = frame - range_.first()},
            {{"frame", frame}},
            arguments_};
  for (const Word& word : words_) call.arguments[word.index] = word.pattern.path(frame);
  return call;
}

const Sequence::Word* Sequence::wordOf(const std::string& value) const {
  for (const Word& word : words_)
    if (const std::string text = word.pattern.path(range_.frames().front()); text.ends_with(value))
      if (value.size() == text.size() || text.starts_with('-')) return &word;
  return nullptr;
}

std::vector<Sequence::File> Sequence::inputs(const CLI::App& first) const {
  std::vector<File> result;
  for (const CLI::Option* option : first.get_options()) {
    if (isOutput(*option)) continue;
    for (const std::string& value : option->results()) {
      const Word* word = wordOf(value);
      if (!word) continue;
      const std::string text = word->pattern.path(range_.frames().front());
      std::optional<File> file;
      for (const std::string& name : namesIn(value)) {
        const std::size_t before = text.size() - value.size() + value.find(name);
        const File one{word, before, text.size() - before - name.size()};
        if (FramePattern::places(one.name()) == 0) continue;
        // All of the value comes first; of names of which there is no file the last is the shortest.
        if (!file || !fs::exists(file->path(range_.frames().front()))) file = one;
      }
      if (file) result.push_back(*file);
    }
  }
  return result;
}

void Sequence::requireNumberedOutputs(const CLI::App& first) const {
  for (const CLI::Option* option : first.get_options()) {
    if (!isOutputOfCall(*option)) continue;
    for (const std::string& value : option->results())
      if (!isStream(value) && !wordOf(value)) refuseValue(option->get_name(false, true), value, kForm);
  }
}

std::vector<std::pair<std::string, std::function<std::string(std::size_t)>>> Sequence::outputs(
    const CLI::App& first) const {
  std::vector<std::pair<std::string, std::function<std::string(std::size_t)>>> result;
  for (const CLI::Option* option : first.get_options()) {
    if (!isOutputOfCall(*option)) continue;
    for (const std::string& value : option->results())
      if (const Word* word = wordOf(value)) {
        const std::size_t length = pathOf(*option, value).size();
        const File file{word, word->pattern.path(range_.frames().front()).size() - length, 0};
        result.emplace_back(option->get_name(false, true),
                            [this, file](std::size_t i) { return file.path(range_.frames()[i]); });
      }
  }
  return result;
}

void Sequence::check(const CLI::App& first, std::set<std::string>& known, const Run& run) const {
  requireNumberedOutputs(first);
  std::vector<File> files = inputs(first);
  std::erase_if(files, [&](const File& file) { return !known.insert(file.name()).second; });
  for (const File& file : files)
    requireFrames(file.name(), range_.frames(), [&](int frame) { return file.path(frame); });
  for (const File& file : files)
    requireSameGrids(
        range_.frames(), [&](int frame) { return file.path(frame); }, run);
  for (const std::string& path : outputsOf(first)) {
    const fs::path folder = fs::path(path).parent_path();
    std::error_code error;
    if (!folder.empty()) fs::create_directories(folder, error);
    require(!error, fmt::format("cannot write {}: the folder cannot be made: {}", path, error.message()));
  }
}

void refuseFrameNames(const CLI::App& app) {
  if (app.get_option_no_throw("--frames")->count() > 0) return;
  for (const CLI::Option* option : app.get_options()) {
    if (!namesFile(*option) && !isOutput(*option)) continue;
    for (const std::string& value : option->results()) {
      // Other signs are as good letters as any.
      const bool isPattern = FramePattern::places(value) == 1 &&
                             (value.find("##") != std::string::npos || value.find("%0") != std::string::npos);
      if (isPattern && (isOutput(*option) || !fs::exists(value)))
        throw CLI::ValidationError(
            option->get_name(false, true),
            fmt::format("got '{}', which names frames; say which, as in --frames 1-48", value));
    }
  }
}

}  // namespace nephele::apps

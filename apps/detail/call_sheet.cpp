#include "apps/detail/call_sheet.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "apps/options/config_file.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/output_file.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/error.h"
#include "nephele/render/image/contact_sheet.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/image/png_io.h"

namespace nephele::apps {
namespace {

namespace fs = std::filesystem;

/// A hidden folder that is gone in the end, also where a signal stops the program.
class ScratchFolder {
 public:
  explicit ScratchFolder(const std::string& beside) {
    const fs::path folder = fs::path(beside).parent_path();
    path_ = (folder / (".nephele_sheet_" + std::string(6, 'X'))).string();
    require(mkdtemp(path_.data()) != nullptr,
            fmt::format("cannot write {}: no folder can be made there", beside));
    open_.emplace(path_);
  }
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  std::string file(const std::string& name) const { return (fs::path(path_) / name).string(); }

 private:
  std::string path_;
  std::optional<detail::OpenOutput> open_;
};

bool isSeen(const std::string& path) {
  return isMeshFile(path) || isVolumeFile(path);
}

/// Pictures of the outputs, in `folder`. Fewer of them are larger.
std::vector<std::string> rendered(const std::vector<MadeCall>& made, const Verb& render,
                                  const ScratchFolder& folder, ProgramRun& run) {
  std::vector<std::string> pictures;
  for (std::size_t i = 0; i != made.size(); ++i) pictures.push_back(folder.file(fmt::format("{}.png", i)));
  SeveralCalls calls;
  calls.count = made.size();
  calls.variesInputs = true;
  calls.list = calls.word = "pictures";
  calls.at = [&](std::size_t i) {
    Call call{
        made[i].name,
        {},
        {},
        {made[i].output, "--preview", pictures[i], made.size() <= 12 ? "--size=640x426" : "--size=320x213"}};
    if (made[i].look.empty()) return call;
    call.arguments.push_back("--look=" + made[i].look);
    call.arguments = withConfigFile({Command(render).app, render.name, {render.name}}, call.arguments);
    return call;
  };
  for (std::size_t i = 0; i != made.size(); ++i) calls.made.push_back(i);
  const nlohmann::json kept = std::move(run.stats);
  run.tellsResults = false;
  makeCalls(render, calls, run);
  run.tellsResults = true;
  run.stats = kept;
  return pictures;
}

Image readPicture(const std::string& path) {
  Image image = readLinearImage(path);
  if (!image.find("A")) std::ranges::fill(image.add("A").values, 1.0f);
  return image;
}

}  // namespace

std::vector<std::string> withPreview(std::vector<std::string> arguments, const CLI::App& app) {
  if (!app.get_option_no_throw("--preview") || givenTo("--preview", arguments)) return arguments;
  std::optional<std::string> output = givenTo("--output", arguments);
  if (!output) output = givenTo("-o", arguments);
  if (!output) return arguments;
  fs::path path(*output);
  if (!path.has_filename()) path = path.parent_path();
  const bool isFile = isSeen(path.string()) || path.extension() == ".exr";
  arguments.push_back("--preview=" + (isFile ? path.replace_extension(".png") : path += ".png").string());
  return arguments;
}

void requireSeen(const CLI::App& call, const CLI::App& first) {
  for (const char* name : {"--size", "--crop"})
    if (const CLI::Option* option = call.get_option_no_throw(name))
      if (option->results() != first.get_option(name)->results())
        throw CLI::ValidationError("--contact-sheet",
                                   fmt::format("shows pictures of one size; {} varies it", name));
  const CLI::Option *preview = call.get_option_no_throw("--preview"), *output = call.get_option("--output");
  if (preview && preview->count() > 0) return;
  if (output->count() == 0 || !isSeen(output->results().front()))
    throw CLI::ValidationError("--contact-sheet", "shows previews, volumes and meshes; give --output");
}

void writeCallSheet(const std::string& path, const std::vector<MadeCall>& calls, std::optional<int> columns,
                    const Verb& render, ProgramRun& run) {
  if (calls.empty()) return;
  std::optional<ScratchFolder> folder;
  std::vector<std::string> pictures;
  if (!calls.front().preview.empty()) {
    for (const MadeCall& call : calls) pictures.push_back(call.preview);
  } else {
    folder.emplace(path);
    pictures = rendered(calls, render, *folder, run);
  }
  ContactSheetOptions options;
  // So that names of many values can still be read.
  options.width = std::max(1920, int(320 * std::sqrt(double(calls.size()))));
  options.mostFrames = int(std::min<std::size_t>(calls.size(), 1000));
  // Two or three stand side by side.
  options.columns = columns || calls.size() > 3 ? columns : int(calls.size());
  for (const MadeCall& call : calls) options.labels.push_back(call.name);
  std::optional<ContactSheet> sheet;
  for (std::size_t place = 0; !sheet || place != sheet->shown().size(); ++place) {
    run.check();
    const std::size_t i = sheet ? std::size_t(sheet->shown()[place]) : 0;
    const Image image = readPicture(pictures[i]);
    if (!sheet) sheet.emplace(int(calls.size()), image.width, image.height, options);
    namingFile(pictures[i], [&] { sheet->set(int(place), image); });
  }
  writePng(path, sheet->image(), {.shoulder = 0.99999f}, run.metadata());
  run.result(fmt::format("{}: {} pictures in {} columns", path, sheet->shown().size(), sheet->columns()));
}

}  // namespace nephele::apps

// Verbs with any options: the first line of an input is the verb, every other one an argument.
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <map>

#include "apps/detail/program_run.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/point_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/felt/diagnostic.h"
#include "nephele/render/image/deep_image.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/image/image.h"
#include "tests/fuzz/harness.h"
#include "tests/fuzz/verb_calls.h"

namespace nephele::fuzz {
namespace {

namespace fs = std::filesystem;

/// Seconds of a processor after which a verb is stopped, and within which it must be back then: the program
/// promises a fifth of a second, of which the sanitizers make several.
constexpr double kStopAfter = 2, kMostToStop = 6;
/// What takes longer is not done again in other ways.
constexpr double kQuick = 0.5;

double processorSeconds() {
  return double(std::clock()) / CLOCKS_PER_SEC;
}

void checkLine(std::string_view line) {
  checkMessage(printable(line), "");
  std::string words(line);
  std::ranges::replace_if(
      words, [](char c) { return !std::isalnum(std::uint8_t(c)) && c != '.'; }, ' ');
  for (const char* word : {" nan ", " inf "})
    expect((' ' + words + ' ').find(word) == std::string::npos,
           fmt::format("a result is no number: {}", line));
}

/// Stops after a while, as Ctrl-C does.
class StoppedRun : public apps::ProgramRun {
 public:
  using ProgramRun::ProgramRun;

  bool cancelled() const override { return processorSeconds() - start_ > kStopAfter; }
  void advance(double fraction) const override {
    if (!(fraction >= -1e-6 && fraction <= 1 + 1e-6)) fail(fmt::format("progress of {}", fraction));
  }
  void note(std::string_view message) const override { checkLine(message); }
  void result(const std::string& line) const override { checkLine(line); }

 private:
  double start_ = processorSeconds();
};

std::string contentsOf(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// Where verbs run, as what they write has no folder in its name.
class Workplace {
 public:
  Workplace() : folder_(scratchPath("verbs")) {
    inputs_["ball.obj"] = contentsOf(ballMesh());
    inputs_["ball.vdb"] = contentsOf(ballLevelSet());
    inputs_["fog.vdb"] = contentsOf(ballFog());
    inputs_["camera.json"] =
        R"({"frames":[{"frame":1,"position":[2,1,3],"look_at":[0,0,0],"up":[0,1,0],"vertical_fov":30}]})";
    inputs_["layers.toml"] = "[[layer]]\nnoise = \"worley\"\namplitude = \"3%\"\nfrequency = \"4x\"\n";
    fs::create_directories(folder_);
    fs::current_path(folder_);
  }

  /// As it was before any verb ran.
  void restore() const {
    for (const auto& entry : fs::directory_iterator(folder_))
      if (!isInput(entry.path())) fs::remove_all(entry.path());
    for (const auto& [name, contents] : inputs_)
      if (contentsOf(folder_ / name) != contents) {
        fs::remove_all(folder_ / name);
        std::ofstream(folder_ / name, std::ios::binary) << contents;
      }
  }

  /// What verbs left beside their inputs, by name.
  std::map<std::string, fs::path> outputs() const {
    std::map<std::string, fs::path> found;
    for (const auto& entry : fs::recursive_directory_iterator(folder_))
      if (entry.is_regular_file() && !isInput(entry.path()))
        found[fs::relative(entry.path(), folder_).string()] = entry.path();
    return found;
  }

 private:
  bool isInput(const fs::path& path) const {
    return path.parent_path() == folder_ && inputs_.contains(path.filename().string());
  }

  fs::path folder_;
  std::map<std::string, std::string> inputs_;
};

enum class Outcome { done, refused, stopped };

Outcome run(const std::string& verb, const std::vector<std::string>& arguments) {
  const double start = processorSeconds();
  const auto refused = [&](const std::string& message) {
    lastError() = printable(message);
    checkMessage(lastError(), "");
    const bool isNamed = std::ranges::any_of(arguments, [](const std::string& argument) {
      // Of NAME=FILE the file.
      const std::string name = argument.substr(argument.find('=') + 1);
      return lastError().find(name.empty() ? "''" : printable(name)) != std::string::npos;
    });
    const bool isInput = lastError().starts_with("input: ") || lastError().starts_with("files: ");
    expect(isNamed || isInput || lastError().find("--") != std::string::npos,
           "neither an option nor a file is named: " + lastError());
    return Outcome::refused;
  };
  try {
    apps::callVerb(verb, arguments, [](const std::string& name, const apps::CommonOptions& options) {
      return std::make_unique<StoppedRun>(name, options);
    });
  } catch (const Cancelled&) {
    const double took = processorSeconds() - start;
    expect(took < kStopAfter + kMostToStop, fmt::format("it took {:.1f} s to stop", took - kStopAfter));
    return Outcome::stopped;
  } catch (const CLI::ParseError& error) {
    return refused(error.what());
  } catch (const felt::ScriptError& error) {
    expect(!error.diagnostics().empty(), "an expression is refused without a fault");
    return Outcome::refused;
  } catch (const apps::SeveralErrors& errors) {
    for (const std::string& message : errors.messages()) refused(message);
    return Outcome::refused;
  } catch (const Error& error) {
    return refused(error.what());
  }
  const double took = processorSeconds() - start;
  expect(took < kStopAfter + kMostToStop, fmt::format("it was not stopped in {:.1f} s", took));
  return Outcome::done;
}

/// What a verb wrote can be read, and is made of numbers.
void checkOutput(const std::string& verb, const std::string& name, const fs::path& path) {
  // Statistics may have any name.
  const std::string contents = contentsOf(path);
  if (contents.starts_with('{')) return;
  const std::string extension = path.extension().string();
  if (extension == ".vdb") {
    for (const VdbGrid& grid : readVdbFile(path.string()))
      expect(valueRange(grid).notFinite == 0, name + " has values that are no numbers");
  } else if (extension == ".obj" || extension == ".ply" || extension == ".stl") {
    const Mesh mesh = verb == "wisps" ? readPoints(path.string()) : readMesh(path.string());
    for (const MeshAttribute& attribute : mesh.attributes)
      for (const float value : attribute.values)
        if (!std::isfinite(value)) fail(name + " has attributes that are no numbers");
  } else if (contents.find("deepscanline") != contents.npos) {
    readDeepExr(path.string());
  } else if (extension == ".exr") {
    const Image image = readImage(path.string());
    for (const auto& channel : image.channels) {
      // Where nothing is seen, depth is infinite.
      if (channel.name.ends_with("Z") || channel.name.find("Z_") != channel.name.npos) continue;
      for (const float value : channel.values)
        if (!std::isfinite(value)) fail(fmt::format("{} of {} is no number", channel.name, name));
    }
  } else if (extension == ".png") {
    readImage(path.string());
  }
}

bool has(const std::vector<std::string>& arguments, std::string_view option) {
  return std::ranges::any_of(
      arguments, [&](const std::string& each) { return each.substr(0, each.find('=')) == option; });
}

bool hasAny(const std::vector<std::string>& arguments, std::initializer_list<std::string_view> options) {
  return std::ranges::any_of(options, [&](std::string_view option) { return has(arguments, option); });
}

std::vector<std::string> with(std::vector<std::string> arguments, std::initializer_list<std::string> more) {
  arguments.insert(arguments.end(), more);
  return arguments;
}

/// `part` is what `whole` is from this pixel on.
void expectPart(const Image& part, const Image& whole, int x0, int y0, const std::string& what) {
  for (const Image::Channel& channel : part.channels)
    for (int y = 0; y != part.height; ++y)
      for (int x = 0; x != part.width; ++x)
        if (part.at(channel.name, x, y) != whole.at(channel.name, x0 + x, y0 + y))
          fail(fmt::format("{}: {} differs at {}, {}", what, channel.name, x, y));
}

/// A part of a picture is that of the whole, as which `arguments` have written out.exr.
void checkCrop(const std::vector<std::string>& arguments) {
  const Image whole = readImage("out.exr");
  const int x0 = whole.width / 3, y0 = whole.height / 2, x1 = std::max(whole.width - 1, x0 + 1);
  const std::string crop = fmt::format("{},{},{},{}", x0, y0, x1, whole.height);
  if (run("render", with(arguments, {"--crop", crop})) == Outcome::stopped) return;
  expectPart(readImage("out.exr"), whole, x0, y0, "--crop " + crop);
}

/// A picture whose volume has been lit by another sun before is that of a call of its own.
void checkWedge(const std::vector<std::string>& arguments) {
  if (run("render", with(arguments, {"--sun", "60,40"})) != Outcome::done) return;
  const Image alone = readImage("out.exr");
  if (run("render", with(arguments, {"--wedge", "sun=10,20;60,40"})) == Outcome::stopped) return;
  expectPart(readImage("out.sun_60_40.exr"), alone, 0, 0, "--wedge");
}

}  // namespace

std::span<const std::string_view> verbFiles() {
  static constexpr std::string_view kFiles[] = {"ball.obj",    "ball.vdb",    "fog.vdb",
                                                "camera.json", "layers.toml", "missing.vdb"};
  return kFiles;
}

std::span<const VerbCall> verbCalls() {
  static const VerbCall kCalls[] = {
      {"levelset", {"ball.obj", "-o", "out.vdb"}, {"--resolution", "12"}},
      {"cloud", {"ball.obj", "-o", "out.vdb"}, {"--resolution", "16", "--layers", "1"}},
      {"advect", {"fog.vdb", "-o", "out.vdb"}, {"--velocity", "0.1,0,0"}},
      {"wisps", {"-o", "out.vdb"}, {"--resolution", "16", "--dots", "300"}},
      {"mesh", {"ball.vdb", "-o", "out.obj"}, {}},
      {"cut", {"ball.obj", "-o", "pieces"}, {"--random-planes", "1", "--resolution", "16"}},
      {"transfer", {"--from", "ball.obj", "--to", "ball.obj", "-o", "out.obj"}, {"--resolution", "16"}},
      {"transform", {"ball.obj", "-o", "out.obj"}, {}},
      {"render",
       {"fog.vdb", "-o", "out.exr"},
       {"--size", "6x5", "--samples", "1", "--sky", "0.2,0.3,0.4", "--light-quality", "draft"}},
      {"turntable",
       {"fog.vdb", "-o", "out_####.exr", "--frames", "1-2"},
       {"--size", "4x3", "--samples", "1", "--sky", "0.2,0.3,0.4", "--light-quality", "draft"}},
      {"info", {"ball.obj", "fog.vdb"}, {}}};
  return kCalls;
}

const VerbCall* callOf(std::string_view verb) {
  const auto found = std::ranges::find(verbCalls(), verb, &VerbCall::verb);
  return found == verbCalls().end() ? nullptr : &*found;
}

bool useVerb(const Input& input) {
  constexpr std::size_t kMostArguments = 40;
  // What leaves the folder, the process or the machine, or ends what this run is bounded by.
  constexpr std::string_view kKept[] = {
      "--threads", "--memory-limit", "--display-server", "--movie", "--help", "--help-all", "-h"};
  const std::vector<std::string> lines = linesOf(input.bytes);
  const VerbCall* const call = lines.empty() ? nullptr : callOf(lines.front());
  if (!call || lines.size() > kMostArguments) return false;
  std::vector<std::string> arguments(call->needed), given(lines.begin() + 1, lines.end());
  for (const std::string& line : given)
    if ((line.find('/') != line.npos && !line.starts_with('=')) || line.starts_with("-h")) return false;
  for (const std::string_view option : kKept)
    if (has(given, option)) return false;
  arguments.insert(arguments.end(), given.begin(), given.end());
  for (std::size_t i = 0; i + 1 < call->quick.size(); i += 2)
    if (!has(given, call->quick[i])) arguments.insert(arguments.end(), {call->quick[i], call->quick[i + 1]});
  arguments.insert(arguments.end(), {"--threads", "1", "--memory-limit", "256M"});

  static const Workplace workplace;
  workplace.restore();
  const std::string verb(call->verb);
  const double start = processorSeconds();
  const Outcome outcome = run(verb, arguments);
  const bool isQuick = processorSeconds() - start < kQuick;
  const auto outputs = workplace.outputs();
  if (outcome != Outcome::done) {
    // Of several calls those that are whole stay, and so does what other calls may use.
    if (!hasAny(given, {"--frames", "--wedge", "--cache"}) && verb != "turntable")
      expect(outputs.empty(), fmt::format("{} was left of a verb that failed: {}",
                                          outputs.empty() ? "" : outputs.begin()->first, lastError()));
    return false;
  }
  for (const auto& [name, path] : outputs) checkOutput(verb, name, path);

  if (verb == "render" && isQuick &&
      !hasAny(given, {"--crop", "--frames", "--wedge", "--stats", "--skip-existing"})) {
    if (input.hash % 8 == 1) checkCrop(arguments);
    if (input.hash % 8 == 2 && !has(given, "--sun")) checkWedge(arguments);
  }
  if (input.hash % 8 != 0 || hasAny(given, {"--stats", "--cache"})) return true;
  std::map<std::string, std::string> before;
  for (const auto& [name, path] : outputs) before[name] = contentsOf(path);
  workplace.restore();
  if (run(verb, arguments) != Outcome::done) return true;
  for (const auto& [name, contents] : before)
    expect(contentsOf(outputs.at(name)) == contents, name + " is another one when made again");
  return true;
}

}  // namespace nephele::fuzz

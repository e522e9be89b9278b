// Files and options that people write.
#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <set>

#include "apps/app.h"
#include "apps/detail/command.h"
#include "apps/options/config_file.h"
#include "apps/options/field_sources.h"
#include "apps/options/field_value.h"
#include "apps/options/layer_recipe.h"
#include "apps/options/velocity_options.h"
#include "apps/wedge.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/render/image/frame_range.h"
#include "nephele/render/scene/camera_file.h"
#include "tests/fuzz/formats.h"
#include "tests/fuzz/harness.h"
#include "tests/fuzz/verb_calls.h"

namespace nephele::fuzz {
namespace {

class SilentRun : public apps::Run {
 public:
  void expect(double, double, int) const override {}
  void detail(std::string_view) const override {}
  void result(const std::string&) const override {}
};

/// A fault of usage is an answer, too. The program shows messages as printable text. Returns whether there
/// was none.
template <class Work>
bool mayFail(std::string_view named, const Work& work) {
  try {
    work();
    return true;
  } catch (const CLI::ParseError& error) {
    lastError() = printable(error.what());
  } catch (const Error& error) {
    lastError() = printable(error.what());
  }
  checkMessage(lastError(), named);
  return false;
}

const Mesh& mesh() {
  static const Mesh mesh = triangulated(readMesh(ballMesh()));
  return mesh;
}

apps::FieldSources sources(const apps::Run& run) {
  return apps::FieldSources(mesh(), {.voxelSize = 0.2, .reach = 0.2}, run);
}

void sample(const auto& field) {
  for (const Vec3f& point : {Vec3f{0.1f, 0.2f, 0.3f}, Vec3f{-0.5f, 0, 0}, Vec3f{1e9f, 0, -1e30f}})
    field(point);
  field.range({{-1, -1, -1}, {1, 1, 1}});
}

const std::vector<apps::Verb>& verbs() {
  static const std::vector<apps::Verb> all = apps::allVerbs();
  return all;
}

const std::vector<std::string>& verbNames() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const apps::Verb& each : verbs()) all.push_back(each.name);
    return all;
  }();
  return names;
}

const apps::Verb& verbCalled(std::string_view name) {
  return *std::ranges::find(verbs(), name, &apps::Verb::name);
}

/// Parses arguments as a verb does; its body does not run.
void parse(const apps::Verb& verb, std::vector<std::string> arguments) {
  apps::Command command(verb);
  command.parse(apps::withConfigFile({command.app, verb.name, verbNames()}, std::move(arguments)));
}

void useCameraMotion(const CameraMotion& motion) {
  for (const double frame :
       {motion.firstFrame(), 0.5 * (motion.firstFrame() + motion.lastFrame()), motion.lastFrame() + 0.5})
    succeeds("", [&] { motion.at(frame); });
}

}  // namespace

bool useCamera(const Input& input) {
  std::optional<CameraMotion> motion;
  if (!succeeds(input.path, [&] { motion = readCameraFile(input.path); })) return false;
  useCameraMotion(*motion);
  std::string text;
  if (succeeds("", [&] { text = cameraJsonText(*motion); }))
    expect(succeeds("", [&] { parseCameraJson(text, "again"); }),
           "a camera that was written cannot be read: " + text);
  if (succeeds("", [&] { text = chanText(*motion, 1.5); }))
    expect(succeeds("", [&] { parseChan(text, "again"); }),
           "a camera that was written cannot be read: " + text);
  // What options take.
  if (std::abs(motion->firstFrame()) > 1e9) return true;
  runRender({ballFog(), "--camera", input.path, "--frame", fmt::format("{}", motion->firstFrame())}, "");
  return true;
}

/// Faults that are shown in the text of the file are of several lines, by a printer of its own.
template <class Use>
bool mayFailOrShow(std::string_view named, const Use& use) {
  bool isShown = false;
  const bool succeeded = mayFail(named, [&] {
    try {
      use();
    } catch (const felt::ScriptError& error) {
      expect(!error.diagnostics().empty(), "a text is refused without a fault");
      expect(std::string_view(error.what()).find(named) != std::string_view::npos,
             fmt::format("{} is not named: {}", named, error.what()));
      isShown = true;
      lastError() = error.what();
    }
  });
  return succeeded && !isShown;
}

bool useToml(const Input& input) {
  const SilentRun run;
  bool isRead = mayFailOrShow(input.path, [&] {
    const auto recipes = apps::readLayerRecipe(input.path);
    apps::FieldSources fields = sources(run);
    for (const CumuloLayer& layer : apps::recipeLayers(recipes, CumuloFractal{}, fields)) {
      sample(layer.noise);
      sample(layer.amplitude * layer.billow);
    }
  });
  const VerbCall& call = verbCalls()[input.hash % verbCalls().size()];
  const apps::Verb& verb = verbCalled(call.verb);
  std::vector<std::string> arguments = call.needed;
  arguments.insert(arguments.end(), {"--config", input.path});
  isRead = mayFailOrShow("", [&] { parse(verb, arguments); }) || isRead;
  // Options of a file that is good may still exclude those of the call.
  isRead =
      mayFailOrShow(input.path,
                    [&] {
                      CLI::App fresh("", verb.name);
                      const apps::BoundVerb bound = verb.bind(fresh);
                      apps::checkConfigFile({fresh, verb.name, verbNames()}, {"--config", input.path}, fresh);
                    }) ||
      isRead;
  return isRead;
}

bool useFieldTexts(const Input& input) {
  const std::string text(input.bytes);
  const SilentRun run;
  using Unit = apps::Quantity::Unit;
  bool isRead = false;
  for (const Unit unit : {Unit::number, Unit::length, Unit::frequency})
    isRead = isRead || mayFailOrShow("--value", [&] {
               const auto value = apps::parseFieldValue("--value", text, {unit, -1, 1e6});
               apps::FieldSources fields = sources(run);
               sample(fields.field(value));
             });
  // A file is named by itself.
  isRead |= mayFail(isVolumeFile(text) ? printable(text) : "--velocity", [&] {
    apps::VelocityArguments velocity;
    apps::parseVelocity("--velocity", text, velocity);
    sample(velocity.field(1.0));
  });
  isRead |= mayFail("--wedge", [&] {
    CLI::App app("", "cloud");
    const apps::BoundVerb bound = apps::cloudVerb().bind(app);
    std::vector<std::string> words{"-o", "a.vdb", "--wedge", "seed=" + text};
    const auto wedge = apps::Wedge::taken(words, app);
    expect(wedge && wedge->size() > 0 && wedge->size() <= apps::Wedge::kMost, "a wedge of no size");
    std::set<std::string> names;
    for (std::size_t i = 0; i != wedge->size(); ++i) names.insert(wedge->named(words, i, app)[1]);
    expect(names.size() == wedge->size(), "two calls of a wedge write the same file");
    names.clear();
    words = {"-o", "a_####.vdb", "--frames", "1-2"};
    for (std::size_t i = 0; i != wedge->size(); ++i)
      for (const int frame : {1, 2})
        names.insert(FramePattern::parse(wedge->named(words, i, app)[1]).path(frame));
    expect(names.size() == 2 * wedge->size(), "two frames of a wedge are the same file");
  });
  std::vector<std::string> lines = linesOf(text);
  // CLI11 takes the first line of usage faults apart by itself; a file is not asked for.
  for (const std::string& line : lines)
    if (line.find("config") != line.npos) return isRead;
  std::string_view verb = verbCalls()[input.hash / 3 % verbCalls().size()].verb;
  if (!lines.empty())
    if (const VerbCall* named = callOf(lines.front())) {
      verb = named->verb;
      lines.erase(lines.begin());
    }
  isRead |= mayFail("", [&] { parse(verbCalled(verb), lines); });
  return isRead;
}

}  // namespace nephele::fuzz

#include "apps/look/controls.h"

#include <algorithm>
#include <array>
#include <regex>
#include <set>
#include <string_view>

#include "apps/detail/command.h"
#include "apps/look/plan.h"
#include "apps/looks.h"
#include "apps/options/common_group.h"
#include "apps/options/config_file.h"
#include "apps/options/expression_names.h"
#include "apps/options/first_day.h"
#include "apps/options/old_names.h"
#include "apps/options/outputs.h"
#include "nephele/modeling/felt/program.h"

namespace nephele::apps {
namespace {

/// A verb with its options, to be looked at.
struct Table {
  explicit Table(const std::string& name)
      : verb(name == "cloud" ? lookCloudVerb(cloud) : lookRenderVerb(scene, picture)), command(verb) {}
  CloudArguments cloud;
  SceneOptions scene;
  PictureOptions picture;
  Verb verb;
  Command command;
};

/// Where a slider goes, in the unit of the option: not what is allowed.
struct Slider {
  std::string_view name, unit;
  double low, high, step;
  bool isLogarithmic = false;
};
constexpr std::array kSliders{Slider{"resolution", "", 32, 1024, 1, true},
                              Slider{"layers", "", 1, 8, 1},
                              Slider{"amplitude", "%", 0, 10, 0.05},
                              Slider{"frequency", "x", 0.5, 20, 0.1, true},
                              Slider{"lacunarity", "", 1.2, 4, 0.05},
                              Slider{"roughness", "", 0, 1, 0.01},
                              Slider{"billow", "", 0, 2, 0.01},
                              Slider{"billow-scale", "", 0.1, 4, 0.01},
                              Slider{"edge-thickness", "%", 0.05, 6, 0.01, true},
                              Slider{"density", "", 0, 4, 0.01},
                              Slider{"advect", "%", 0, 10, 0.05},
                              Slider{"advect-frequency", "x", 1, 30, 0.1, true},
                              Slider{"advect-steps", "", 1, 12, 1},
                              Slider{"noise-time", "", 0, 10, 0.01},
                              Slider{"shape-seed", "", 0, 100, 1},
                              Slider{"seed", "", 0, 100, 1},
                              Slider{"medial-smoothing", "", 0, 16, 1},
                              Slider{"extinction", "", 1, 5000, 1, true},
                              Slider{"fov", "°", 5, 110, 0.5},
                              Slider{"focal-length", "mm", 12, 300, 1, true},
                              Slider{"f-stop", "", 0.1, 22, 0.1, true},
                              Slider{"exposure", "stops", -6, 6, 0.05},
                              Slider{"octaves", "", 1, 8, 1},
                              Slider{"samples", "", 1, 64, 1, true},
                              Slider{"sky-intensity", "", 0, 4, 0.01},
                              Slider{"sky-rotation", "°", -180, 180, 1},
                              Slider{"emission-scale", "", 0, 4, 0.01},
                              Slider{"temperature-scale", "K", 500, 6000, 10},
                              Slider{"density-scale", "", 0, 4, 0.01}};

// What the viewer does in other ways, or not at all.
const std::set<std::string> kNotShown{"size",          "crop",
                                      "config",        "look",
                                      "help",          "help-all",
                                      "input",         "set",
                                      "integrator",    "scatterings",
                                      "aov",           "display-server",
                                      "camera",        "rotation-order",
                                      "frame",         "shutter",
                                      "volume-motion", "write-deep-shadow",
                                      "cache",         "cache-size",
                                      "half",          "holdout",
                                      "spp",           "noise-speed",
                                      "noise-period",  "detail"};

std::string typeOf(const CLI::Option& option, bool& isField) {
  std::string word = option.get_type_name();
  if (const std::size_t bar = word.find("|FIELD"); bar != std::string::npos) {
    isField = true;
    word = word.substr(0, bar);
  }
  if (option.get_items_expected_max() == 0) return "flag";
  word = word.substr(0, word.find(':'));
  if (word == "NUMBER" || word == "STOPS" || word == "DEGREES" || word.starts_with("NUMBER["))
    return "number";
  if (word == "COUNT") return "count";
  if (word == "LENGTH") return "length";
  if (word == "FREQUENCY") return "frequency";
  if (word == "PERCENT") return "percent";
  if (word == "FILE" || word == "FOLDER") return "file";
  if (word == "R,G,B") return "color";
  if (word == "X,Y,Z") return "vector";
  if (word == "AZIMUTH,ELEVATION") return "angles";
  static const std::regex choices("[a-z0-9_]+(\\|[a-z0-9_]+)+");
  return std::regex_match(word, choices) ? "choice" : "text";
}

nlohmann::json controlOf(const CLI::Option& option, const std::string& verb, bool isFirstDay) {
  bool isField = false;
  const std::string name = option.get_lnames().front(), type = typeOf(option, isField);
  nlohmann::json control = {{"name", name},
                            {"verb", verb},
                            {"help", option.get_description()},
                            {"default", option.get_default_str()},
                            {"type", type},
                            {"is_field", isField},
                            {"form", option.get_type_name()},
                            {"repeats", option.get_items_expected_max() > 1},
                            {"first_day", isFirstDay}};
  if (type == "choice") {
    const std::string words = option.get_type_name();
    for (std::size_t begin = 0; begin <= words.size();) {
      const std::size_t end = std::min(words.find('|', begin), words.size());
      control["choices"].push_back(words.substr(begin, end - begin));
      begin = end + 1;
    }
  }
  const auto slider = std::ranges::find(kSliders, std::string_view(name), &Slider::name);
  if (slider != kSliders.end()) {
    control["unit"] = slider->unit;
    control["low"] = slider->low;
    control["high"] = slider->high;
    control["step"] = slider->step;
    control["logarithmic"] = slider->isLogarithmic;
  }
  const auto namesIn = [&](const std::set<CLI::Option*>& others) {
    auto names = nlohmann::json::array();
    for (const CLI::Option* other : others)
      if (!other->get_lnames().empty()) names.push_back(other->get_lnames().front());
    return names;
  };
  control["excludes"] = namesIn(option.get_excludes());
  control["needs"] = namesIn(option.get_needs());
  return control;
}

void addGroups(const std::string& verb, nlohmann::json& groups) {
  const Table table(verb);
  std::set<std::string> taken;
  for (const FirstDay& day : firstDays()) {
    if (day.verb != verb || day.group == "Files" || day.group == "Sequences and wedges") continue;
    auto controls = nlohmann::json::array();
    for (const std::string_view name : day.options) {
      const CLI::Option* option = table.command.app.get_option_no_throw(std::string(name));
      if (!option || option->get_lnames().empty() || kNotShown.contains(option->get_lnames().front()))
        continue;
      controls.push_back(controlOf(*option, verb, true));
      taken.insert(option->get_lnames().front());
    }
    groups.push_back({{"name", day.group}, {"verb", verb}, {"controls", controls}});
  }
  auto rest = nlohmann::json::array();
  for (const CLI::Option* option : table.command.app.get_options()) {
    if (option->get_lnames().empty() || option->get_positional() || isOutput(*option)) continue;
    const std::string name = option->get_lnames().front(), group = option->get_group();
    const bool isOfCloudsToo = verb == "render" && name == "seed";
    if (group.empty() || group == kCommonGroup || group == kSeveralGroup || taken.contains(name) ||
        kNotShown.contains(name) || isOfCloudsToo)
      continue;
    rest.push_back(controlOf(*option, verb, false));
  }
  groups.push_back({{"name", verb == "cloud" ? "More of the cloud" : "More of the picture"},
                    {"verb", verb},
                    {"controls", rest}});
}

std::vector<std::string> verbNames() {
  return {"cloud", "render", "turntable", "levelset",  "advect", "wisps",
          "mesh",  "cut",    "transfer",  "transform", "info",   "felt"};
}

}  // namespace

nlohmann::json lookControls(const LookSubject& subject) {
  auto groups = nlohmann::json::array();
  if (subject.hasCloud()) addGroups("cloud", groups);
  addGroups("render", groups);
  // What is needed first comes first, of both.
  std::stable_sort(groups.begin(), groups.end(), [](const nlohmann::json& a, const nlohmann::json& b) {
    const auto isMore = [](const nlohmann::json& group) {
      return group["name"].get<std::string>().starts_with("More");
    };
    return !isMore(a) && isMore(b);
  });
  return groups;
}

nlohmann::json lookParameters(const LookSubject& subject) {
  auto parameters = nlohmann::json::array();
  if (subject.kind != LookSubject::Kind::script) return parameters;
  const felt::Program program =
      felt::Program::fromFile(subject.path, feltFunctions(), namesOfPlace(0, 0).given);
  for (const felt::ScriptParameter& parameter : program.parameters()) {
    const std::string type = parameter.isColor ? "color" : felt::typeName(parameter.type);
    nlohmann::json one = {
        {"name", parameter.name}, {"type", type}, {"help", parameter.text}, {"default", parameter.standard}};
    if (parameter.isChoice)
      one["choices"] = parameter.allowed;
    else if (parameter.allowed.size() == 2) {
      const auto low = parseNumber(parameter.allowed[0]), high = parseNumber(parameter.allowed[1]);
      if (low && high) {
        one["low"] = *low;
        one["high"] = *high;
      }
    }
    parameters.push_back(one);
  }
  return parameters;
}

nlohmann::json settingsOfLine(const LookSubject& subject, const std::vector<std::string>& arguments,
                              std::vector<std::string>& others) {
  const std::vector<std::string> names = verbNames();
  nlohmann::json settings = {{"cloud", nlohmann::json::object()},
                             {"render", nlohmann::json::object()},
                             {"parameters", nlohmann::json::object()}};
  const auto read = [&](const char* name, const std::vector<std::string>& given,
                        std::vector<std::string>& left) {
    Table table(name);
    const std::string verb = name;
    std::vector<std::string> all = given;
    // So that looks leave out what belongs to another shape.
    if (verb == "cloud" && !subject.path.empty()) all.push_back(subject.path);
    all = withConfigFile({table.command.app, verb, names},
                         withCurrentNames(verb, std::move(all), [](const std::string&) {}));
    settings[name] = settingsOf(table.command.app, all, left);
    for (const char* file : {"config", "look"}) settings[name].erase(file);
    if (!subject.path.empty()) std::erase(left, subject.path);
  };
  std::vector<std::string> ofFiles, left;
  for (std::size_t i = 0; i < arguments.size(); ++i)
    if (arguments[i] == "--config" || arguments[i] == "--look") {
      ofFiles.push_back(arguments[i]);
      if (i + 1 < arguments.size()) ofFiles.push_back(arguments[++i]);
    } else if (arguments[i].starts_with("--config=") || arguments[i].starts_with("--look=")) {
      ofFiles.push_back(arguments[i]);
    } else {
      left.push_back(arguments[i]);
    }
  std::vector<std::string> ofRender = left;
  if (subject.hasCloud()) {
    ofRender.clear();
    std::vector<std::string> typed = left;
    typed.insert(typed.end(), ofFiles.begin(), ofFiles.end());
    read("cloud", typed, ofRender);
  }
  ofRender.insert(ofRender.end(), ofFiles.begin(), ofFiles.end());
  read("render", ofRender, others);
  auto& render = settings["render"];
  if (render.contains("set")) {
    for (const auto& text : render["set"]) {
      const std::string both = text.get<std::string>();
      const std::size_t equals = both.find('=');
      settings["parameters"][both.substr(0, equals)] =
          equals == std::string::npos ? std::string() : both.substr(equals + 1);
    }
    render.erase("set");
  }
  render.erase("size");
  return settings;
}

nlohmann::json shippedLooks(const LookSubject& subject) {
  auto looks = nlohmann::json::array();
  for (const std::string& name : lookNames()) {
    std::vector<std::string> others;
    try {
      looks.push_back({{"name", name}, {"settings", settingsOfLine(subject, {"--look", name}, others)}});
    } catch (const CLI::Error&) {
      // Of another verb.
    }
  }
  return looks;
}

}  // namespace nephele::apps

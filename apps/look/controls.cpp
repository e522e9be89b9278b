#include "apps/look/controls.h"

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <string_view>

#include "apps/detail/command.h"
#include "apps/look/plan.h"
#include "apps/looks.h"
#include "apps/manual/option_table.h"
#include "apps/options/common_group.h"
#include "apps/options/config_file.h"
#include "apps/options/expression_names.h"
#include "apps/options/first_day.h"
#include "apps/options/old_names.h"
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

bool isField(const OptionRow& option) {
  return option.type.ends_with("|FIELD");
}

/// The type of a control; fields are of the type of what varies.
std::string typeOf(const OptionRow& option) {
  if (option.isFlag) return "flag";
  if (!option.choices().empty()) return "choice";
  const std::string word = option.type.substr(0, option.type.find_first_of(":|["));
  static const std::map<std::string, std::string> types{
      {"NUMBER", "number"}, {"STOPS", "number"},  {"DEGREES", "number"},
      {"COUNT", "count"},   {"LENGTH", "length"}, {"PERCENT", "percent"},
      {"FILE", "file"},     {"FOLDER", "file"},   {"FREQUENCY", "frequency"},
      {"R,G,B", "color"},   {"X,Y,Z", "vector"},  {"AZIMUTH,ELEVATION", "angles"}};
  const auto known = types.find(word);
  const bool isWhole = word == option.type || option.type[word.size()] != '|' || isField(option);
  return known != types.end() && isWhole ? known->second : "text";
}

nlohmann::json controlOf(const OptionRow& option, const std::string& verb, bool isFirstDay) {
  nlohmann::json control = {{"name", option.name},     {"verb", verb},
                            {"help", option.help},     {"default", option.standard},
                            {"type", typeOf(option)},  {"is_field", isField(option)},
                            {"form", option.type},     {"repeats", option.repeats},
                            {"first_day", isFirstDay}, {"excludes", option.excludes},
                            {"needs", option.needs}};
  if (const auto choices = option.choices(); !choices.empty()) control["choices"] = choices;
  const auto slider = std::ranges::find(kSliders, std::string_view(option.name), &Slider::name);
  if (slider != kSliders.end())
    control.update({{"unit", slider->unit},
                    {"low", slider->low},
                    {"high", slider->high},
                    {"step", slider->step},
                    {"logarithmic", slider->isLogarithmic}});
  return control;
}

bool isShown(const OptionRow& option, const std::string& verb) {
  const bool isOfCloudsToo = verb == "render" && option.name == "seed";
  return !option.isInput && !option.isOutput && !option.group.empty() && option.group != kCommonGroup &&
         option.group != kSeveralGroup && !kNotShown.contains(option.name) && !isOfCloudsToo;
}

/// Those of the first day in their groups, then the others.
void addGroups(const Verb& verb, nlohmann::json& groups) {
  std::vector<OptionRow> rows = optionTable(verb);
  std::erase_if(rows, [&](const OptionRow& row) { return !isShown(row, verb.name); });
  for (const FirstDay& day : firstDays()) {
    if (day.verb != verb.name || day.group == "Files" || day.group == "Sequences and wedges") continue;
    auto controls = nlohmann::json::array();
    for (const std::string_view name : day.options) {
      const auto row = std::ranges::find(rows, name.substr(2), &OptionRow::name);
      if (row == rows.end()) continue;
      controls.push_back(controlOf(*row, verb.name, true));
      rows.erase(row);
    }
    groups.push_back({{"name", day.group}, {"verb", verb.name}, {"controls", controls}});
  }
  auto rest = nlohmann::json::array();
  for (const OptionRow& row : rows) rest.push_back(controlOf(row, verb.name, false));
  const std::string name = verb.name == "cloud" ? "More of the cloud" : "More of the picture";
  groups.push_back({{"name", name}, {"verb", verb.name}, {"controls", rest}});
}

std::vector<std::string> verbNames() {
  std::vector<std::string> names;
  for (const Verb& verb : allVerbs()) names.push_back(verb.name);
  return names;
}

}  // namespace

nlohmann::json lookControls(const LookSubject& subject) {
  auto groups = nlohmann::json::array();
  if (subject.hasCloud()) addGroups(cloudVerb(), groups);
  addGroups(renderVerb(), groups);
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

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
  explicit Table(const std::string& name) : verb(named(name)), command(verb) {}
  Verb named(const std::string& name) {
    if (name == "cloud") return lookCloudVerb(cloud);
    if (name == "wisps") return lookWispsVerb(wisps);
    if (name == "cut") return lookCutVerb(cut);
    if (name == "transfer") return lookTransferVerb(transfer);
    return lookRenderVerb(scene, picture);
  }
  CloudArguments cloud;
  WispsArguments wisps;
  CutArguments cut;
  TransferArguments transfer;
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
  /// Of one verb alone; others have the slider of the name that has none.
  std::string_view verb{};
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
                              Slider{"density-scale", "", 0, 4, 0.01},
                              Slider{"amplitude", "", 0, 5, 0.01, false, "wisps"},
                              Slider{"frequency", "", 0.1, 10, 0.01, true, "wisps"},
                              Slider{"density", "", 0, 20, 0.05, false, "wisps"},
                              Slider{"guides", "", 1, 1000, 1, true},
                              Slider{"wisp-size", "%", 0.5, 100, 0.1, true},
                              Slider{"wisp-size-variation", "", 0, 0.99, 0.01},
                              Slider{"dots", "", 1000, 4000000, 1, true},
                              Slider{"correlation", "", 0, 1, 0.01},
                              Slider{"thickness", "", 0, 1, 0.01},
                              Slider{"clump", "", 0, 3, 0.01},
                              Slider{"displacement", "", 0, 3, 0.01},
                              Slider{"displacement-frequency", "", 0.1, 10, 0.01, true},
                              Slider{"random-planes", "", 1, 40, 1},
                              Slider{"voronoi", "", 1, 200, 1, true},
                              Slider{"roughness", "%", 0, 4, 0.01, false, "cut"},
                              Slider{"roughness-frequency", "x", 1, 40, 0.1, true},
                              Slider{"roughness-octaves", "", 1, 12, 1},
                              Slider{"kerf", "%", 0, 5, 0.01},
                              Slider{"min-volume", "%", 0, 5, 0.01},
                              Slider{"explode", "", 0, 2, 0.01},
                              Slider{"checker", "", 1, 100, 1, true, "transfer"},
                              Slider{"iterations", "", 1, 20, 1},
                              Slider{"subdivide", "", 0, 4, 1, false, "transfer"}};

// Of `render`, those that the pictures of surfaces have, too: the camera, and the way to the screen.
const std::set<std::string> kOfAllViews{"view",
                                        "camera-position",
                                        "look-at",
                                        "up",
                                        "fov",
                                        "focal-length",
                                        "film-width",
                                        "projection",
                                        "orthographic-width",
                                        "exposure",
                                        "view-transform",
                                        "ocio-config"};

/// What may be shown for an option to say something about it.
std::vector<std::string> viewsOf(const std::string& verb, const std::string& option) {
  if (verb == "cloud") return {"cloud", "surface", "checker"};
  if (verb == "wisps") return {"wisps"};
  if (verb == "cut") return {"pieces"};
  if (verb == "transfer") return {"transfer"};
  std::vector<std::string> views{"cloud", "surface", "wisps"};
  if (kOfAllViews.contains(option)) views.insert(views.end(), {"checker", "pieces", "transfer"});
  return views;
}

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
                                      "noise-period",  "detail",
                                      "from",          "to"};

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
                            {"needs", option.needs},   {"views", viewsOf(verb, option.name)}};
  if (const auto choices = option.choices(); !choices.empty()) control["choices"] = choices;
  const auto sliderOf = [&](std::string_view itsVerb) {
    return std::ranges::find_if(
        kSliders, [&](const Slider& one) { return one.name == option.name && one.verb == itsVerb; });
  };
  const auto* slider = sliderOf(verb);
  if (slider == kSliders.end()) slider = sliderOf("");
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

/// Adds controls to the group of this name, which may be there for another verb already.
void addTo(nlohmann::json& groups, const std::string& name, const nlohmann::json& controls) {
  if (controls.empty()) return;
  for (nlohmann::json& group : groups)
    if (group["name"] == name) {
      group["controls"].insert(group["controls"].end(), controls.begin(), controls.end());
      return;
    }
  groups.push_back({{"name", name}, {"controls", controls}});
}

/// Those of the first day in their groups, then the others.
void addGroups(const std::string& verbName, nlohmann::json& groups) {
  const Table table(verbName);
  const Verb& verb = table.verb;
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
    addTo(groups, std::string(day.group), controls);
  }
  auto rest = nlohmann::json::array();
  for (const OptionRow& row : rows) rest.push_back(controlOf(row, verb.name, false));
  static const std::map<std::string, std::string> names{{"cloud", "cloud"},
                                                        {"wisps", "wisps"},
                                                        {"cut", "cut"},
                                                        {"transfer", "transfer"},
                                                        {"render", "picture"}};
  addTo(groups, "More of the " + names.at(verb.name), rest);
}

std::vector<std::string> verbNames() {
  std::vector<std::string> names;
  for (const Verb& verb : allVerbs()) names.push_back(verb.name);
  return names;
}

}  // namespace

bool isLookOfWisps(const std::string& name) {
  return lookText(name).find("\n[wisps]") != std::string::npos;
}

nlohmann::json lookControls(const LookSubject& subject) {
  auto groups = nlohmann::json::array();
  std::string last;
  for (const LookShow::What what : subject.views())
    if (const std::string verb = LookShow::verb(what); subject.hasCloud() && verb != last)
      addGroups(last = verb, groups);
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

nlohmann::json settingsOfLine(const LookSubject& subject, LookShow::What what,
                              const std::vector<std::string>& arguments, std::vector<std::string>& others) {
  const std::vector<std::string> names = verbNames();
  LookSettings settings = emptySettings();
  const auto read = [&](const std::string& verb, const std::vector<std::string>& given,
                        std::vector<std::string>& left) {
    Table table(verb);
    std::vector<std::string> all = given;
    // So that looks leave out what belongs to another shape.
    if (verb != "render" && verb != "transfer" && !subject.path.empty()) all.push_back(subject.path);
    all = withConfigFile({table.command.app, verb, names},
                         withCurrentNames(verb, std::move(all), [](const std::string&) {}));
    settings[verb] = settingsOf(table.command.app, all, left);
    for (const char* file : {"config", "look"}) settings[verb].erase(file);
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
    read(LookShow::verb(what), typed, ofRender);
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
    // Whatever else there is to see, a look is of a cloud or of wisps.
    const LookShow::What what =
        isLookOfWisps(name) && subject.hasCloud() ? LookShow::What::wisps : LookShow::What::cloud;
    std::vector<std::string> others;
    try {
      looks.push_back({{"name", name},
                       {"show", LookShow::word(what)},
                       {"settings", settingsOfLine(subject, what, {"--look", name}, others)}});
    } catch (const CLI::Error&) {
      // Of another verb.
    }
  }
  return looks;
}

}  // namespace nephele::apps

#include "apps/look/plan.h"

#include <algorithm>
#include <string_view>

#include "apps/file_hashes.h"
#include "apps/options/common_group.h"
#include "apps/options/outputs.h"
#include "apps/options/picture/picture_keys.h"

namespace nephele::apps {
namespace {

using Names = std::vector<std::string_view>;

// Options of the verb cloud that say what it grows on.
const Names kOfShape{"species", "shape-seed", "shape-size", "combine", "blend", "repair", "subdivide"};
// And those that only what comes after the layers depends on, see cloudEdgeReach for the edge.
const Names kOfDensity{"half",         "edge-thickness", "edge-variation", "density",
                       "edge-falloff", "flat-base",      "interior-noise", "height-profile",
                       "thin-out",     "advect",         "advect-steps",   "advect-frequency",
                       "wind"};
// And those that the first layer does not depend on.
const Names kOfLaterLayers{"lacunarity", "roughness", "billow", "billow-scale"};
bool isIn(std::span<const std::string_view> names, const std::string& name) {
  return std::ranges::count(names, name) > 0;
}

/// Pages may set how things look, and nothing else: no file is written but by an export, under a plain name.
void refuseOthers(const Command& command) {
  for (const CLI::Option* option : command.app.get_options()) {
    if (option->count() == 0 || option->get_lnames().empty()) continue;
    const std::string &name = option->get_lnames().front(), group = option->get_group();
    const bool isOther = isOutput(*option) || group == kCommonGroup || group == kSeveralGroup ||
                         name == "cache" || name == "cache-size" || name == "display-server";
    if (isOther)
      throw LookFault(command.verb.name, "--" + name + ": is not for the viewer, which writes exports alone");
  }
}

/// Voxels that make a quick picture.
template <class Arguments>
void makeCoarse(Arguments& arguments) {
  if (arguments.voxelSize.value > 0 && arguments.voxelSize.relative)
    arguments.voxelSize.value = std::max(arguments.voxelSize.value, 100.0 / LookPlan::kCoarseVoxels);
  else if (arguments.voxelSize.value <= 0)
    arguments.resolution = std::min(arguments.resolution, LookPlan::kCoarseVoxels);
}

/// Without options that say what is written, and how a picture for a file is seen.
void takeAway(CLI::App& app, const std::vector<std::string>& names) {
  for (const std::string& name : names) app.remove_option(app.get_option(name));
  // Nothing is written, so that no output is missing.
  app.callback({});
}

}  // namespace

Verb lookWispsVerb(WispsArguments& wisps) {
  return {"wisps", "", "", [&wisps](CLI::App& app) {
            addWispsOptions(app, wisps);
            takeAway(app, {"--output", "--points", "--half"});
            return BoundVerb{};
          }};
}

Verb lookCutVerb(CutArguments& cut) {
  return {"cut", "", "", [&cut](CLI::App& app) {
            addCutOptions(app, cut);
            takeAway(app, {"--output", "--vdb", "--format", "--preview", "--size", "--view"});
            app.get_option("--explode")->default_str(fmt::format("{:g}", cut.picture.explode));
            return BoundVerb{};
          }};
}

Verb lookTransferVerb(TransferArguments& transfer) {
  return {"transfer", "", "", [&transfer](CLI::App& app) {
            addTransferOptions(app, transfer);
            takeAway(app,
                     {"--output", "--warp", "--warped-mesh", "--attributes", "--resolution", "--bake-texture",
                      "--bake-size", "--bake-samples", "--gutter", "--preview", "--size", "--view"});
            return BoundVerb{};
          }};
}

Verb lookCloudVerb(CloudArguments& cloud) {
  return {"cloud", "", "", [&cloud](CLI::App& app) {
            addCloudOptions(app, cloud);
            app.get_option("--output")->required(false);
            return BoundVerb{};
          }};
}

Verb lookRenderVerb(SceneOptions& scene, PictureOptions& picture) {
  return {"render", "", "", [&scene, &picture](CLI::App& app) {
            addSceneInputs(app, scene, "");
            app.get_option("input")->required(false);
            addPictureOptions(app, picture);
            addSceneOptions(app, scene);
            return BoundVerb{};
          }};
}

std::unique_ptr<LookPlan::Parsed> LookPlan::parsed(Verb verb, const nlohmann::json& settings,
                                                   std::vector<std::string> arguments) {
  const std::string name = verb.name;
  try {
    auto result = std::make_unique<Parsed>(std::move(verb));
    for (std::string& argument : argumentsOf(settings)) arguments.push_back(std::move(argument));
    result->command.parse(std::move(arguments));
    refuseOthers(result->command);
    return result;
  } catch (const std::exception& error) {
    throw LookFault(name, error.what());
  }
}

LookPlan::LookPlan(const LookSubject& itsSubject, const LookSettings& itsSettings, LookShow::What its)
    : subject(itsSubject), settings(itsSettings), what(its) {
  const std::vector<LookShow::What> views = subject.views();
  if (std::ranges::count(views, what) == 0) {
    std::vector<std::string> words;
    for (const LookShow::What view : views) words.push_back(LookShow::word(view));
    throw LookFault("", fmt::format("--show: got '{}', allowed for this input: {}", LookShow::word(what),
                                    fmt::join(words, ", ")));
  }
  if (subject.hasCloud()) {
    const std::string verb = LookShow::verb(what);
    nlohmann::json own = settings[verb];
    std::vector<std::string> input;
    if (!subject.path.empty()) input.push_back(subject.path);
    if (verb == "cloud") {
      shownCommand_ = parsed(lookCloudVerb(cloud), subject.cloudSettings(settings), input);
    } else if (verb == "wisps") {
      shownCommand_ = parsed(lookWispsVerb(wisps), own, input);
    } else if (verb == "cut") {
      shownCommand_ = parsed(lookCutVerb(cut), own, input);
    } else {
      shownCommand_ =
          parsed(lookTransferVerb(transfer), own, {"--from", subject.reference, "--to", subject.path});
    }
  }
  nlohmann::json own = settings["render"];
  for (const auto& [name, value] : settings["parameters"].items())
    own["set"].push_back(name + "=" + (value.is_string() ? value.get<std::string>() : value.dump()));
  renderCommand_ =
      parsed(lookRenderVerb(scene, picture), own,
             subject.hasCloud() ? std::vector<std::string>{} : std::vector<std::string>{subject.path});
  if (picture.pathTraced)
    throw LookFault("render", "--integrator: got 'path', allowed: march, while it is looked at");
  try {
    if (subject.kind != LookSubject::Kind::script) requireNoSettings(scene.script);
    picture = picture.withView();
  } catch (const std::exception& error) {
    throw LookFault("render", error.what());
  }
}

CloudArguments LookPlan::cloudOf(Tier tier) const {
  CloudArguments result = cloud;
  if (tier == Tier::coarse) makeCoarse(result);
  return result;
}

WispsArguments LookPlan::wispsOf(Tier tier) const {
  WispsArguments result = wisps;
  if (tier == Tier::fine) return result;
  makeCoarse(result);
  result.dots = std::min(result.dots, kCoarseDots);
  return result;
}

PictureOptions LookPlan::pictureOf(Tier tier) const {
  PictureOptions result = picture;
  if (tier == Tier::fine) return result;
  result.lightQuality = Quality::draft;
  result.render.octaves.cells = kCoarseLightCells;
  return result;
}

PictureStages::Keys LookPlan::keys(Tier tier) const {
  const nlohmann::json &ofCloud = settings["cloud"], &ofRender = settings["render"];
  const std::string level = tier == Tier::coarse ? "coarse;" : "fine;";
  PictureStages::Keys keys;
  if (what == LookShow::What::wisps) {
    keys.volume = subject.stamp() + keyOf(settings["wisps"], [](const std::string&) { return true; });
  } else if (subject.hasCloud()) {
    keys.shape =
        subject.stamp() + keyOf(ofCloud, [](const std::string& name) { return isIn(kOfShape, name); });
    std::string files;
    for (const std::string& file : cloud.maskFiles()) files += fileStamp(file) + ";";
    if (ofCloud.contains("recipe")) files += fileStamp(ofCloud["recipe"].get<std::string>());
    keys.levels = level + files + keyOf(ofCloud, [](const std::string& name) {
                    return !isIn(kOfShape, name) && !isIn(kOfDensity, name);
                  });
  } else {
    keys.volume = subject.stamp();
  }
  if (growsCloud())
    keys.volume += keyOf(ofCloud, [](const std::string& name) { return isIn(kOfDensity, name); });
  keys.volume += level + settings["parameters"].dump() + keyOf(ofRender, [](const std::string& name) {
                   return !isIn(lightOptions(), name) && !isIn(mediumOptions(), name) &&
                          !isIn(screenOptions(), name) && !isIn(cameraOptions(), name);
                 });
  keys.medium = keyOf(ofRender, [](const std::string& name) { return isIn(mediumOptions(), name); });
  keys.lights = keyOf(ofRender, [](const std::string& name) { return isIn(lightOptions(), name); });
  return keys;
}

std::vector<std::string> LookPlan::layerKeys() const {
  std::string files;
  for (const std::string& file : cloud.maskFiles()) files += fileStamp(file) + ";";
  std::vector<std::string> keys;
  for (std::size_t i = 0; i < std::size_t(kMaxCumuloLayers); ++i)
    keys.push_back(files +
                   keyOf(settings["cloud"],
                         [&](const std::string& name) {
                           return !isIn(kOfShape, name) && !isIn(kOfDensity, name) && name != "recipe" &&
                                  name != "layers" && !(i == 0 && isIn(kOfLaterLayers, name));
                         }) +
                   (i < cloud.recipe.size() ? cloud.recipe[i].text : ""));
  return keys;
}

std::string LookPlan::cameraKey() const {
  return keyOf(settings["render"], [](const std::string& name) { return isIn(cameraOptions(), name); });
}

}  // namespace nephele::apps

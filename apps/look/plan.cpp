#include "apps/look/plan.h"

#include <algorithm>
#include <string_view>

#include "apps/file_hashes.h"
#include "apps/options/common_group.h"
#include "apps/options/outputs.h"
#include "apps/options/picture/light_key.h"

namespace nephele::apps {
namespace {

using Names = std::vector<std::string_view>;

// Options of the verb cloud that say what it grows on.
const Names kOfShape{"species", "shape-seed", "shape-size", "combine", "blend", "repair", "subdivide"};
// And those that only what comes after the layers depends on, see cloudEdgeReach for the edge.
const Names kOfDensity{"half",      "edge-thickness", "density",          "edge-falloff",
                       "flat-base", "interior-noise", "height-profile",   "thin-out",
                       "advect",    "advect-steps",   "advect-frequency", "wind"};
// And those that the first layer does not depend on.
const Names kOfLaterLayers{"lacunarity", "roughness", "billow", "billow-scale"};
// Options of the verb render.
const Names kOfLights{"sun", "point",         "spot",         "light-decay",   "shadow-multiplier",
                      "sky", "ground-albedo", "sky-rotation", "sky-intensity", "sky-encoding"};
const Names kOfMedium{"shadows",          "shadow-detail",
                      "shadow-tolerance", "read-deep-shadow",
                      "extinction",       "albedo",
                      "extinction-color", "phase",
                      "octaves",          "scale",
                      "quality",          "light-quality",
                      "object",           "holdout-object",
                      "object-color",     "checker",
                      "texture",          "texture-encoding",
                      "ground",           "ground-height",
                      "ground-color"};

bool isIn(std::span<const std::string_view> names, const std::string& name) {
  return std::ranges::count(names, name) > 0;
}

/// Those settings of a verb that `counts` is true of, as a key.
template <class Counts>
std::string keyOf(const nlohmann::json& settings, const Counts& counts) {
  std::string key;
  for (const auto& [name, value] : settings.items())
    if (counts(name)) key += name + "=" + value.dump() + ";";
  return key;
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

}  // namespace

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

LookPlan::LookPlan(const LookSubject& itsSubject, const LookSettings& itsSettings)
    : subject(itsSubject), settings(itsSettings) {
  if (subject.hasCloud()) {
    nlohmann::json own = settings["cloud"];
    // What nobody has given grows on a shape of its own.
    if (subject.path.empty() && !own.contains("species")) own["species"] = "mediocris";
    cloudCommand_ =
        parsed(lookCloudVerb(cloud), own,
               subject.path.empty() ? std::vector<std::string>{} : std::vector<std::string>{subject.path});
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
    picture = picture.withView();
  } catch (const std::exception& error) {
    throw LookFault("render", error.what());
  }
}

CloudArguments LookPlan::cloudOf(Tier tier) const {
  CloudArguments result = cloud;
  if (tier == Tier::fine) return result;
  if (result.voxelSize.value > 0 && result.voxelSize.relative)
    result.voxelSize.value = std::max(result.voxelSize.value, 100.0 / kCoarseVoxels);
  else if (result.voxelSize.value <= 0)
    result.resolution = std::min(result.resolution, kCoarseVoxels);
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
  if (subject.hasCloud()) {
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
  keys.volume += level + keyOf(ofCloud, [](const std::string& name) { return isIn(kOfDensity, name); }) +
                 settings["parameters"].dump() + keyOf(ofRender, [](const std::string& name) {
                   return !isIn(kOfLights, name) && !isIn(kOfMedium, name) && !isIn(screenOptions(), name) &&
                          !isIn(cameraOptions(), name);
                 });
  keys.medium = keyOf(ofRender, [](const std::string& name) { return isIn(kOfMedium, name); });
  keys.lights = keyOf(ofRender, [](const std::string& name) { return isIn(kOfLights, name); });
  return keys;
}

std::vector<std::string> LookPlan::layerKeys() const {
  std::string files;
  for (const std::string& file : cloud.maskFiles()) files += fileStamp(file) + ";";
  std::vector<std::string> keys;
  for (std::size_t i = 0; i < std::size_t(cloud.layerCount()); ++i)
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

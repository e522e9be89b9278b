#include "apps/options/cloud_cache.h"

#include <fmt/format.h>

#include "apps/options/cloud_options.h"
#include "apps/options_digest.h"

namespace nephele::apps {
namespace {

/// What the levels of a cloud do not depend on, or only by the shape, the voxels and the reach of the edge.
constexpr std::string_view kNotOfLayers[]{"input",          "species",        "shape-seed",
                                          "shape-size",     "repair",         "subdivide",
                                          "resolution",     "voxel-size",     "half",
                                          "density",        "edge-thickness", "edge-variation",
                                          "edge-falloff",   "flat-base",      "interior-noise",
                                          "height-profile", "thin-out",       "advect",
                                          "advect-steps",   "cache",          "advect-frequency",
                                          "cache-size",     "frames",         "only",
                                          "shard",          "wedge",          "combine",
                                          "blend"};

std::string keyOf(const Mesh& shape, const CloudArguments& arguments, const CloudOptions& options, Run& run) {
  ContentHash hash;
  for (const std::string& file : arguments.maskFiles()) hash.addFile(file);
  hash.addNumbers(std::span(shape.positions));
  hash.addNumbers(std::span(shape.corners));
  for (const MeshAttribute& attribute : shape.attributes) {
    hash.add(attribute.name);
    hash.addNumbers(std::span(attribute.values));
  }
  // Ramps lie along the box of the shape, in a sequence of all shapes.
  const Box box = run.box(boundingBox(shape));
  hash.addNumbers(std::span(&box, 1));
  const bool isMoving = arguments.noiseTime || !arguments.recipe.empty();
  const int frame = arguments.asksForTime() ? run.frame().value_or(0) : 0;
  const float edge = options.edgeThickness.range(Box::everywhere()).max;
  return optionsDigest(
      *arguments.cache.app, kNotOfLayers,
      fmt::format("{} {} {} {} {} {}", hash.text(), options.voxelSize,
                  cloudEdgeReach(edge, options.voxelSize), run.longestSide(boundingBox(shape)),
                  run.part && isMoving ? run.part->framesSinceFirst : 0, frame),
      run.files);
}

}  // namespace

Cloud CloudCacheArguments::grown(const Mesh& shape, const CloudArguments& arguments,
                                 const CloudOptions& options, Run& run) const {
  if (cache.folder.empty()) return makeCloud(shape, options, run);
  const LevelCache levelCache(cache);
  const std::string key = keyOf(shape, arguments, options, run);
  std::optional<CloudLevels> levels = levelCache.read(key, run);
  const bool isReused = levels.has_value();
  bool isKept = isReused;
  if (!levels) {
    levels.emplace(makeCloudLevels(shape, options, run));
    isKept = levelCache.write(key, *levels, run);
  }
  run.stats["cache"] = {{"file", isKept ? levelCache.pathOf(key) : ""}, {"reused", isReused}};
  if (isReused) run.detail(fmt::format("the layers are those of {}", levelCache.pathOf(key)));
  return makeCloud(*levels, options, run);
}

void addCloudCacheOptions(CLI::App& app, CloudCacheArguments& a) {
  a.app = &app;
  CLI::Option* folder =
      app.add_option(
             "--cache", a.cache.folder,
             "Keep the layers in this folder, so that a cloud of other densities and edges takes a small "
             "part of the time.")
          ->type_name("FOLDER");
  app.add_option_function<std::string>(
         "--cache-size",
         [&a](const std::string& text) {
           const auto bytes = parseBytes(text);
           if (!bytes) refuseValue("--cache-size", text, "a size such as 20G or 500M");
           a.cache.mostBytes = *bytes;
         },
         "What the folder may hold; the layers that were of no use for longest go.")
      ->type_name("SIZE")
      ->default_str("20G")
      ->needs(folder);
}

}  // namespace nephele::apps

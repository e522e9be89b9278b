#include <fmt/format.h>

#include <memory>

#include "apps/app.h"
#include "apps/cloud_options.h"

namespace nephele::apps {
namespace {

nlohmann::json layersOf(const Cloud& cloud) {
  auto layers = nlohmann::json::array();
  for (const CumuloLayerReport& layer : cloud.layers)
    layers.push_back({{"amplitude", layer.amplitude},
                      {"frequency", layer.frequency},
                      {"voxel_size", layer.voxelSize},
                      {"active_voxels", layer.activeVoxels},
                      {"unconverged_fraction", layer.unconvergedFraction},
                      {"mean_displacement", layer.meanDisplacement},
                      {"seconds", layer.seconds}});
  return layers;
}

void growCloud(const CloudArguments& arguments, Run& run) {
  const Mesh shape = arguments.shape.shape(run);
  const CloudOptions options = arguments.resolved(boundingBox(shape));
  run.requireMemory(estimatedCloudBytes(shape, options),
                    "use larger voxels (a lower --resolution or a larger --voxel-size)");
  Cloud cloud = makeCloud(shape, options, run);
  cloud.density =
      arguments.advection.carried(cloud.density, boundingBox(shape).longestSide(), arguments.seed, run);
  run.stats["layers"] = layersOf(cloud);

  run.begin("write");
  auto metadata = run.metadata();
  metadata["seed"] = std::to_string(arguments.seed);
  writeVdbFile(arguments.output, {cloud.density}, metadata);
  if (cloud.surface) writeVdbFile(arguments.surface, {*cloud.surface}, metadata);

  const VdbGridInfo density = describe(cloud.density);
  run.stats["grid"] = {{"voxel_size", options.voxelSize},
                       {"active_voxels", density.activeVoxels},
                       {"memory_bytes", density.memoryBytes}};
  run.result(fmt::format("{}: grid 'density', voxel size {:g}, {} active voxels", arguments.output,
                         options.voxelSize, density.activeVoxels));
  if (cloud.surface)
    run.result(fmt::format("{}: grid 'surface', {} active voxels", arguments.surface,
                           describe(*cloud.surface).activeVoxels));
}

}  // namespace

Verb cloudVerb() {
  const auto arguments = std::make_shared<CloudArguments>();
  return {"cloud", "Grows a cumulus cloud on a mesh, a level set or a shape of its own.",
          "nephele cloud bunny.obj -o bunny_cloud.vdb --resolution 512 --frequency 6x",
          [arguments](CLI::App& app) { addCloudOptions(app, *arguments); },
          [arguments](Run& run) { growCloud(*arguments, run); }};
}

}  // namespace nephele::apps

#include <fmt/format.h>

#include "apps/app.h"
#include "apps/options/cloud_options.h"

namespace nephele::apps {
namespace {

std::string span(const Interval& range) {
  return range.isPoint() ? fmt::format("{:g}", range.min) : fmt::format("{:g} to {:g}", range.min, range.max);
}

/// Says what the layers are, and which of them voxels cannot hold.
void tellLayers(const CloudArguments& arguments, const CloudOptions& options, const Box& box,
                const Run& run) {
  // The absolute value doubles the frequencies of a noise, and a wave needs two voxels.
  const double highest = 1 / (4 * double(options.voxelSize));
  for (std::size_t i = 0; i < options.layers.size(); ++i) {
    const CumuloLayer& layer = options.layers[i];
    run.detail(fmt::format("layer {}: {}, frequency {:g}, amplitude {}, billow {}, billow scale {}", i + 1,
                           arguments.noiseOf(i), layer.frequency, span(layer.amplitude.range(box)),
                           span(layer.billow.range(box)), span(layer.billowScale.range(box))));
    if (const float finest = layer.frequency * layer.detail; finest > highest)
      run.note(
          fmt::format("warning: layer {} has bumps of frequency {:g}, and voxels of {:g} hold at most {:g} "
                      "(four voxels per wave); use fewer layers, a lower frequency, or voxels of {:g}",
                      i + 1, finest, options.voxelSize, highest, 1 / (4 * finest)));
  }
}

nlohmann::json layersOf(const Cloud& cloud, const CloudOptions& options, const CloudArguments& arguments,
                        const Box& box) {
  const auto limits = [&](const ScalarField& field) {
    const Interval range = field.range(box);
    return nlohmann::json{range.min, range.max};
  };
  auto layers = nlohmann::json::array();
  for (std::size_t i = 0; i < cloud.layers.size(); ++i) {
    const CumuloLayerReport& layer = cloud.layers[i];
    layers.push_back({{"noise", arguments.noiseOf(i)},
                      {"amplitude", layer.amplitude},
                      {"amplitude_range", limits(options.layers[i].amplitude)},
                      {"billow_range", limits(options.layers[i].billow)},
                      {"billow_scale_range", limits(options.layers[i].billowScale)},
                      {"frequency", layer.frequency},
                      {"voxel_size", layer.voxelSize},
                      {"active_voxels", layer.activeVoxels},
                      {"unconverged_fraction", layer.unconvergedFraction},
                      {"mean_displacement", layer.meanDisplacement},
                      {"seconds", layer.seconds}});
  }
  return layers;
}

void growCloud(const CloudArguments& arguments, Run& run) {
  run.expect(0, 0.02);
  const Mesh shape = arguments.shapeOf(arguments.shape, run);
  FieldSources sources = arguments.sources(shape, run);
  const CloudOptions options = arguments.resolved(sources, run);
  tellLayers(arguments, options, sources.box(), run);
  const std::string whose = arguments.shape.name();
  const double bytes = namingFile(whose, [&] { return estimatedCloudBytes(shape, options); });
  run.requireMemory(bytes, "use larger voxels (a lower --resolution or a larger --voxel-size)");
  // Distance, layers, density and perhaps the surface.
  run.expect(0.02, 0.9, int(options.layers.size()) + (options.withSurface ? 3 : 2));
  Cloud cloud = namingFile(whose, [&] { return arguments.cache.grown(shape, arguments, options, run); });
  run.expect(0.9, 1, 2);
  const auto fileOf = [&](VoxelGrid<float>& grid, const char* name, VdbGridInfo::Class gridClass) {
    return toVdb(std::move(grid), {name, gridClass, arguments.halfFloat});
  };
  const VdbGrid density = arguments.advection.carried(
      fileOf(cloud.density, "density", VdbGridInfo::Class::fogVolume), sources, arguments.seed, run);
  run.stats["layers"] = layersOf(cloud, options, arguments, sources.box());
  run.begin("write");
  auto metadata = run.metadata();
  metadata["seed"] = std::to_string(arguments.seed);
  writeVdbFile(arguments.output, {density}, metadata);
  const VdbGridInfo info = describe(density);
  run.stats["grid"] = {{"voxel_size", options.voxelSize},
                       {"active_voxels", info.activeVoxels},
                       {"memory_bytes", info.memoryBytes}};
  run.result(fmt::format("{}: grid 'density', voxel size {:g}, {} active voxels", arguments.output,
                         options.voxelSize, info.activeVoxels));
  if (!cloud.surface) return;
  const VdbGrid surface = fileOf(*cloud.surface, "surface", VdbGridInfo::Class::levelSet);
  writeVdbFile(arguments.surface, {surface}, metadata);
  run.result(
      fmt::format("{}: grid 'surface', {} active voxels", arguments.surface, describe(surface).activeVoxels));
}

}  // namespace

Verb cloudVerb() {
  return verbOf("cloud", "Grows a cumulus cloud on a mesh, a level set or a shape of its own.",
                "nephele cloud examples/hare.obj -o hare_cloud.vdb --resolution 512 --frequency 6x",
                addCloudOptions, growCloud, fieldValueHelp(),
                [](const CloudArguments& arguments, Run& run) { return arguments.extent(run); });
}

}  // namespace nephele::apps

#include <fmt/format.h>

#include "apps/app.h"
#include "apps/options/wisps_options.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/error.h"

namespace nephele::apps {
namespace {

/// Bytes of a dot while it waits to be written as a point.
constexpr double kPointBytes = 64;

void append(Mesh& all, const Mesh& part) {
  all.positions.insert(all.positions.end(), part.positions.begin(), part.positions.end());
  if (all.attributes.empty())
    all.attributes = part.attributes;
  else
    for (std::size_t a = 0; a < part.attributes.size(); ++a)
      all.attributes[a].values.insert(all.attributes[a].values.end(), part.attributes[a].values.begin(),
                                      part.attributes[a].values.end());
}

Extent extentOfWisps(const WispsArguments& arguments, Run& run) {
  const std::vector<WispGuide> guides = arguments.readGuides(run);
  const Box box = wispBox(guides, arguments.resolved(guides, run).wisps);
  return {box, double(box.longestSide())};
}

void makeWisps(const WispsArguments& arguments, Run& run) {
  const std::vector<WispGuide> guides = arguments.readGuides(run);
  WispVolumeOptions options = arguments.resolved(guides, run);
  const double dots = double(guides.size()) * options.wisps.dots;
  run.requireMemory(
      estimatedWispBytes(guides, options) + (arguments.points.empty() ? 0 : dots * kPointBytes),
      "use larger voxels (a lower --resolution or a larger --voxel-size), or fewer or smaller wisps");

  run.begin("bake");
  Mesh points;
  if (!arguments.points.empty()) options.also = [&](const DotSpans& part) { append(points, pointsOf(part)); };
  const DotVolume volume = namingFile(arguments.input, [&] { return bakeWisps(guides, options, run); });

  run.begin("write");
  auto metadata = run.metadata();
  metadata["seed"] = std::to_string(arguments.seed);
  using Class = VdbGridInfo::Class;
  std::vector<VdbGrid> grids{toVdb(volume.densityGrid(), {"density", Class::fogVolume, arguments.halfFloat})};
  if (options.dots.withColor)
    grids.push_back(toVdb(volume.colorGrid(), {"Cd", Class::unknown, arguments.halfFloat}));
  writeVdbFile(arguments.output, grids, metadata);
  if (!arguments.points.empty()) writeMesh(arguments.points, points);

  run.stats["guides"] = guides.size();
  run.stats["dots"] = volume.dotCount();
  run.stats["mass"] = volume.mass();
  run.stats["grids"] = nlohmann::json::array();
  for (const VdbGrid& grid : grids) {
    const VdbGridInfo info = describe(grid);
    run.stats["grids"].push_back({{"name", info.name},
                                  {"voxel_size", options.dots.voxelSize},
                                  {"active_voxels", info.activeVoxels},
                                  {"memory_bytes", info.memoryBytes}});
    run.result(fmt::format("{}: grid '{}', voxel size {:g}, {} active voxels", arguments.output, info.name,
                           options.dots.voxelSize, info.activeVoxels));
  }
  run.result(fmt::format("{}: {} dots of {} guides", arguments.output, volume.dotCount(), guides.size()));
}

}  // namespace

Verb wispsVerb() {
  return verbOf("wisps", "Grows wisps of fine dots on guide particles.",
                "nephele wisps examples/hare.obj -o hare.vdb --guides 60 --wisp-size 5% --dots 50000",
                addWispsOptions, makeWisps, {}, extentOfWisps);
}

}  // namespace nephele::apps

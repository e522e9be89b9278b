#include <fmt/format.h>

#include "apps/options/levelset_options.h"
#include "apps/options/mesh_options.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/error.h"

namespace nephele::apps {
namespace {

struct Converted {
  VoxelGrid<float> level;
  double voxelSize;
  /// Of the mesh, where there is one.
  std::optional<double> volume{};
};

Converted convertMesh(const LevelsetArguments& options, Run& run) {
  const std::string& input = options.inputs[0];
  run.begin("read");
  const Mesh soup = readMesh(input);
  run.begin("repair");
  MeshRepairOptions repair = options.repair;
  repair.voxelSize = options.voxelSize(run.longestSide(boundingBox(soup)));
  RepairedMesh repaired = namingFile(input, [&] { return repairMesh(soup, repair, run); });
  for (const std::string& what : repaired.repairs) run.note(what);
  if (options.subdivide > 0) {
    repaired.mesh = namingFile(
        input, [&] { return subdividedAsAsked(std::move(repaired.mesh), options.subdivide, run); });
    repaired.after = diagnose(repaired.mesh);
  }
  const MeshDiagnosis& is = repaired.after;
  MeshToLevelSetOptions conversion = options.conversion;
  conversion.voxelSize = options.voxelSize(run.longestSide(is.box));
  run.requireMemory(
      estimateLevelSetBytes(repaired.mesh, conversion),
      "use larger voxels (a lower --resolution or a larger --voxel-size) or a smaller --half-width");
  run.stats["mesh"] = {
      {"vertices", is.vertices}, {"triangles", is.triangles}, {"closed", is.closed()}, {"volume", is.volume}};
  run.stats["repairs"] = repaired.repairs;
  return {namingFile(input, [&] { return meshToLevelSet(repaired.mesh, conversion, run); }),
          conversion.voxelSize, is.volume};
}

Converted combine(const LevelsetArguments& options, Run& run) {
  const Solids solids(options.inputs, options.repair, options.subdivide, run);
  const double longestSide = run.longestSide(solids.box());
  MeshToLevelSetOptions conversion = options.conversion;
  conversion.voxelSize = options.voxelSize(longestSide, solids.ownVoxelSize());
  run.stats["inputs"] = solids.description();
  return {solids.combined(options.combine, conversion, longestSide, run), conversion.voxelSize};
}

void convert(const LevelsetArguments& options, Run& run) {
  options.combine.refuseFor(options.inputs.size());
  Converted converted = options.isMesh() ? convertMesh(options, run) : combine(options, run);
  const double volume = enclosedVolume(converted.level);

  run.begin("write");
  const VdbGrid grid = toVdb(std::move(converted.level), {"surface", VdbGridInfo::Class::levelSet});
  writeVdbFile(options.output, {grid}, run.metadata());

  run.begin("describe");
  const VdbGridInfo info = describe(grid);
  run.stats["grid"] = {
      {"voxel_size", converted.voxelSize}, {"active_voxels", info.activeVoxels}, {"volume", volume}};
  run.result(fmt::format("{}: grid '{}', voxel size {:g}, {} active voxels, volume {:g}{}", options.output,
                         info.name, converted.voxelSize, info.activeVoxels, volume,
                         converted.volume ? fmt::format(" (mesh {:g})", *converted.volume) : ""));
}

}  // namespace

Verb levelsetVerb() {
  return verbOf("levelset", "Turns closed meshes into a signed distance volume, and combines several.",
                "nephele levelset examples/hare.obj -o hare.vdb --resolution 512", addLevelsetOptions,
                convert, {}, [](const LevelsetArguments& options, Run&) { return options.extent(); });
}

}  // namespace nephele::apps

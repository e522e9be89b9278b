#include <fmt/format.h>

#include "apps/app.h"
#include "apps/options/mesh_options.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/levelset/mesh/mesh_to_level_set.h"
#include "nephele/modeling/base/error.h"

namespace nephele::apps {
namespace {

struct LevelsetOptions {
  std::string input;
  std::string output;
  Length voxelSize;
  int resolution = 256;
  MeshToLevelSetOptions conversion;
  MeshRepairOptions repair;
  int subdivide = 0;
  const CLI::Option* voxelSizeOption = nullptr;
};

void bindOptions(CLI::App& app, LevelsetOptions& options) {
  app.add_option("input", options.input, "Mesh to convert (.obj, .ply, .stl, .off, .gltf, .glb).")
      ->required()
      ->type_name("FILE");
  addOutput(app, "-o,--output", options.output, {".vdb"}, "Volume to write; its grid is called 'surface'.")
      ->required();
  auto* resolution = addCount(app, "--resolution", options.resolution, 1, 1000000,
                              "Voxels along the longest side of the mesh.");
  options.voxelSizeOption = addLength(app, "--voxel-size", options.voxelSize,
                                      "Edge of a voxel, instead of --resolution.", Sign::positive)
                                ->excludes(resolution);
  addNumber(app, "--half-width", options.conversion.halfWidthVoxels, 1, 1000,
            "Voxels on either side of the surface that hold distances.");
  addPercent(app, "--max-volume-error", options.conversion.mostVolumeError, 1e-6, 100,
             "Fail where the volume differs from that of the mesh by this share; from 1 % on it is said.");
  addRepair(app, options.repair.mode);
  addSubdivide(app, options.subdivide);
}

double voxelSizeOf(const LevelsetOptions& options, double longestSide) {
  return options.voxelSizeOption->count() > 0 ? options.voxelSize.worldUnits(longestSide)
                                              : longestSide / options.resolution;
}

void convert(const LevelsetOptions& options, Run& run) {
  run.begin("read");
  const Mesh soup = readMesh(options.input);
  run.begin("repair");
  MeshRepairOptions repair = options.repair;
  repair.voxelSize = voxelSizeOf(options, run.longestSide(boundingBox(soup)));
  RepairedMesh repaired = namingFile(options.input, [&] { return repairMesh(soup, repair, run); });
  for (const std::string& what : repaired.repairs) run.note(what);
  if (options.subdivide > 0) {
    repaired.mesh = namingFile(
        options.input, [&] { return subdividedAsAsked(std::move(repaired.mesh), options.subdivide, run); });
    repaired.after = diagnose(repaired.mesh);
  }

  MeshToLevelSetOptions conversion = options.conversion;
  conversion.voxelSize = voxelSizeOf(options, run.longestSide(repaired.after.box));
  run.requireMemory(
      estimateLevelSetBytes(repaired.mesh, conversion),
      "use larger voxels (a lower --resolution or a larger --voxel-size) or a smaller --half-width");
  VoxelGrid<float> level =
      namingFile(options.input, [&] { return meshToLevelSet(repaired.mesh, conversion, run); });
  const double volume = enclosedVolume(level);

  run.begin("write");
  const VdbGrid grid = toVdb(std::move(level), {"surface", VdbGridInfo::Class::levelSet});
  writeVdbFile(options.output, {grid}, run.metadata());

  run.begin("describe");
  const VdbGridInfo info = describe(grid);
  run.stats["mesh"] = {{"vertices", repaired.after.vertices},
                       {"triangles", repaired.after.triangles},
                       {"closed", repaired.after.closed()},
                       {"volume", repaired.after.volume}};
  run.stats["repairs"] = repaired.repairs;
  run.stats["grid"] = {
      {"voxel_size", conversion.voxelSize}, {"active_voxels", info.activeVoxels}, {"volume", volume}};
  run.result(fmt::format("{}: grid '{}', voxel size {:g}, {} active voxels, volume {:g} (mesh {:g})",
                         options.output, info.name, conversion.voxelSize, info.activeVoxels, volume,
                         repaired.after.volume));
}

}  // namespace

Verb levelsetVerb() {
  return verbOf("levelset", "Turns a closed mesh into a signed distance volume.",
                "nephele levelset bunny.obj -o bunny.vdb --resolution 512", bindOptions, convert, {},
                [](const LevelsetOptions& options, Run&) { return extentOfFile(options.input); });
}

}  // namespace nephele::apps

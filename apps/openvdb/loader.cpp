#include <utility>

#include "apps/detail/program_module.h"
#include "apps/openvdb/functions.h"

namespace nephele {
namespace {

const apps::OpenVdbFunctions& functions() {
  static const apps::OpenVdbFunctions& loaded = []() -> const apps::OpenVdbFunctions& {
    constexpr char kModule[] = "nephele-openvdb.so", kKnows[] = "VDB";
    const auto& exported = *static_cast<const apps::OpenVdbFunctions*>(
        apps::exportedByModule(kModule, "nepheleOpenVdbFunctions", kKnows));
    if (exported.layout != apps::OpenVdbLayout{.functions = sizeof(apps::OpenVdbFunctions)})
      apps::refuseModule(kModule, kKnows);
    return exported;
  }();
  return loaded;
}

}  // namespace

std::vector<VdbGrid> readVdbFile(const std::string& path) {
  return functions().readVdbFile(path);
}

std::vector<VdbGrid> readVdbHeaders(const std::string& path) {
  return functions().readVdbHeaders(path);
}

VdbGrid readScalarGrid(const std::string& path, const std::string& name) {
  return functions().readScalarGrid(path, name);
}

std::array<VdbGrid, 3> readVectorGrid(const std::string& path, const std::string& name) {
  return functions().readVectorGrid(path, name);
}

void writeVdbFile(const std::string& path, const std::vector<VdbGrid>& grids,
                  const std::map<std::string, std::string>& metadata) {
  functions().writeVdbFile(path, grids, metadata);
}

VdbGridInfo describe(const VdbGrid& grid) {
  return functions().describe(grid);
}

VdbValueRange valueRange(const VdbGrid& grid) {
  return functions().valueRange(grid);
}

std::string listOf(const std::vector<VdbGrid>& grids) {
  return functions().listOf(grids);
}

void requireWritable(const std::vector<VdbGrid>& grids) {
  functions().requireWritable(grids);
}

VdbGridLabel labelOf(const VdbGrid& grid) {
  return functions().labelOf(grid);
}

std::optional<std::string> metadataOf(const VdbGrid& grid, const std::string& key) {
  return functions().metadataOf(grid, key);
}

void copyMetadata(const VdbGrid& from, VdbGrid& to) {
  functions().copyMetadata(from, to);
}

Box contentBox(const VdbGrid& grid) {
  return functions().contentBox(grid);
}

std::array<VdbGrid, 3> vectorComponents(const VdbGrid& grid) {
  return functions().vectorComponents(grid);
}

VoxelGrid<Vec3f> toVectorVoxels(const VdbGrid& grid) {
  return functions().toVectorVoxels(grid);
}

VdbValues valuesOf(const VdbGrid& grid) {
  return functions().valuesOf(grid);
}

VdbGrid moved(const VdbGrid& grid, const Similarity& by) {
  return functions().moved(grid, by);
}

std::shared_ptr<BrickGrid> toBricks(const VdbGrid& grid, const BrickSink& made) {
  return functions().toBricks(grid, made);
}

VdbGrid toVdb(const BrickGrid& bricks, const VdbGridLabel& label) {
  return functions().bricksToVdb(bricks, label);
}

VdbGrid toVdb(const VectorGrids& grids, const VdbGridLabel& label) {
  return functions().vectorsToVdb(grids, label);
}

VdbGrid toVdb(VoxelGrid<float> voxels, const VdbGridLabel& label) {
  return functions().voxelsToVdb(std::move(voxels), label);
}

VdbGrid toVdb(VoxelGrid<Vec3f> voxels, const VdbGridLabel& label) {
  return functions().vectorVoxelsToVdb(std::move(voxels), label);
}

Mesh adaptiveMesh(const BrickGrid& grid, double isovalue, double adaptivity) {
  return functions().adaptiveMesh(grid, isovalue, adaptivity);
}

ScalarField sweptDistance(const ScalarField& level, const BakeOptions& spec, const DistanceBand& band,
                          const Progress& progress) {
  return functions().sweptDistance(level, spec, band, progress);
}

ScalarField rebuiltDistance(const ScalarField& level, const BakeOptions& spec, const DistanceBand& band,
                            const Progress& progress) {
  return functions().rebuiltDistance(level, spec, band, progress);
}

VoxelGrid<float> detail::floodedBand(const Mesh& mesh, const BandOptions& options, const Progress& progress) {
  return functions().floodedBand(mesh, options, progress);
}

}  // namespace nephele

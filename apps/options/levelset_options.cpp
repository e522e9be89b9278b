#include "apps/options/levelset_options.h"

#include "apps/options/mesh_options.h"
#include "nephele/levelset/io/vdb_io.h"

namespace nephele::apps {

bool LevelsetArguments::isMesh() const {
  return inputs.size() == 1 && !isVolumeFile(inputs[0]);
}

double LevelsetArguments::voxelSize(double longestSide, std::optional<double> own) const {
  if (voxelSizeOption->count() > 0) return voxelSizeTyped.worldUnits(longestSide);
  return own && resolutionOption->count() == 0 ? *own : longestSide / resolution;
}

Extent LevelsetArguments::extent() const {
  Extent all = extentOfFile(inputs[0]);
  for (std::size_t i = 1; i < inputs.size(); ++i) all.include(extentOfFile(inputs[i]));
  return all;
}

void addLevelsetOptions(CLI::App& app, LevelsetArguments& a) {
  app.add_option(
         "input", a.inputs,
         "Mesh to convert (.obj, .ply, .stl, .off, .gltf, .glb); or several, and level sets (.vdb), to be "
         "combined.")
      ->required()
      ->type_name("FILE");
  addOutput(app, "-o,--output", a.output, {".vdb"}, "Volume to write; its grid is called 'surface'.")
      ->required();
  a.resolutionOption =
      addCount(app, "--resolution", a.resolution, 1, 1000000, "Voxels along the longest side of the input.")
          ->default_str("256, or those of a level set");
  a.voxelSizeOption = addLength(app, "--voxel-size", a.voxelSizeTyped,
                                "Edge of a voxel, instead of --resolution.", Sign::positive)
                          ->excludes(const_cast<CLI::Option*>(a.resolutionOption));
  addNumber(app, "--half-width", a.conversion.halfWidthVoxels, 1, 1000,
            "Voxels on either side of the surface that hold distances.");
  addPercent(app, "--max-volume-error", a.conversion.mostVolumeError, 1e-6, 100,
             "Fail where the volume differs from that of the mesh by this share; from 1 % on it is said.");
  addCombineOptions(app, a.combine);
  addRepair(app, a.repair.mode);
  addSubdivide(app, a.subdivide);
}

}  // namespace nephele::apps

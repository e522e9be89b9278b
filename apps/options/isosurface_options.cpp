#include "apps/options/isosurface_options.h"

#include <fmt/format.h>

#include <algorithm>

#include "nephele/levelset/io/vdb_io.h"
#include "nephele/levelset/mesh/adaptive_mesh.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/modeling/base/error.h"

namespace nephele::apps {
namespace {

// Bricks hold 11^3 samples for 8^3 voxels and are rarely full; about one voxel in five of a narrow band has
// two triangles.
double estimatedBytes(const VdbGridInfo& info) {
  const Vec3d size(info.indexMax - info.indexMin);
  return 50.0 * double(info.activeVoxels) + (size.x / 8 + 2) * (size.y / 8 + 2) * (size.z / 8 + 2) * 4;
}

[[noreturn]] void refuseEmpty(const std::string& volume, const VdbGridInfo& info, const VdbValueRange& values,
                              double isovalue) {
  const double sign = info.gridClass == VdbGridInfo::Class::levelSet ? -1 : 1;
  const auto [low, high] = std::minmax({sign * double(values.min), sign * double(values.max)});
  throw Error(fmt::format("{}: no surface at --isovalue {:g}: the values of grid '{}' go from {:g} to {:g}{}",
                          volume, isovalue, info.name, low, high, sign < 0 ? " (positive inside)" : ""));
}

}  // namespace

Mesh IsosurfaceOptions::surfaceOf(const std::string& volume, Run& run) const {
  run.begin("read");
  const VdbGrid file = readScalarGrid(volume, grid);
  const VdbGridInfo info = describe(file);
  run.requireMemory(estimatedBytes(info), "make the volume with larger voxels (--voxel-size)");
  const bool isLevelSet = info.gridClass == VdbGridInfo::Class::levelSet;
  if (isovalue.relative && !isLevelSet)
    refuseValue(
        "--isovalue", fmt::format("{:g}%", isovalue.value),
        fmt::format("a number; grid '{}' is no level set, so that its values are no lengths", info.name));
  const double side = isovalue.relative ? run.longestSide(boundingBox(marchingCubes(*toBricks(file)))) : 0.0;
  const double level = isovalueOption->count() > 0 ? isovalue.worldUnits(side) : isLevelSet ? 0.0 : 0.5;
  run.stats["mesh"] = {{"isovalue", level}};

  const Mesh mesh = namingFile(volume, [&] {
    if (adaptivityOption->count() == 0) return marchingCubes(*toBricks(file), float(level), run);
    run.begin("adaptive mesh");
    return adaptiveMesh(*toBricks(file), level, adaptivity);
  });
  if (mesh.faceCount() == 0) refuseEmpty(volume, info, valueRange(file), level);
  return mesh;
}

void IsosurfaceOptions::refuseFor(const std::string& mesh) const {
  refuseGiven({gridOption, isovalueOption, adaptivityOption}, mesh + " is a mesh; this is for volumes");
}

void addIsosurfaceOptions(CLI::App& app, IsosurfaceOptions& options) {
  options.gridOption =
      app.add_option("--grid", options.grid, "Grid of the file; default: the first that holds numbers.")
          ->type_name("NAME");
  options.isovalueOption =
      addLength(app, "--isovalue", options.isovalue,
                "Level sets: how far the surface moves inwards. Densities: a number; inside is above.",
                Sign::any)
          ->default_str("0 or, for densities, 0.5");
  options.adaptivityOption = addNumber(app, "--adaptivity", options.adaptivity, 0, 1,
                                       "Use OpenVDB's dual mesher; larger faces with larger values.")
                                 ->default_str("off");
}

}  // namespace nephele::apps

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <memory>

#include "apps/app.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/levelset/mesh/adaptive_mesh.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/levelset/mesh/mesh_repair.h"

namespace nephele::apps {
namespace {

struct MeshOptions {
  std::string input;
  std::string output;
  std::string grid;
  double isovalue = 0;
  double adaptivity = 0;
  const CLI::Option* isovalueOption = nullptr;
  const CLI::Option* adaptivityOption = nullptr;
};

void bindOptions(CLI::App& app, MeshOptions& options) {
  constexpr double kAny = std::numeric_limits<double>::max();
  app.add_option("input", options.input, "Volume to mesh (.vdb, .nvdb).")->required()->type_name("FILE");
  addOutput(app, "-o,--output", options.output, {".obj", ".ply", ".stl"}, "Mesh to write.")->required();
  app.add_option("--grid", options.grid, "Grid of the file; default: the first that holds numbers.")
      ->type_name("NAME");
  options.isovalueOption =
      addNumber(app, "--isovalue", options.isovalue, -kAny, kAny,
                "Level sets: world units that the surface moves inwards. Densities: inside is above.")
          ->default_str("0 or, for densities, 0.5");
  options.adaptivityOption = addNumber(app, "--adaptivity", options.adaptivity, 0, 1,
                                       "Use OpenVDB's dual mesher; larger faces with larger values.")
                                 ->default_str("off");
}

// Bricks hold 11^3 samples for 8^3 voxels and are rarely full; about one voxel in five of a narrow band has
// two triangles.
double estimatedBytes(const VdbGridInfo& info) {
  const Vec3d size(info.indexMax - info.indexMin);
  return 50.0 * double(info.activeVoxels) + (size.x / 8 + 2) * (size.y / 8 + 2) * (size.z / 8 + 2) * 4;
}

[[noreturn]] void refuseEmpty(const MeshOptions& options, const VdbGridInfo& info, double isovalue) {
  const double sign = info.gridClass == VdbGridInfo::Class::levelSet ? -1 : 1;
  const auto [low, high] = std::minmax({sign * double(info.valueMin), sign * double(info.valueMax)});
  throw Error(fmt::format("{}: no surface at --isovalue {:g}: the values of grid '{}' go from {:g} to {:g}{}",
                          options.input, isovalue, info.name, low, high,
                          sign < 0 ? " (positive inside)" : ""));
}

void meshVolume(const MeshOptions& options, Run& run) {
  run.begin("read");
  const VdbGrid grid = readScalarGrid(options.input, options.grid);
  const VdbGridInfo info = describe(grid);
  run.requireMemory(estimatedBytes(info), "make the volume with larger voxels (--voxel-size)");
  const bool isLevelSet = info.gridClass == VdbGridInfo::Class::levelSet;
  const double isovalue = options.isovalueOption->count() > 0 ? options.isovalue : isLevelSet ? 0.0 : 0.5;

  Mesh mesh;
  if (options.adaptivityOption->count() > 0) {
    run.begin("adaptive mesh");
    mesh = adaptiveMesh(grid, isovalue, options.adaptivity);
  } else {
    mesh = marchingCubes(*toBricks(grid), float(isovalue), run);
  }
  if (mesh.faceCount() == 0) refuseEmpty(options, info, isovalue);
  run.begin("write");
  writeMesh(options.output, mesh);

  run.begin("check");
  const MeshDiagnosis is = diagnose(mesh);
  run.stats["mesh"] = {{"vertices", is.vertices},     {"faces", is.faces},
                       {"triangles", is.triangles},   {"closed", is.closed()},
                       {"components", is.components}, {"euler", is.eulerCharacteristic},
                       {"volume", is.volume},         {"area", is.area},
                       {"isovalue", isovalue}};
  run.result(fmt::format("{}: {} vertices, {} faces, {}", options.output, is.vertices, is.faces,
                         is.closed() ? fmt::format("closed, volume {:g}", is.volume) : "not closed"));
}

}  // namespace

Verb meshVerb() {
  const auto options = std::make_shared<MeshOptions>();
  return {"mesh", "Turns a level set or a density into a mesh.", "nephele mesh surface.vdb -o surface.obj",
          [options](CLI::App& app) { bindOptions(app, *options); },
          [options](Run& run) { meshVolume(*options, run); }};
}

}  // namespace nephele::apps

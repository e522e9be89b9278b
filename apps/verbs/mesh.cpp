#include <fmt/format.h>

#include "apps/app.h"
#include "apps/options/isosurface_options.h"
#include "apps/options/mesh_options.h"
#include "nephele/levelset/cut/cut_input.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/modeling/base/error.h"

namespace nephele::apps {
namespace {

struct MeshOptions {
  std::string input;
  std::string output;
  IsosurfaceOptions isosurface;
  MeshProcessing processing;
};

void bindOptions(CLI::App& app, MeshOptions& options) {
  app.add_option("input", options.input, "Volume to mesh (.vdb, .nvdb), or a mesh.")
      ->required()
      ->type_name("FILE");
  addOutput(app, "-o,--output", options.output, {".obj", ".ply", ".stl"}, "Mesh to write.")->required();
  addIsosurfaceOptions(app, options.isosurface);
  addMeshProcessing(app, options.processing);
}

Mesh readInput(const MeshOptions& options, Run& run) {
  if (isVolumeFile(options.input)) return options.isosurface.surfaceOf(options.input, run);
  options.isosurface.refuseFor(options.input);
  run.begin("read");
  return readMesh(options.input);
}

void makeMesh(const MeshOptions& options, Run& run) {
  const Mesh mesh = namingFile(options.input, [&] {
    return options.processing.processed(readInput(options, run), options.input, run);
  });
  run.begin("write");
  writeMesh(options.output, mesh);

  run.begin("check");
  const MeshDiagnosis is = diagnose(mesh, run);
  run.stats["mesh"].update({{"vertices", is.vertices},
                            {"faces", is.faces},
                            {"triangles", is.triangles},
                            {"closed", is.closed()},
                            {"components", is.components},
                            {"euler", is.eulerCharacteristic},
                            {"volume", is.volume},
                            {"area", is.area}});
  run.result(fmt::format("{}: {} vertices, {} faces, {}", options.output, is.vertices, is.faces,
                         is.closed() ? fmt::format("closed, volume {:g}", is.volume) : "not closed"));
}

}  // namespace

Verb meshVerb() {
  return verbOf("mesh",
                "Turns a level set or a density into a mesh, or decimates, smooths and subdivides one.",
                "nephele mesh surface.vdb -o surface.obj --faces 20000", bindOptions, makeMesh, {},
                [](const MeshOptions& options, Run&) { return extentOfFile(options.input); });
}

}  // namespace nephele::apps

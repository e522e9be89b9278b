#include <fmt/format.h>

#include "apps/app.h"
#include "apps/options/isosurface_options.h"
#include "apps/options/mesh_options.h"
#include "nephele/levelset/cut/cut_input.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/modeling/base/error.h"
#include "nephele/render/image/png_io.h"
#include "nephele/render/preview/surface_picture.h"

namespace nephele::apps {
namespace {

struct MeshOptions {
  std::string input, output, preview;
  SurfacePictureOptions picture{.azimuthDegrees = 25};
  IsosurfaceOptions isosurface;
  MeshProcessing processing;
};

void bindOptions(CLI::App& app, MeshOptions& options) {
  app.add_option("input", options.input, "Volume to mesh (.vdb, .nvdb), or a mesh.")
      ->required()
      ->type_name("FILE");
  addOutput(app, "-o,--output", options.output, {".obj", ".ply", ".stl"}, "Mesh to write.");
  addIsosurfaceOptions(app, options.isosurface);
  addMeshProcessing(app, options.processing);
  CLI::Option* preview =
      addOutput(app, "--preview", options.preview, {".png"}, "Picture of the mesh; may be the only output.");
  addPreviewFrame(app, preview, options.picture.width, options.picture.height, options.picture.azimuthDegrees,
                  options.picture.elevationDegrees);
  requireOneOutput(app, {"--output", "--preview"});
}

Mesh readInput(const MeshOptions& options, Run& run) {
  if (isVolumeFile(options.input)) return options.isosurface.surfaceOf(options.input, run);
  options.isosurface.refuseFor(options.input);
  run.begin("read");
  return readMesh(options.input);
}

void makeMesh(const MeshOptions& options, Run& run) {
  if (!options.preview.empty())
    run.requireMemory(estimateSurfacePictureBytes(options.picture.width, options.picture.height),
                      "make the preview smaller (--size)");
  const Mesh mesh = namingFile(options.input, [&] {
    return options.processing.processed(readInput(options, run), options.input, run);
  });
  run.begin("write");
  if (!options.output.empty()) writeMesh(options.output, mesh);
  if (!options.preview.empty())
    writePng(options.preview, pictureSurfaces({{.mesh = mesh, .colour = kShapeColour}}, options.picture, run),
             {}, run.metadata());

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
  run.result(fmt::format("{}: {} vertices, {} faces, {}",
                         options.output.empty() ? options.preview : options.output, is.vertices, is.faces,
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

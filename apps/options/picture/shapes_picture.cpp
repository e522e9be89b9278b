#include "apps/options/picture/shapes_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/error.h"
#include "nephele/render/preview/surface_picture.h"

namespace nephele::apps {

namespace {

Extent extentOf(const std::vector<SurfaceObject>& shapes) {
  Extent result;
  for (const SurfaceObject& shape : shapes)
    for (const std::uint32_t v : shape.mesh.corners) {
      result.outline.emplace_back(shape.mesh.positions[v]);
      result.box = result.box.including(result.outline.back());
    }
  result.longestSide = double(result.box.longestSide());
  return result;
}

void requireNothingOfVolumes(const CLI::App& app, const PictureOptions& options) {
  const auto refuse = [](const char* option) {
    throw CLI::ValidationError(option, "needs a volume; meshes and level sets alone are shown without it");
  };
  for (const char* option :
       {"--deep", "--holdout", "--object", "--holdout-object", "--write-deep-shadow", "--volume-motion",
        "--color-grid", "--color", "--emission-grid", "--velocity-grid", "--velocity-scale",
        "--display-server", "--aerial-perspective", "--integrator"})
    if (app.count(option) > 0) refuse(option);
  if (app.count("--aov") > 0 && options.render.aovs != std::vector<std::string>{"none"}) refuse("--aov");
}

}  // namespace

Extent extentOfShapes(const std::vector<std::string>& inputs, const std::vector<std::string>& grids,
                      const ObjectOptions& objects, const Run& run) {
  return extentOf(objects.shapes(inputs, grids, run.memoryLimitBytes));
}

bool areShapes(const std::vector<std::string>& paths, const std::vector<std::string>& grids) {
  for (std::size_t i = 0; i != paths.size(); ++i) {
    if (isMeshFile(paths[i])) continue;
    const std::vector<VdbGrid> headers = readVdbHeaders(paths[i]);
    const auto seen = std::ranges::find_if(headers, [&](const VdbGrid& grid) {
      return valuesOf(grid) == VdbValues::scalar && (grids[i].empty() || labelOf(grid).name == grids[i]);
    });
    if (seen == headers.end() || labelOf(*seen).gridClass != VdbGridInfo::Class::levelSet) return false;
  }
  return true;
}

void writeShapesPicture(const CLI::App& app, const SceneOptions& scene, const PictureOptions& options,
                        const PictureFiles& files, Run& run) {
  requireNoSettings(scene.script);
  requireNothingOfVolumes(app, options);
  run.begin("read");
  std::vector<SurfaceObject> shapes = scene.objects.shapes(
      scene.inputs, options.volumes.seenGrids(scene.inputs.size()), run.memoryLimitBytes);
  SurfacePictureOptions shown;
  shown.camera = options.placed(extentOf(shapes), run).camera();
  if (shown.camera->hasLens() || shown.camera->isMoving())
    throw Error("meshes and level sets alone are shown without --f-stop, --lens-radius and --shutter");
  run.requireMemory(estimateSurfacePictureBytes(shown.camera->width(), shown.camera->height()),
                    "make the picture smaller (--size)");
  RenderResult picture;
  picture.image = pictureSurfaces(std::move(shapes), shown, run);
  run.begin("write");
  files.write(picture, *shown.camera, options.screen, run.metadata());
  run.result(fmt::format("{}: {}x{}, {} surface{}", files.name(), shown.camera->width(),
                         shown.camera->height(), scene.inputs.size(), scene.inputs.size() == 1 ? "" : "s"));
}

}  // namespace nephele::apps

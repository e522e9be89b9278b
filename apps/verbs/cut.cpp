#include <fmt/format.h>

#include <algorithm>
#include <future>

#include "apps/app.h"
#include "apps/cut_report.h"
#include "apps/options/cut_options.h"
#include "nephele/levelset/io/output_file.h"
#include "nephele/levelset/mesh/mesh_to_level_set.h"
#include "nephele/render/image/png_io.h"
#include "nephele/render/preview/surface_picture.h"

namespace nephele::apps {
namespace {

Pieces cutAsLevelSets(std::vector<CutPart>& parts, const CutKnives& knives, Run& run) {
  for (CutPart& part : parts) {
    const MeshToLevelSetOptions options{.voxelSize = knives.voxelSize};
    if (!part.level) part.mesh = triangulated(part.mesh);
    run.requireMemory(2 * estimateLevelSetBytes(part.mesh, options),
                      "use larger voxels (a lower --resolution or a larger --voxel-size)");
    if (!part.level)
      part.level = namingFile(part.name, [&] { return toBricks(meshToLevelSet(part.mesh, options, run)); });
  }
  return cutIntoLevelSets(parts, knives.voxelSize, knives.knives, knives.options, run);
}

/// Planes through a convex model part it into at most 1 + n + n over 2 + n over 3 pieces; random ones make
/// two thirds of these.
void requirePiecesMemory(const Knives& knives, std::size_t parts, const Run& run) {
  constexpr double kBytesPerPiece = 7000, kMany = 2e4;
  const auto n = double(knives.planes.size() + knives.rough.size());
  const double most =
      n + n * (n - 1) / 2 + n * (n - 1) * (n - 2) / 6 + double(knives.cells.size()) + double(parts);
  run.requireMemory(kBytesPerPiece * most, fmt::format("use fewer knives than {:g}", n));
  if (most > kMany) run.note(fmt::format("{:g} knives: this may make up to {:.2g} pieces", n, most));
}

void cut(const CutArguments& arguments, Run& run) {
  // Says now what could not be written in the end.
  if (!arguments.folder.empty()) requireWritableFolder(arguments.folder);
  if (!arguments.preview.empty())
    run.requireMemory(estimateSurfacePictureBytes(arguments.picture.width, arguments.picture.height),
                      "make the preview smaller (--size)");
  std::vector<CutPart> parts = arguments.readParts(run);
  // As long as the cut itself: on the side.
  auto crossings = std::async(std::launch::async, [mesh = arguments.isModel() ? parts[0].mesh : Mesh()] {
    return mesh.faceCount() > 0 ? countSelfIntersections(mesh, 100).value_or(0) : 0;
  });
  const CutKnives knives = knivesOf(arguments, parts, run);
  requirePiecesMemory(knives.knives, parts.size(), run);
  const bool isExact = arguments.geometry == CutArguments::Geometry::exact;
  const Pieces pieces = namingFile(arguments.input, [&] {
    return isExact ? cutIntoMeshes(parts, knives.knives, knives.options, run)
                   : cutAsLevelSets(parts, knives, run);
  });
  if (pieces.pieces.empty())
    throw Error(fmt::format("no piece is left: all {} parts are smaller than --min-volume, {:g} together",
                            pieces.slivers, pieces.sliverVolume));
  report(pieces, knives, run);

  run.begin("write");
  if (!arguments.folder.empty()) writePieces(pieces, arguments.files(knives, run), run);
  if (!arguments.preview.empty()) {
    PiecesPictureOptions picture = arguments.picture;
    picture.explode = arguments.explode.value_or(picture.explode);
    writePng(arguments.preview, picturePieces(pieces, picture, run), {}, run.metadata());
  }
  reportCrossings(crossings.get(), run);
  run.result(fmt::format(
      "{}: {} {}, volume {:g} (of {:g})", arguments.folder.empty() ? arguments.preview : arguments.folder,
      pieces.pieces.size(), pieces.pieces.size() == 1 ? "piece: no knife parts the model" : "pieces",
      pieces.volumeSum, pieces.volumeOriginal));
}

}  // namespace

Verb cutVerb() {
  return verbOf(
      "cut", "Cuts a model into closed pieces by knives.",
      "nephele cut examples/hare.obj -o pieces --random-planes 5 --explode 0.4 --preview pieces.png",
      addCutOptions, cut, {}, [](const CutArguments& arguments, Run& run) {
        const Box box = boxOf(arguments.readParts(run));
        return Extent{box, double(box.longestSide())};
      });
}

}  // namespace nephele::apps

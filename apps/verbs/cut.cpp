#include <fmt/format.h>

#include <algorithm>
#include <future>

#include "apps/app.h"
#include "apps/cut_report.h"
#include "apps/options/cut_options.h"
#include "nephele/levelset/io/output_file.h"
#include "nephele/render/image/png_io.h"
#include "nephele/render/preview/surface_picture.h"

namespace nephele::apps {
namespace {

void cut(const CutArguments& arguments, Run& run) {
  // Says now what could not be written in the end.
  if (!arguments.folder.empty()) requireWritableFolder(arguments.folder);
  arguments.requireInputsKept();
  if (!arguments.preview.empty())
    run.requireMemory(estimateSurfacePictureBytes(arguments.picture.width, arguments.picture.height),
                      "make the preview smaller (--size)");
  std::vector<CutPart> parts = arguments.readParts(run);
  // As long as the cut itself: on the side.
  auto crossings = std::async(std::launch::async, [mesh = arguments.isModel() ? parts[0].mesh : Mesh()] {
    return mesh.faceCount() > 0 ? countSelfIntersections(mesh, 100).value_or(0) : 0;
  });
  const CutKnives knives = knivesOf(arguments, parts, run);
  if (arguments.geometry == CutArguments::Geometry::levelset)
    namingFile(arguments.input, [&] { addLevelSets(parts, knives.voxelSize, run); });
  const Pieces pieces = arguments.cut(parts, knives, run);
  if (pieces.pieces.empty())
    throw Error(
        pieces.slivers == 0
            ? "no piece is left: --kerf takes all of the model"
            : fmt::format("no piece is left: all {} parts are smaller than --min-volume, {:g} together",
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
  const char* const what = pieces.pieces.size() > 1      ? "pieces"
                           : areSomeGone(pieces, knives) ? "piece"
                                                         : "piece: no knife parts the model";
  run.result(fmt::format("{}: {} {}, volume {:g} (of {:g})",
                         arguments.folder.empty() ? arguments.preview : arguments.folder,
                         pieces.pieces.size(), what, pieces.volumeSum, pieces.volumeOriginal));
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

// Cutting closed meshes into closed pieces: what rough blades and solids leave comes first (carve.h), then
// planes and cells (flat_cut.h).
#include <numeric>

#include "nephele/levelset/cut/cut.h"
#include "nephele/levelset/cut/detail/piece_measures.h"
#include "nephele/levelset/cut/detail/solids/cell_walls.h"
#include "nephele/levelset/cut/detail/solids/flat_cut.h"
#include "nephele/modeling/base/error.h"

namespace nephele {

Pieces cutIntoMeshes(const Mesh& mesh, const Knives& knives, const CutOptions& options,
                     const Progress& progress) {
  requireValid(mesh);
  for (const Mesh& solid : knives.solids) requireValid(solid);
  detail::requireKnives(knives, options);
  require(knives.fields.empty(),
          "cut: fields cut level sets only; a mesh is cut by planes, cells, rough blades "
          "and solids");
  detail::CutSource source(mesh);
  std::vector<detail::Carved::Part> parts(1);
  const bool hasRoughCells = knives.cellRoughness.amplitude != 0 && knives.cells.size() > 1;
  require(!hasRoughCells || options.kerf == 0, "cut: rough cells have no kerf; their walls are shared");
  Knives flat = knives;
  if (hasRoughCells) flat.cells.clear();
  if (knives.rough.empty() && knives.solids.empty() && !hasRoughCells) {
    parts[0].triangles.resize(source.triangles().size());
    std::iota(parts[0].triangles.begin(), parts[0].triangles.end(), 0u);
  } else {
    progress.begin("knives");
    auto sheets = detail::knifeSheets(knives, options.kerf, source, progress);
    if (hasRoughCells) sheets.push_back(detail::cellWalls(knives, source, progress));
    detail::Carved carved = detail::carve(source.positions(), source.triangles(), sheets, progress);
    parts = std::move(carved.parts);
    source.refine(std::move(carved));
  }
  Pieces pieces = detail::piecesOf(source, parts, flat, options, progress);
  pieces.volumeOriginal = massProperties(mesh).volume;
  detail::sumUp(pieces);
  detail::checkClosed(pieces.pieces, progress);
  return pieces;
}

}  // namespace nephele

#include "apps/cut_report.h"

#include <fmt/format.h>

#include <algorithm>

namespace nephele::apps {
namespace {

/// Of the volume.
double sliverShare(const Pieces& pieces) {
  return pieces.volumeOriginal > 0 ? pieces.sliverVolume / pieces.volumeOriginal : 0;
}

void reportKnives(const Pieces& pieces, const CutKnives& knives, Run& run) {
  if (pieces.slivers > 0)
    run.note(
        fmt::format("{} {} left out, too small, {:.2g} % of the volume together; --min-volume 0 keeps {}",
                    pieces.slivers, pieces.slivers == 1 ? "part" : "parts", 100 * sliverShare(pieces),
                    pieces.slivers == 1 ? "it" : "them"));
  std::vector<std::string> missing;
  for (std::size_t k = 0; k < knives.names.size(); ++k) {
    const auto side = [&](const Piece& piece) { return piece.code.sides[k]; };
    if (std::ranges::all_of(pieces.pieces,
                            [&](const auto& piece) { return side(piece) == side(pieces.pieces[0]); }))
      missing.push_back(knives.names[k]);
  }
  const char* const ofWhat = areSomeGone(pieces, knives) ? " that is left" : "";
  if (missing.size() > 3)
    run.note(fmt::format("{} of {} knives part nothing{}", missing.size(), knives.names.size(), ofWhat));
  else
    for (const std::string& name : missing) run.note(fmt::format("{}: parts nothing{}", name, ofWhat));
}

nlohmann::json statistics(const Pieces& pieces) {
  nlohmann::json list = nlohmann::json::array();
  for (const Piece& piece : pieces.pieces) {
    const Vec3d& c = piece.mass.centroid;
    list.push_back({{"name", piece.name},
                    {"code", codeText(piece.code)},
                    {"volume", piece.mass.volume},
                    {"area", piece.mass.area},
                    {"centroid", {c.x, c.y, c.z}},
                    {"closed", piece.closed}});
    if (piece.cell) list.back()["cell"] = *piece.cell;
  }
  return list;
}

}  // namespace

bool areSomeGone(const Pieces& pieces, const CutKnives& knives) {
  return pieces.slivers > 0 || knives.options.kerf > 0;
}

void report(const Pieces& pieces, const CutKnives& knives, Run& run) {
  reportKnives(pieces, knives, run);
  run.stats["pieces"] = statistics(pieces);
  run.stats["volume_original"] = pieces.volumeOriginal;
  run.stats["volume_sum"] = pieces.volumeSum;
  run.stats["levelsets_nonempty"] = pieces.codes;
  run.stats["slivers"] = {
      {"count", pieces.slivers}, {"volume", pieces.sliverVolume}, {"share", sliverShare(pieces)}};
}

void reportCrossings(std::size_t crossings, Run& run) {
  run.stats["self_intersections"] = crossings;
  if (crossings > 0)
    run.note(
        fmt::format("the mesh crosses itself ({} pairs of triangles), and so may pieces; --repair wrap makes "
                    "one skin of it",
                    crossings));
}

}  // namespace nephele::apps

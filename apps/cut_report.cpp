#include "apps/cut_report.h"

#include <fmt/format.h>

#include <algorithm>

namespace nephele::apps {
namespace {

void reportKnives(const PieceSet& set, const CutKnives& knives, Run& run) {
  if (set.slivers > 0)
    run.note(fmt::format("{} {} left out, too small, of volume {:g} together", set.slivers,
                         set.slivers == 1 ? "part" : "parts", set.sliverVolume));
  std::vector<std::string> missing;
  for (std::size_t k = 0; k < knives.names.size(); ++k) {
    const auto side = [&](const NamedPiece& piece) { return piece.code.sides[k]; };
    if (std::ranges::all_of(set.pieces,
                            [&](const auto& piece) { return side(piece) == side(set.pieces[0]); }))
      missing.push_back(knives.names[k]);
  }
  if (missing.size() > 3)
    run.note(fmt::format("{} of {} knives part nothing", missing.size(), knives.names.size()));
  else
    for (const std::string& name : missing) run.note(name + ": parts nothing");
}

nlohmann::json statistics(const PieceSet& set) {
  nlohmann::json pieces = nlohmann::json::array();
  for (const NamedPiece& piece : set.pieces) {
    const Vec3d& c = piece.mass.centroid;
    pieces.push_back({{"name", piece.name},
                      {"code", codeText(piece.code)},
                      {"volume", piece.mass.volume},
                      {"area", piece.mass.area},
                      {"centroid", {c.x, c.y, c.z}},
                      {"closed", piece.closed}});
    if (piece.cell) pieces.back()["cell"] = *piece.cell;
  }
  return pieces;
}

}  // namespace

void report(const PieceSet& set, const CutKnives& knives, Run& run) {
  reportKnives(set, knives, run);
  run.stats["pieces"] = statistics(set);
  run.stats["volume_original"] = set.volumeOriginal;
  run.stats["volume_sum"] = set.volumeSum;
  run.stats["levelsets_nonempty"] = set.codes;
  run.stats["slivers"] = {{"count", set.slivers}, {"volume", set.sliverVolume}};
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

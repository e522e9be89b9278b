#include "nephele/levelset/cut/detail/piece_measures.h"

#include <algorithm>
#include <set>

#include "nephele/levelset/cut/detail/edge_counts.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {
namespace {

bool isClosed(const Mesh& mesh) {
  bool closed = !mesh.corners.empty();
  countEdges(
      mesh.positions.size(),
      [&](const auto& add) {
        for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
          const auto face = mesh.face(f);
          for (std::size_t k = 0; k < face.size(); ++k) add(face[k], face[k + 1 == face.size() ? 0 : k + 1]);
        }
      },
      [&](int up, int down) { closed &= up == 1 && down == 1; });
  return closed;
}

}  // namespace

void measure(Piece& piece) {
  piece.mass = massProperties(piece.mesh);
  piece.boxMin = piece.boxMax = piece.mesh.positions[0];
  for (const Vec3d& p : piece.mesh.positions) {
    piece.boxMin = min(piece.boxMin, p);
    piece.boxMax = max(piece.boxMax, p);
  }
}

void setNeighbours(std::vector<Piece>& pieces, const ContactAreas& areas) {
  for (Piece& piece : pieces) piece.neighbours.clear();
  for (const auto& [pair, area] : areas) {
    pieces[pair.first].neighbours.push_back({pair.second, area});
    pieces[pair.second].neighbours.push_back({pair.first, area});
  }
  for (Piece& piece : pieces)
    std::sort(piece.neighbours.begin(), piece.neighbours.end(),
              [](const PieceContact& a, const PieceContact& b) { return a.piece < b.piece; });
}

void checkClosed(std::vector<Piece>& pieces, const Progress& progress) {
  parallelFor(
      pieces.size(), 1,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) pieces[i].closed = isClosed(pieces[i].mesh);
      },
      progress);
}

void sumUp(Pieces& pieces) {
  pieces.volumeSum = 0;
  std::set<std::pair<std::vector<bool>, std::uint32_t>> codes;
  for (const Piece& piece : pieces.pieces) {
    pieces.volumeSum += piece.mass.volume;
    codes.emplace(piece.code.sides, piece.cell.value_or(0));
  }
  pieces.codes = codes.size();
}

}  // namespace nephele::detail

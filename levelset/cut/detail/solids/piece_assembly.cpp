// From solids to pieces, and which of them touch.
//
// Contacts are found by their triangles, which are the same on both sides of a cut.
#include "nephele/levelset/cut/detail/solids/piece_assembly.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "nephele/levelset/cut/detail/piece_measures.h"

namespace nephele::detail {

namespace {

std::uint64_t mixed(std::uint64_t h) {
  h ^= h >> 32;
  h *= 0x9e3779b97f4a7c15u;
  return h ^ h >> 29;
}

/// The same for triangles with the same three places, in any order.
std::uint64_t placeOf(std::array<Vec3d, 3> corners) {
  std::sort(corners.begin(), corners.end());
  std::uint64_t h = 1;
  for (const Vec3d& p : corners)
    for (const double x : {p.x, p.y, p.z}) {
      std::uint64_t bits;
      const double positive = x + 0.0;
      std::memcpy(&bits, &positive, sizeof bits);
      h = mixed(h + bits);
    }
  return h;
}

void findNeighbours(std::vector<Piece>& pieces, std::vector<InnerTriangle> inner) {
  std::sort(inner.begin(), inner.end(), [](const InnerTriangle& a, const InnerTriangle& b) {
    return a.place != b.place ? a.place < b.place : a.piece < b.piece;
  });
  ContactAreas areas;
  for (std::size_t i = 0; i + 1 < inner.size(); ++i)
    if (inner[i].place == inner[i + 1].place && inner[i].piece != inner[i + 1].piece)
      areas[{inner[i].piece, inner[i + 1].piece}] += inner[i].area;
  setNeighbours(pieces, areas);
}

}  // namespace

Assembly assemble(const CutSource& source, const SolidSplitter& splitter, Solid& solid, const PieceCode& code,
                  double minVolume) {
  Assembly result;
  const auto shells = shellsOf(splitter, trianglesOf(splitter, solid));
  solid = {};
  for (const Shell& shell : shells) {
    if (shell.volume < minVolume) {
      ++result.slivers;
      result.sliverVolume += shell.volume;
      continue;
    }
    Piece piece;
    ShellMesh shellMesh = source.meshOf(splitter, shell);
    piece.mesh = std::move(shellMesh.mesh);
    piece.code = code;
    measure(piece);
    std::vector<InnerTriangle> inner;
    for (std::size_t f = shellMesh.firstInside; f < piece.mesh.faceCount(); ++f) {
      const auto v = piece.mesh.face(f);
      const Vec3d &a = piece.mesh.positions[v[0]], &b = piece.mesh.positions[v[1]],
                  &c = piece.mesh.positions[v[2]];
      inner.push_back({placeOf({a, b, c}), 0, length(cross(b - a, c - a)) / 2});
    }
    // Last, so that both sides of a cut are compared with the same triangles.
    splitEdges(piece.mesh, shellMesh.crowded);
    result.pieces.push_back(std::move(piece));
    result.inner.push_back(std::move(inner));
  }
  return result;
}

void dropSplinters(std::vector<Assembly>& assemblies, double whole) {
  std::vector<double> volumes;
  for (const Assembly& assembly : assemblies)
    for (const Piece& piece : assembly.pieces) volumes.push_back(piece.mass.volume);
  if (volumes.empty()) return;
  const auto middle = volumes.begin() + std::ptrdiff_t(volumes.size() / 2);
  std::nth_element(volumes.begin(), middle, volumes.end());
  const double least = std::min(kSplinterOfMedian * *middle, kSplinterOfWhole * whole);
  for (Assembly& assembly : assemblies) {
    std::size_t kept = 0;
    for (std::size_t k = 0; k < assembly.pieces.size(); ++k) {
      if (assembly.pieces[k].mass.volume < least) {
        ++assembly.slivers;
        assembly.sliverVolume += assembly.pieces[k].mass.volume;
        continue;
      }
      if (kept != k) {
        assembly.pieces[kept] = std::move(assembly.pieces[k]);
        assembly.inner[kept] = std::move(assembly.inner[k]);
      }
      ++kept;
    }
    assembly.pieces.resize(kept);
    assembly.inner.resize(kept);
  }
}

Pieces gathered(std::vector<Assembly> assemblies) {
  Pieces result;
  std::vector<InnerTriangle> inner;
  for (Assembly& assembly : assemblies) {
    for (std::size_t k = 0; k < assembly.pieces.size(); ++k) {
      for (InnerTriangle& triangle : assembly.inner[k]) {
        triangle.piece = std::uint32_t(result.pieces.size());
        inner.push_back(triangle);
      }
      result.pieces.push_back(std::move(assembly.pieces[k]));
    }
    result.slivers += assembly.slivers;
    result.sliverVolume += assembly.sliverVolume;
    assembly = {};
  }
  findNeighbours(result.pieces, std::move(inner));
  return result;
}

}  // namespace nephele::detail

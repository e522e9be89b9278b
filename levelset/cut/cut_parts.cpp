// Pieces with names, and pieces that are cut again.
//
// Every part is cut by itself; names follow from its own. Contacts across parts, whose common faces were made
// by an earlier cut and may have been cut again from either side, are found by triangles of the same place:
// both sides were cut by the same knives, so that they are the same triangles up to rounding. Level sets have
// no such faces; there the other side is looked for a little in front of each triangle.
#include "nephele/levelset/cut/cut_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "nephele/levelset/cut/detail/piece_measures.h"
#include "nephele/levelset/cut/detail/tetrahedra/level_set_cut.h"
#include "nephele/levelset/grid/grid_field.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {
namespace {

using detail::ContactAreas;
using detail::kInsideGroup;

/// Of a triangle.
Vec3d cornerOf(const Mesh& mesh, std::size_t face, std::size_t k) {
  return mesh.positions[mesh.face(face)[k]];
}

Vec3d middleOf(const Mesh& mesh, std::size_t face) {
  return (cornerOf(mesh, face, 0) + cornerOf(mesh, face, 1) + cornerOf(mesh, face, 2)) / 3.0;
}

/// As long as twice the area.
Vec3d normalOf(const Mesh& mesh, std::size_t face) {
  const Vec3d a = cornerOf(mesh, face, 0);
  return cross(cornerOf(mesh, face, 1) - a, cornerOf(mesh, face, 2) - a);
}

void requireNames(std::span<const CutPart> parts) {
  require(!parts.empty(), "cut: nothing to cut");
  std::set<std::string> names;
  for (const CutPart& part : parts)
    require(names.insert(part.name).second, fmt::format("cut: two parts are called '{}'", part.name));
}

/// Gives the pieces of a part their names, and faces that are in no group one.
void nameThem(std::vector<Piece>& pieces, const CutPart& part) {
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    Piece& piece = pieces[i];
    piece.name = fmt::format("{}_{:04}", part.name, i + 1);
    if (part.parent) piece.parent = part.name;
    std::vector<MeshGroup>& groups = piece.mesh.groups;
    const auto grouped = groups.empty() ? std::uint32_t(piece.mesh.faceCount()) : groups[0].firstFace;
    if (grouped > 0) groups.insert(groups.begin(), {"outside", 0, grouped});
    piece.mesh.materialFiles = part.mesh.materialFiles;
  }
}

/// The pieces of all parts, part by part.
Pieces gathered(std::vector<Pieces> ofParts) {
  Pieces all;
  std::set<std::string> names;
  for (Pieces& part : ofParts) {
    const auto first = std::uint32_t(all.pieces.size());
    for (Piece& piece : part.pieces) {
      for (PieceContact& neighbour : piece.neighbours) neighbour.piece += first;
      require(names.insert(piece.name).second,
              fmt::format("cut: two pieces would be called '{}'; rename what is cut", piece.name));
      all.pieces.push_back(std::move(piece));
    }
    all.volumeOriginal += part.volumeOriginal;
    all.slivers += part.slivers;
    all.sliverVolume += part.sliverVolume;
  }
  detail::sumUp(all);
  return all;
}

/// Contacts by triangles of the same place that look at each other, up to rounding. All of them may be such:
/// not every format keeps which faces an earlier cut made.
void findNeighbours(std::vector<Piece>& pieces) {
  // A direction, no longer than 1, across which no model has many points.
  constexpr Vec3d kAcross{0.8417, 0.4273, 0.3291};
  struct Triangle {
    double key;
    Vec3d middle;
    /// As long as twice the area.
    Vec3d normal;
    std::uint32_t piece;
    bool isMatched = false;
  };
  std::vector<Triangle> triangles;
  Vec3d low = pieces[0].boxMin, high = pieces[0].boxMax;
  for (std::uint32_t p = 0; p < pieces.size(); ++p) {
    const Mesh& mesh = pieces[p].mesh;
    low = min(low, pieces[p].boxMin);
    high = max(high, pieces[p].boxMax);
    for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
      if (mesh.face(f).size() != 3) continue;
      const Vec3d middle = middleOf(mesh, f);
      triangles.push_back({dot(middle, kAcross), middle, normalOf(mesh, f), p});
    }
  }
  const double size = length(high - low), tolerance = 1e-10 * size;
  std::sort(triangles.begin(), triangles.end(), [](const Triangle& a, const Triangle& b) {
    return a.key != b.key ? a.key < b.key : a.piece < b.piece;
  });
  ContactAreas areas;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    Triangle& a = triangles[i];
    for (std::size_t j = i + 1; !a.isMatched && j < triangles.size() && triangles[j].key - a.key <= tolerance;
         ++j) {
      Triangle& b = triangles[j];
      if (b.isMatched || b.piece == a.piece || length(b.middle - a.middle) > tolerance ||
          length(a.normal + b.normal) > tolerance * size)
        continue;
      a.isMatched = b.isMatched = true;
      areas[std::minmax(a.piece, b.piece)] += length(a.normal) / 2;
    }
  }
  detail::setNeighbours(pieces, areas);
}

/// Whether a cut has left a piece as it was: it takes volume away, or adds two faces.
bool isUncut(const Piece& piece, const CutPart& part) {
  const auto isSame = [](double a, double b) { return std::abs(a - b) <= 1e-9 * std::abs(b); };
  const MassProperties whole = massProperties(part.mesh);
  return isSame(piece.mass.volume, whole.volume) && isSame(piece.mass.area, whole.area);
}

/// Names the pieces of a part. A part of an earlier cut keeps name and mesh if nothing has touched it.
void nameThem(Pieces& pieces, const CutPart& part, bool isUntouched) {
  if (!part.parent || !isUntouched) {
    nameThem(pieces.pieces, part);
    return;
  }
  pieces.pieces[0].name = part.name;
  pieces.pieces[0].parent = *part.parent;
  pieces.pieces[0].mesh = part.mesh;
}

Pieces cutPart(const CutPart& part, const Knives& knives, const CutOptions& options,
               const Progress& progress) {
  // Rough cells part meshes only; one of the level set is at hand.
  Pieces result = part.level && knives.cellRoughness.amplitude == 0
                      ? detail::cutLevelSet(*part.level, part.mesh, knives, options, progress)
                      : cutIntoMeshes(part.mesh, knives, options, progress);
  nameThem(result, part, part.parent && result.pieces.size() == 1 && isUncut(result.pieces[0], part));
  return result;
}

/// Puts faces deep inside `shape` last, as the group `inside`; returns how many there are.
std::size_t groupInnerFaces(Mesh& mesh, const ScalarField& shape, float depth) {
  const std::size_t count = mesh.faceCount();
  std::vector<float> x(count), y(count), z(count), value(count);
  for (std::size_t f = 0; f < count; ++f) {
    const Vec3f middle(middleOf(mesh, f));
    x[f] = middle.x, y[f] = middle.y, z[f] = middle.z;
  }
  shape.eval({x, y, z}, value);
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t(0));
  const auto inner =
      std::stable_partition(order.begin(), order.end(), [&](std::size_t f) { return !(value[f] > depth); });
  std::vector<std::uint32_t> corners;
  corners.reserve(mesh.corners.size());
  for (const std::size_t f : order)
    corners.insert(corners.end(), mesh.corners.begin() + std::ptrdiff_t(3 * f),
                   mesh.corners.begin() + std::ptrdiff_t(3 * f + 3));
  mesh.corners = std::move(corners);
  const auto first = std::uint32_t(inner - order.begin());
  if (first < count) mesh.groups.push_back({kInsideGroup, first, std::uint32_t(count) - first});
  return count - first;
}

/// Contacts of level-set pieces: what is a voxel in front of triangles. `partOf` has the part of each piece;
/// a kerf parts pieces of one part.
void findNeighboursOfLevelSets(std::vector<Piece>& pieces, const std::vector<std::size_t>& partOf,
                               bool hasKerf, const Progress& progress) {
  std::vector<std::map<std::uint32_t, double>> seen(pieces.size());
  parallelFor(
      pieces.size(), 1,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t p = begin; p < end; ++p) {
          const Piece& piece = pieces[p];
          const double reach = double(piece.level->voxelSize());
          const auto isOfSamePart = [&](std::uint32_t q) { return partOf[q] == partOf[p]; };
          std::vector<std::uint32_t> near;
          for (std::uint32_t q = 0; q < pieces.size(); ++q) {
            const Vec3d gap = max(pieces[q].boxMin - piece.boxMax, piece.boxMin - pieces[q].boxMax);
            if (q != p && !(hasKerf && isOfSamePart(q)) && std::max({gap.x, gap.y, gap.z}) <= reach)
              near.push_back(q);
          }
          if (near.empty()) continue;
          // What no knife has touched has the mesh of its part, whose triangles may be too large to look
          // from.
          const bool isAlone = std::ranges::count(partOf, partOf[p]) == 1;
          const Mesh own = isAlone ? marchingCubes(*piece.level->toBricks()) : Mesh();
          const Mesh& mesh = isAlone ? own : piece.mesh;
          // Faces of an earlier cut are outer ones of a part.
          std::size_t firstInner = mesh.faceCount();
          for (const MeshGroup& group : mesh.groups)
            if (group.name == kInsideGroup) firstInner = group.firstFace;
          for (std::size_t f = std::ranges::all_of(near, isOfSamePart) ? firstInner : 0; f < mesh.faceCount();
               ++f) {
            const Vec3d normal = normalOf(mesh, f);
            const double area = length(normal) / 2;
            if (area == 0) continue;
            const Vec3f front(middleOf(mesh, f) + normal * (0.75 * reach / (2 * area)));
            for (const std::uint32_t q : near) {
              if (f < firstInner && isOfSamePart(q)) continue;
              const PieceLevelSet& level = *pieces[q].level;
              const Vec3f v = front * (1 / level.voxelSize());
              const auto nearest = [](float c) { return int(std::lround(c)); };
              if (!(level.at({nearest(v.x), nearest(v.y), nearest(v.z)}) > 0)) continue;
              seen[p][q] += area;
              break;
            }
          }
        }
      },
      progress);
  // The mean of both sides, or what one of them alone has seen.
  ContactAreas areas;
  for (std::uint32_t p = 0; p < pieces.size(); ++p)
    for (const auto& [q, area] : seen[p]) areas[std::minmax(p, q)] += seen[q].contains(p) ? area / 2 : area;
  detail::setNeighbours(pieces, areas);
}

Pieces cutLevel(const CutPart& part, float voxelSize, const Knives& knives, const CutOptions& options,
                const Progress& progress) {
  require(part.level != nullptr, fmt::format("cut: '{}' has no level set", part.name));
  const ScalarField shape = gridField(part.level);
  Pieces result = cutIntoLevelSets(shape, {.voxelSize = voxelSize, .box = boundingBox(part.mesh)}, knives,
                                   options, progress);
  std::vector<std::size_t> innerFaces(result.pieces.size());
  progress.begin("mesh");
  parallelFor(
      result.pieces.size(), 1,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          Piece& piece = result.pieces[i];
          piece.mesh = marchingCubes(*piece.level->toBricks());
          innerFaces[i] = groupInnerFaces(piece.mesh, shape, 0.5f * voxelSize);
          detail::measure(piece);
        }
      },
      progress);
  const bool isUntouched = result.pieces.size() == 1 && result.slivers == 0 && innerFaces[0] == 0;
  nameThem(result, part, isUntouched);
  if (isUntouched) detail::measure(result.pieces[0]);
  result.volumeOriginal = signedVolume(part.mesh);
  return result;
}

}  // namespace

Pieces cutIntoMeshes(std::span<const CutPart> parts, const Knives& knives, const CutOptions& options,
                     const Progress& progress) {
  requireNames(parts);
  std::vector<Pieces> results(parts.size());
  if (parts.size() == 1) {
    results[0] = cutPart(parts[0], knives, options, progress);
  } else {
    progress.begin("cut");
    parallelFor(
        parts.size(), 1,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) try {
              results[i] = cutPart(parts[i], knives, options, silent());
            } catch (const Cancelled&) {
              throw;
            } catch (const Error& error) {
              throw Error(fmt::format("{}: {}", parts[i].name, error.what()));
            }
        },
        progress);
  }
  Pieces pieces = gathered(std::move(results));
  if (parts.size() > 1 && !pieces.pieces.empty()) findNeighbours(pieces.pieces);
  detail::checkClosed(pieces.pieces, progress);
  return pieces;
}

Pieces cutIntoLevelSets(std::span<const CutPart> parts, double voxelSize, const Knives& knives,
                        const CutOptions& options, const Progress& progress) {
  requireNames(parts);
  std::vector<Pieces> results;
  std::vector<std::size_t> partOf;
  const Knives fields{.cells = knives.cells,
                      .cellRoughness = knives.cellRoughness,
                      .fields = asFields(knives, voxelSize, options.kerf, progress)};
  for (const CutPart& part : parts) {
    results.push_back(cutLevel(part, float(voxelSize), fields, options, progress));
    partOf.insert(partOf.end(), results.back().pieces.size(), results.size());
  }
  Pieces pieces = gathered(std::move(results));
  findNeighboursOfLevelSets(pieces.pieces, partOf, options.kerf > 0, progress);
  detail::checkClosed(pieces.pieces, progress);
  return pieces;
}

}  // namespace nephele

// Pieces with names, and pieces that are cut again.
//
// Every part is cut by itself; names follow from its own. Contacts across parts, whose common faces were made
// by an earlier cut and may have been cut again from either side, are found by triangles of the same place:
// both sides were cut by the same knives, so that they are the same triangles up to rounding. Level sets have
// no such faces; there the other side is looked for a little in front of each inner triangle.
#include "nephele/levelset/cut/cut_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "nephele/levelset/cut/cut_level_set.h"
#include "nephele/levelset/grid/grid_field.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/levelset/mesh/mesh_distance.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {
namespace {

constexpr const char* kInside = "inside";

Vec3d cornerOf(const Mesh& mesh, std::size_t face, std::size_t k) {
  return mesh.positions[mesh.corners[3 * face + k]];
}

Vec3d middleOf(const Mesh& mesh, std::size_t face) {
  return (cornerOf(mesh, face, 0) + cornerOf(mesh, face, 1) + cornerOf(mesh, face, 2)) / 3.0;
}

/// As long as twice the area.
Vec3d normalOf(const Mesh& mesh, std::size_t face) {
  const Vec3d a = cornerOf(mesh, face, 0);
  return cross(cornerOf(mesh, face, 1) - a, cornerOf(mesh, face, 2) - a);
}

bool isClosed(const Mesh& mesh) {
  std::vector<std::uint64_t> edges;
  edges.reserve(mesh.corners.size());
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
    const auto face = mesh.face(f);
    for (std::size_t k = 0; k < face.size(); ++k) {
      const std::uint32_t a = face[k], b = face[(k + 1) % face.size()];
      edges.push_back((std::uint64_t(std::min(a, b)) << 32 | std::max(a, b)) << 1 | (a < b ? 1 : 0));
    }
  }
  std::sort(edges.begin(), edges.end());
  for (std::size_t i = 0; i < edges.size(); i += 2)
    if (i + 1 == edges.size() || edges[i] + 1 != edges[i + 1]) return false;
  return !edges.empty();
}

void setMeasures(NamedPiece& piece) {
  piece.mass = massProperties(piece.mesh);
  piece.boxMin = piece.boxMax = piece.mesh.positions[0];
  for (const Vec3d& p : piece.mesh.positions) {
    piece.boxMin = min(piece.boxMin, p);
    piece.boxMax = max(piece.boxMax, p);
  }
}

void requireNames(std::span<const CutPart> parts) {
  require(!parts.empty(), "cut: nothing to cut");
  std::set<std::string> names;
  for (const CutPart& part : parts)
    require(names.insert(part.name).second, fmt::format("cut: two parts are called '{}'", part.name));
}

/// Gives the pieces of a part their names, and faces that are in no group one.
void nameThem(std::vector<NamedPiece>& pieces, const CutPart& part) {
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    NamedPiece& piece = pieces[i];
    piece.name = fmt::format("{}_{:04}", part.name, i + 1);
    if (part.parent) piece.parent = part.name;
    std::vector<MeshGroup>& groups = piece.mesh.groups;
    const auto grouped = groups.empty() ? std::uint32_t(piece.mesh.faceCount()) : groups[0].firstFace;
    if (grouped > 0) groups.insert(groups.begin(), {"outside", 0, grouped});
    piece.mesh.materialFiles = part.mesh.materialFiles;
  }
}

/// What one part became.
struct Result {
  std::vector<NamedPiece> pieces{};
  double volume = 0.0;
  std::size_t slivers = 0;
  double sliverVolume = 0.0;
};

using Codes = std::set<std::pair<std::vector<bool>, std::uint32_t>>;

PieceSet gathered(std::vector<Result> results) {
  PieceSet set;
  Codes codes;
  std::set<std::string> names;
  for (Result& result : results) {
    const auto first = std::uint32_t(set.pieces.size());
    for (NamedPiece& piece : result.pieces) {
      for (PieceContact& neighbour : piece.neighbours) neighbour.piece += first;
      codes.emplace(piece.code.sides, piece.cell.value_or(0));
      set.volumeSum += piece.mass.volume;
      require(names.insert(piece.name).second,
              fmt::format("cut: two pieces would be called '{}'; rename what is cut", piece.name));
      set.pieces.push_back(std::move(piece));
    }
    set.volumeOriginal += result.volume;
    set.slivers += result.slivers;
    set.sliverVolume += result.sliverVolume;
  }
  set.codes = codes.size();
  return set;
}

/// Calls f(face) for every face of the groups called `inside`.
template <class F>
void forInnerFaces(const Mesh& mesh, const F& f) {
  for (const MeshGroup& group : mesh.groups)
    if (group.name == kInside)
      for (std::size_t i = group.firstFace; i < std::size_t(group.firstFace) + group.faceCount; ++i) f(i);
}

using ContactAreas = std::map<std::pair<std::uint32_t, std::uint32_t>, double>;

void setNeighbours(std::vector<NamedPiece>& pieces, const ContactAreas& areas) {
  for (NamedPiece& piece : pieces) piece.neighbours.clear();
  for (const auto& [pair, area] : areas) {
    pieces[pair.first].neighbours.push_back({pair.second, area});
    pieces[pair.second].neighbours.push_back({pair.first, area});
  }
  for (NamedPiece& piece : pieces)
    std::sort(piece.neighbours.begin(), piece.neighbours.end(),
              [](const PieceContact& a, const PieceContact& b) { return a.piece < b.piece; });
}

/// Contacts by inner triangles of the same place, up to rounding.
void findNeighbours(std::vector<NamedPiece>& pieces) {
  // A direction, no longer than 1, across which no model has many points.
  constexpr Vec3d kAcross{0.8417, 0.4273, 0.3291};
  struct Triangle {
    double key;
    Vec3d middle;
    double area;
    std::uint32_t piece;
    bool isMatched = false;
  };
  std::vector<Triangle> triangles;
  Vec3d low = pieces[0].boxMin, high = pieces[0].boxMax;
  for (std::uint32_t p = 0; p < pieces.size(); ++p) {
    const Mesh& mesh = pieces[p].mesh;
    low = min(low, pieces[p].boxMin);
    high = max(high, pieces[p].boxMax);
    if (!mesh.isTriangles()) continue;
    forInnerFaces(mesh, [&](std::size_t f) {
      const Vec3d middle = middleOf(mesh, f);
      triangles.push_back({dot(middle, kAcross), middle, length(normalOf(mesh, f)) / 2, p});
    });
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
          std::abs(b.area - a.area) > tolerance * size)
        continue;
      a.isMatched = b.isMatched = true;
      areas[std::minmax(a.piece, b.piece)] += a.area;
    }
  }
  setNeighbours(pieces, areas);
}

/// The same knives for a level set. Of equal solids there is one.
LevelSetCutOptions levelSetOptions(const BrickGrid& level, const MeshCutOptions& options,
                                   const Progress& progress) {
  LevelSetCutOptions result{
      .planes = options.planes, .cells = options.cells, .kerf = options.kerf, .rough = options.rough};
  for (std::size_t i = 0; i < options.solids.size(); ++i) {
    const Mesh& solid = options.solids[i];
    std::size_t same = 0;
    while (options.solids[same].positions != solid.positions || options.solids[same].corners != solid.corners)
      ++same;
    result.knives.push_back(same < i ? result.knives[same]
                                     : solidKnife(solid, double(level.voxelSize), options.kerf, progress));
  }
  if (options.minVolume > 0) result.minVolume = options.minVolume;
  return result;
}

Result cutPart(const CutPart& part, const MeshCutOptions& options, const Progress& progress) {
  MeshPieces cut = part.level ? cutLevelSet(*part.level, part.mesh,
                                            levelSetOptions(*part.level, options, progress), progress)
                              : cutMesh(part.mesh, options, progress);
  Result result{.slivers = cut.slivers, .sliverVolume = cut.sliverVolume};
  const MassProperties whole = massProperties(part.mesh);
  result.volume = whole.volume;
  for (MeshPiece& piece : cut.pieces)
    result.pieces.push_back({.mesh = std::move(piece.mesh),
                             .code = std::move(piece.code),
                             .cell = piece.cell,
                             .mass = piece.mass,
                             .boxMin = piece.boxMin,
                             .boxMax = piece.boxMax,
                             .neighbours = std::move(piece.neighbours)});
  nameThem(result.pieces, part);
  // A cut takes volume away, or adds two faces.
  const auto isSame = [](double a, double b) { return std::abs(a - b) <= 1e-9 * std::abs(b); };
  if (part.parent && result.pieces.size() == 1 && isSame(result.pieces[0].mass.volume, whole.volume) &&
      isSame(result.pieces[0].mass.area, whole.area)) {
    result.pieces[0].name = part.name;
    result.pieces[0].parent = *part.parent;
    result.pieces[0].mesh = part.mesh;
  }
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
  if (first < count) mesh.groups.push_back({kInside, first, std::uint32_t(count) - first});
  return count - first;
}

/// Contacts of level-set pieces: what is a voxel in front of inner triangles.
void findNeighboursOfLevelSets(std::vector<NamedPiece>& pieces, const Progress& progress) {
  std::vector<std::map<std::uint32_t, double>> seen(pieces.size());
  parallelFor(
      pieces.size(), 1,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t p = begin; p < end; ++p) {
          const NamedPiece& piece = pieces[p];
          const double reach = double(piece.level->voxelSize);
          std::vector<std::uint32_t> near;
          for (std::uint32_t q = 0; q < pieces.size(); ++q) {
            const Vec3d gap = max(pieces[q].boxMin - piece.boxMax, piece.boxMin - pieces[q].boxMax);
            if (q != p && std::max({gap.x, gap.y, gap.z}) <= reach) near.push_back(q);
          }
          forInnerFaces(piece.mesh, [&](std::size_t f) {
            const Vec3d normal = normalOf(piece.mesh, f);
            const double area = length(normal) / 2;
            if (area == 0) return;
            const Vec3f front(middleOf(piece.mesh, f) + normal * (0.75 * reach / (2 * area)));
            for (const std::uint32_t q : near) {
              const BrickGrid& level = *pieces[q].level;
              const Vec3f v = level.worldToIndex(front);
              const auto nearest = [](float c) { return int(std::lround(c)); };
              if (!(level.at({nearest(v.x), nearest(v.y), nearest(v.z)}) > 0)) continue;
              seen[p][q] += area;
              break;
            }
          });
        }
      },
      progress);
  ContactAreas areas;
  for (std::uint32_t p = 0; p < pieces.size(); ++p)
    for (const auto& [q, area] : seen[p]) areas[std::minmax(p, q)] += area / 2;
  setNeighbours(pieces, areas);
}

Result cutLevel(const CutPart& part, CutOptions options, const Progress& progress) {
  require(part.level != nullptr, fmt::format("cut: '{}' has no level set", part.name));
  const ScalarField shape = gridField(part.level);
  options.box = boundingBox(part.mesh);
  Pieces cut = cutIntoPieces(shape, options, progress);
  Result result{.volume = signedVolume(part.mesh), .slivers = cut.slivers, .sliverVolume = cut.sliverVolume};
  std::vector<std::size_t> innerFaces(cut.pieces.size());
  result.pieces.resize(cut.pieces.size());
  progress.begin("mesh");
  parallelFor(
      cut.pieces.size(), 1,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          NamedPiece& piece = result.pieces[i];
          piece.level = cut.pieces[i].level.toBricks();
          piece.code = std::move(cut.pieces[i].code);
          piece.cell = cut.pieces[i].cell;
          piece.mesh = marchingCubes(*piece.level);
          innerFaces[i] = groupInnerFaces(piece.mesh, shape, 0.5f * options.voxelSize);
          setMeasures(piece);
        }
      },
      progress);
  nameThem(result.pieces, part);
  if (part.parent && result.pieces.size() == 1 && cut.slivers == 0 && innerFaces[0] == 0) {
    NamedPiece& piece = result.pieces[0];
    piece.name = part.name;
    piece.parent = *part.parent;
    piece.mesh = part.mesh;
    setMeasures(piece);
  }
  return result;
}

void checkClosed(std::vector<NamedPiece>& pieces, const Progress& progress) {
  parallelFor(
      pieces.size(), 16,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) pieces[i].closed = isClosed(pieces[i].mesh);
      },
      progress);
}

}  // namespace

Knife solidKnife(const Mesh& solid, double voxelSize, float kerf, const Progress& progress) {
  const double band = 0.5 * double(kerf) + 4 * voxelSize;
  return {
      meshDistance(solid, {.voxelSize = voxelSize, .exteriorBand = band, .interiorBand = band}, progress)};
}

PieceSet cutParts(std::span<const CutPart> parts, const MeshCutOptions& options, const Progress& progress) {
  requireNames(parts);
  std::vector<Result> results(parts.size());
  if (parts.size() == 1) {
    results[0] = cutPart(parts[0], options, progress);
  } else {
    progress.begin("cut");
    parallelFor(
        parts.size(), 1,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) try {
              results[i] = cutPart(parts[i], options, silent());
            } catch (const Cancelled&) {
              throw;
            } catch (const Error& error) {
              throw Error(fmt::format("{}: {}", parts[i].name, error.what()));
            }
        },
        progress);
  }
  PieceSet set = gathered(std::move(results));
  if (parts.size() > 1 && !set.pieces.empty()) findNeighbours(set.pieces);
  checkClosed(set.pieces, progress);
  return set;
}

PieceSet cutPartsAsLevelSets(std::span<const CutPart> parts, const CutOptions& options,
                             const Progress& progress) {
  requireNames(parts);
  std::vector<Result> results;
  for (const CutPart& part : parts) results.push_back(cutLevel(part, options, progress));
  PieceSet set = gathered(std::move(results));
  if (options.kerf == 0) findNeighboursOfLevelSets(set.pieces, progress);
  checkClosed(set.pieces, progress);
  return set;
}

}  // namespace nephele

// Cutting closed meshes into closed pieces.
//
// What rough blades and solids leave comes first (carve.h). Planes split all parts that there are, one plane
// after another, so that cost follows the pieces. A Voronoi cell is what the bisectors with its neighbours
// leave of the parts, nearest first; once the next point is more than twice as far as anything that is left,
// no other can reach the cell (radius of security: Levy and Bonneel, "Variational Anisotropic Surface Meshing
// with Voronoi Parallel Linear Enumeration", 2012). Contacts are found by their triangles, which are the same
// on both sides. Everything is ordered by cell, code and place in the source, never by thread.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <memory>
#include <numeric>

#include "nephele/levelset/cut/cut.h"
#include "nephele/levelset/cut/detail/flat_cut.h"
#include "nephele/levelset/mesh/mass_properties.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {

namespace {

using detail::CutPlane;
using detail::CutSource;
using detail::Solid;
using detail::SolidSplitter;

struct Part {
  Solid solid;
  PieceCode code;
};

/// Parts that share their cut points.
struct Family {
  std::unique_ptr<SolidSplitter> splitter;
  std::vector<Part> parts;
};

struct InnerTriangle {
  std::uint64_t place;
  std::uint32_t piece;
  double area;
};

std::vector<CutPlane> cutPlanes(const std::vector<BladePlane>& blades) {
  std::vector<CutPlane> planes;
  for (const BladePlane& blade : blades) {
    const Vec3d normal(blade.normal), point(blade.point);
    const double size = length(normal);
    require(isFinite(point) && isFinite(normal) && size > 0,
            fmt::format("cut: plane {} must have a finite point and a normal that is not 0", planes.size()));
    planes.push_back({normal / size, dot(normal, point) / size});
  }
  return planes;
}

std::vector<Vec3d> cellPoints(const std::vector<Vec3f>& cells) {
  std::vector<Vec3d> points;
  for (const Vec3f& p : cells) {
    require(isFinite(p), fmt::format("cut: the point of cell {} is not finite", points.size()));
    points.emplace_back(p);
  }
  const auto same = firstEqualPosition(points);
  for (std::size_t i = 0; i < same.size(); ++i)
    require(same[i] == i, fmt::format("cut: cells {} and {} have the same point", same[i], i));
  return points;
}

/// The same plane, moved along its normal; not a bisector any more.
CutPlane moved(const CutPlane& plane, double distance) {
  return {plane.normal, plane.offset + distance, {}};
}

/// What of the parts lies on one side of a plane.
void keepSide(Family& family, const CutPlane& plane, int side) {
  family.splitter->begin(plane);
  std::erase_if(family.parts, [&](Part& part) {
    const int box = family.splitter->sideOfBox(part.solid, plane);
    if (box == 0)
      part.solid = std::move(family.splitter->split(part.solid, {side == 0, side == 1})[std::size_t(side)]);
    return part.solid.isEmpty() || box == (side == 0 ? 1 : -1);
  });
}

/// Leaves of the parts what lies in a cell.
void keepCell(Family& family, std::span<const Vec3d> cells, std::uint32_t index, double halfKerf) {
  const Vec3d& centre = cells[index];
  const auto squared = [&](std::uint32_t j) { return dot(cells[j] - centre, cells[j] - centre); };
  const auto isFarther = [&](std::uint32_t a, std::uint32_t b) {
    return squared(a) != squared(b) ? squared(a) > squared(b) : a > b;
  };
  std::vector<std::uint32_t> others;
  for (std::uint32_t j = 0; j < cells.size(); ++j)
    if (j != index) others.push_back(j);
  std::make_heap(others.begin(), others.end(), isFarther);
  while (!others.empty() && !family.parts.empty()) {
    std::pop_heap(others.begin(), others.end(), isFarther);
    const std::uint32_t other = others.back();
    others.pop_back();
    double reach = 0;
    for (const Part& part : family.parts)
      reach = std::max(reach, length(max(part.solid.high - centre, centre - part.solid.low)));
    if (std::sqrt(squared(other)) > 2.000001 * (reach + halfKerf)) break;
    const std::uint32_t low = std::min(index, other), high = std::max(index, other);
    const CutPlane plane = detail::bisector(cells, low, high);
    const int side = index == low ? 0 : 1;
    const bool missesAll = std::all_of(family.parts.begin(), family.parts.end(), [&](const Part& part) {
      const CutPlane& blade = halfKerf > 0 ? moved(plane, side == 0 ? -halfKerf : halfKerf) : plane;
      return family.splitter->sideOfBox(part.solid, blade) == (side == 0 ? -1 : 1);
    });
    if (missesAll) continue;
    keepSide(family, halfKerf > 0 ? moved(plane, side == 0 ? -halfKerf : halfKerf) : plane, side);
  }
}

/// Splits the parts by a plane; with a kerf, what is left is behind one plane or before another.
void splitByPlane(Family& family, const CutPlane& plane, double halfKerf) {
  std::vector<Part> next;
  const auto add = [&](Solid&& solid, const PieceCode& code, bool side) {
    if (solid.isEmpty()) return;
    next.push_back({std::move(solid), code});
    next.back().code.sides.push_back(side);
  };
  SolidSplitter& splitter = *family.splitter;
  if (halfKerf == 0) {
    splitter.begin(plane);
    for (Part& part : family.parts) {
      const int box = splitter.sideOfBox(part.solid, plane);
      if (box != 0) {
        add(std::move(part.solid), part.code, box > 0);
        continue;
      }
      auto halves = splitter.split(part.solid);
      for (const std::size_t k : {0, 1}) add(std::move(halves[k]), part.code, k == 1);
    }
    family.parts = std::move(next);
    return;
  }
  // What is behind the first plane, and what that leaves.
  std::vector<Part> rest;
  const CutPlane behind = moved(plane, -halfKerf), before = moved(plane, halfKerf);
  splitter.begin(behind);
  for (Part& part : family.parts) {
    const int box = splitter.sideOfBox(part.solid, behind);
    if (box < 0) {
      add(std::move(part.solid), part.code, false);
    } else if (box > 0) {
      rest.push_back(std::move(part));
    } else {
      auto halves = splitter.split(part.solid);
      add(std::move(halves[0]), part.code, false);
      if (!halves[1].isEmpty()) rest.push_back({std::move(halves[1]), part.code});
    }
  }
  splitter.begin(before);
  for (Part& part : rest) {
    const int box = splitter.sideOfBox(part.solid, before);
    if (box > 0) add(std::move(part.solid), part.code, true);
    if (box == 0) add(std::move(splitter.split(part.solid, {false, true})[1]), part.code, true);
  }
  family.parts = std::move(next);
}

/// Codes have the sides of other knives first until all is cut; planes come before them.
void sortByCode(std::vector<Part>& parts, std::size_t planeCount) {
  for (Part& part : parts) {
    auto& sides = part.code.sides;
    std::rotate(sides.begin(), sides.end() - std::ptrdiff_t(planeCount), sides.end());
  }
  std::stable_sort(parts.begin(), parts.end(),
                   [](const Part& a, const Part& b) { return a.code.sides < b.code.sides; });
}

/// Cells whose points are arranged so that more than four meet find the place of that by different ways:
/// gives all cut points within `tolerance` of each other the same bits.
void alignCutPoints(std::vector<Family>& families, double tolerance) {
  // A direction, no longer than 1, across which no model has many points.
  constexpr Vec3d kAcross{0.8417, 0.4273, 0.3291};
  struct CutPoint {
    double key;
    Vec3d place;
    std::uint32_t family, vertex;
  };
  std::vector<CutPoint> points;
  for (std::uint32_t i = 0; i < families.size(); ++i) {
    const std::uint32_t first = families[i].splitter->firstCutPoint();
    std::vector<std::uint32_t> used;
    for (const Part& part : families[i].parts)
      for (const detail::SolidEdge& edge : part.solid.edges)
        if (edge.from >= first) used.push_back(edge.from);
    std::sort(used.begin(), used.end());
    used.erase(std::unique(used.begin(), used.end()), used.end());
    for (const std::uint32_t v : used) {
      const Vec3d& p = families[i].splitter->position(v);
      points.push_back({dot(p, kAcross), p, i, v});
    }
  }
  std::sort(points.begin(), points.end(), [](const CutPoint& a, const CutPoint& b) {
    return a.key != b.key ? a.key < b.key : std::pair(a.family, a.vertex) < std::pair(b.family, b.vertex);
  });
  std::vector<bool> isDone(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (isDone[i]) continue;
    for (std::size_t j = i + 1; j < points.size() && points[j].key - points[i].key <= tolerance; ++j) {
      if (isDone[j] || length(points[j].place - points[i].place) > tolerance) continue;
      isDone[j] = true;
      families[points[j].family].splitter->move(points[j].vertex, points[i].place);
    }
  }
}

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

struct Assembly {
  std::vector<MeshPiece> pieces;
  std::vector<std::vector<InnerTriangle>> inner;
  std::size_t slivers = 0;
  double sliverVolume = 0.0;
};

Assembly assemble(const CutSource& source, const SolidSplitter& splitter, Part& part, double minVolume) {
  Assembly result;
  const auto shells = detail::shellsOf(splitter, detail::trianglesOf(splitter, part.solid));
  part.solid = {};
  for (const detail::Shell& shell : shells) {
    if (shell.volume < minVolume) {
      ++result.slivers;
      result.sliverVolume += shell.volume;
      continue;
    }
    MeshPiece piece;
    detail::ShellMesh shellMesh = source.meshOf(splitter, shell);
    piece.mesh = std::move(shellMesh.mesh);
    piece.code = part.code;
    piece.mass = massProperties(piece.mesh);
    piece.boxMin = piece.boxMax = piece.mesh.positions[0];
    for (const Vec3d& p : piece.mesh.positions) {
      piece.boxMin = min(piece.boxMin, p);
      piece.boxMax = max(piece.boxMax, p);
    }
    std::vector<InnerTriangle> inner;
    for (std::size_t f = shellMesh.firstInside; f < piece.mesh.faceCount(); ++f) {
      const auto v = piece.mesh.face(f);
      const Vec3d &a = piece.mesh.positions[v[0]], &b = piece.mesh.positions[v[1]],
                  &c = piece.mesh.positions[v[2]];
      inner.push_back({placeOf({a, b, c}), 0, length(cross(b - a, c - a)) / 2});
    }
    // Last, so that both sides of a cut are compared with the same triangles.
    detail::splitEdges(piece.mesh, shellMesh.crowded);
    result.pieces.push_back(std::move(piece));
    result.inner.push_back(std::move(inner));
  }
  return result;
}

void findNeighbours(std::vector<MeshPiece>& pieces, std::vector<InnerTriangle> inner) {
  std::sort(inner.begin(), inner.end(), [](const InnerTriangle& a, const InnerTriangle& b) {
    return a.place != b.place ? a.place < b.place : a.piece < b.piece;
  });
  std::map<std::pair<std::uint32_t, std::uint32_t>, double> areas;
  for (std::size_t i = 0; i + 1 < inner.size(); ++i)
    if (inner[i].place == inner[i + 1].place && inner[i].piece != inner[i + 1].piece)
      areas[{inner[i].piece, inner[i + 1].piece}] += inner[i].area;
  for (const auto& [pair, area] : areas) {
    pieces[pair.first].neighbours.push_back({pair.second, area});
    pieces[pair.second].neighbours.push_back({pair.first, area});
  }
  for (MeshPiece& piece : pieces)
    std::sort(piece.neighbours.begin(), piece.neighbours.end(),
              [](const PieceContact& a, const PieceContact& b) { return a.piece < b.piece; });
}

}  // namespace

namespace detail {

void requireFlatKnives(const MeshCutOptions& options) {
  require(std::isfinite(options.minVolume) && options.minVolume >= 0,
          fmt::format("cut: minVolume must be finite and >= 0, got {}", options.minVolume));
  require(std::isfinite(options.kerf) && options.kerf >= 0,
          fmt::format("cut: kerf must be finite and >= 0, got {}", options.kerf));
  cutPlanes(options.planes);
  cellPoints(options.cells);
}

MeshPieces piecesOf(const CutSource& source, std::span<const Carved::Part> parts,
                    const MeshCutOptions& options, const Progress& progress) {
  const std::vector<CutPlane> planes = cutPlanes(options.planes);
  const std::vector<Vec3d> cells = cellPoints(options.cells);
  const double halfKerf = double(options.kerf) / 2;
  progress.begin("cut");
  std::vector<Family> families(std::max<std::size_t>(cells.size(), 1));
  parallelFor(
      families.size(), 1,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          Family& family = families[i];
          family.splitter = std::make_unique<SolidSplitter>(source.positions(), source.triangles(), cells,
                                                            source.tolerance());
          for (const Carved::Part& part : parts)
            family.parts.push_back({family.splitter->solidOf(part.triangles), {part.sides}});
          if (!cells.empty()) keepCell(family, cells, std::uint32_t(i), halfKerf);
          for (const CutPlane& plane : planes) {
            progress.check();
            splitByPlane(family, plane, halfKerf);
          }
          sortByCode(family.parts, planes.size());
          std::vector<Solid*> solids;
          for (Part& part : family.parts) solids.push_back(&part.solid);
          family.splitter->finish(solids);
        }
      },
      progress);

  if (cells.size() > 1) alignCutPoints(families, source.tolerance());

  progress.begin("pieces");
  std::vector<std::pair<std::size_t, std::size_t>> work;
  for (std::size_t i = 0; i < families.size(); ++i)
    for (std::size_t k = 0; k < families[i].parts.size(); ++k) work.push_back({i, k});
  std::vector<Assembly> assemblies(work.size());
  const double minVolume = std::max(options.minVolume, 1e-12 * source.volume());
  parallelFor(
      work.size(), 1,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          Family& family = families[work[i].first];
          assemblies[i] = assemble(source, *family.splitter, family.parts[work[i].second], minVolume);
        }
      },
      progress);

  MeshPieces result;
  std::vector<InnerTriangle> inner;
  for (std::size_t i = 0; i < work.size(); ++i) {
    Assembly& assembly = assemblies[i];
    for (std::size_t k = 0; k < assembly.pieces.size(); ++k) {
      for (InnerTriangle& triangle : assembly.inner[k]) {
        triangle.piece = std::uint32_t(result.pieces.size());
        inner.push_back(triangle);
      }
      if (!cells.empty()) assembly.pieces[k].cell = std::uint32_t(work[i].first);
      result.pieces.push_back(std::move(assembly.pieces[k]));
    }
    result.slivers += assembly.slivers;
    result.sliverVolume += assembly.sliverVolume;
    assembly = {};
  }
  findNeighbours(result.pieces, std::move(inner));
  return result;
}

}  // namespace detail

MeshPieces cutMesh(const Mesh& mesh, const MeshCutOptions& options, const Progress& progress) {
  detail::requireFlatKnives(options);
  CutSource source(mesh);
  std::vector<detail::Carved::Part> parts(1);
  if (options.rough.empty() && options.solids.empty()) {
    parts[0].triangles.resize(source.triangles().size());
    std::iota(parts[0].triangles.begin(), parts[0].triangles.end(), 0u);
  } else {
    progress.begin("knives");
    const auto sheets = detail::knifeSheets(options, source);
    detail::Carved carved = detail::carve(source.positions(), source.triangles(), sheets, progress);
    parts = std::move(carved.parts);
    source.refine(std::move(carved));
  }
  return detail::piecesOf(source, parts, options, progress);
}

}  // namespace nephele

// Cutting parts of a solid by planes and Voronoi cells.
//
// Planes split all parts that there are, one plane after another, so that cost follows the pieces. Parts that
// are large go on by themselves, with a splitter of their own, so that all processors have work; what is cut
// depends on the part and the planes alone. A Voronoi cell is what the bisectors with its neighbours leave of
// the parts, nearest first; once the next point is more than twice as far as anything that is left, no other
// can reach the cell (radius of security: Levy and Bonneel, "Variational Anisotropic Surface Meshing with
// Voronoi Parallel Linear Enumeration", 2012). Everything is ordered by cell, code and place in the source,
// never by thread.
#include "nephele/levelset/cut/detail/solids/flat_cut.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "nephele/levelset/cut/detail/solids/piece_assembly.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {

namespace {

struct PartCode : PieceCode {
  /// Of rough cells.
  std::optional<std::uint32_t> cell{};
};

struct Part {
  Solid solid;
  PartCode code;
};

/// Parts that share their cut points.
struct Family {
  /// Which cell the parts are in; 0 if there are none.
  std::uint32_t cell = 0;
  std::unique_ptr<SolidSplitter> splitter;
  std::vector<Part> parts{};
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
    require(same[i] == i, fmt::format("cut: cells {} and {} have the same point {}, {}, {}", same[i], i,
                                      cells[i].x, cells[i].y, cells[i].z));
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
    const CutPlane plane = bisector(cells, low, high);
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
  const auto add = [&](Solid&& solid, const PartCode& code, bool side) {
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
      for (const SolidEdge& edge : part.solid.edges)
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

/// Gives large parts families of their own.
void spread(std::vector<Family>& families, std::size_t largeSize) {
  const auto isLarge = [&](const Part& part) {
    return part.solid.whole.size() + part.solid.edges.size() >= largeSize;
  };
  for (std::size_t i = 0, count = families.size(); i < count; ++i) {
    const auto first = std::find_if(families[i].parts.begin(), families[i].parts.end(), isLarge);
    if (first == families[i].parts.end()) continue;
    std::vector<Part> kept;
    std::vector<Part> parts = std::exchange(families[i].parts, {});
    bool isFirst = true;
    for (Part& part : parts) {
      if (!isLarge(part) || std::exchange(isFirst, false)) {
        kept.push_back(std::move(part));
        continue;
      }
      families.push_back({families[i].cell, std::make_unique<SolidSplitter>(*families[i].splitter), {}});
      families.back().parts.push_back(std::move(part));
    }
    families[i].parts = std::move(kept);
  }
}

void splitByPlanes(std::vector<Family>& families, std::span<const CutPlane> planes, double halfKerf,
                   const CutSource& source, const Progress& progress) {
  // A family has signs for all points of the source: so many are worth it, and no more.
  constexpr std::size_t kFamilies = 32, kFewTriangles = 512;
  const std::size_t largeSize = std::max(source.triangles().size() / kFamilies, kFewTriangles);
  for (std::size_t k = 0; k < planes.size(); ++k) {
    progress.check();
    parallelFor(families.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) splitByPlane(families[i], planes[k], halfKerf);
    });
    spread(families, largeSize);
    progress.advance(double(k + 1) / double(planes.size()));
  }
}

std::vector<Family> split(const CutSource& source, std::span<const Carved::Part> parts,
                          std::span<const CutPlane> planes, std::span<const Vec3d> cells, double halfKerf,
                          const Progress& progress) {
  const auto familyOf = [&](std::uint32_t cell) {
    Family family{
        cell,
        std::make_unique<SolidSplitter>(source.positions(), source.triangles(), cells, source.tolerance()),
        {}};
    for (const Carved::Part& part : parts)
      family.parts.push_back({family.splitter->solidOf(part.triangles), {{part.sides}, part.cell}});
    return family;
  };
  std::vector<Family> families(std::max<std::size_t>(cells.size(), 1));
  if (cells.empty()) {
    families[0] = familyOf(0);
    splitByPlanes(families, planes, halfKerf, source, progress);
  }
  parallelFor(
      families.size(), 1,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          Family& family = families[i];
          if (!cells.empty()) {
            family = familyOf(std::uint32_t(i));
            keepCell(family, cells, std::uint32_t(i), halfKerf);
            for (const CutPlane& plane : planes) {
              progress.check();
              splitByPlane(family, plane, halfKerf);
            }
          }
          std::vector<Solid*> solids;
          for (Part& part : family.parts) {
            // The sides of planes come before those of other knives.
            auto& sides = part.code.sides;
            std::rotate(sides.begin(), sides.end() - std::ptrdiff_t(planes.size()), sides.end());
            solids.push_back(&part.solid);
          }
          family.splitter->finish(solids);
        }
      },
      progress);
  return families;
}

}  // namespace

void requireKnives(const Knives& knives, const CutOptions& options) {
  require(std::isfinite(options.minVolume.value_or(0)) && options.minVolume.value_or(0) >= 0,
          fmt::format("cut: minVolume must be finite and >= 0, got {}", options.minVolume.value_or(0)));
  require(std::isfinite(options.kerf) && options.kerf >= 0,
          fmt::format("cut: kerf must be finite and >= 0, got {}", options.kerf));
  for (const Knife& knife : knives.fields)
    require(std::isfinite(knife.steepest) && knife.steepest >= 1,
            fmt::format("cut: a knife's steepest gradient must be >= 1, got {}", knife.steepest));
  cutPlanes(knives.planes);
  cellPoints(knives.cells);
}

Pieces piecesOf(const CutSource& source, std::span<const Carved::Part> parts, const Knives& flat,
                const CutOptions& options, const Progress& progress) {
  const std::vector<CutPlane> planes = cutPlanes(flat.planes);
  const std::vector<Vec3d> cells = cellPoints(flat.cells);
  progress.begin("cut");
  std::vector<Family> families = split(source, parts, planes, cells, double(options.kerf) / 2, progress);
  if (cells.size() > 1) alignCutPoints(families, source.tolerance());

  progress.begin("pieces");
  std::vector<std::pair<Family*, Part*>> work;
  for (Family& family : families)
    for (Part& part : family.parts) work.push_back({&family, &part});
  // No two parts in a cell have one code.
  std::sort(work.begin(), work.end(), [](const auto& a, const auto& b) {
    const auto key = [](const auto& entry) {
      return std::pair(entry.second->code.cell.value_or(entry.first->cell), entry.second->code.sides);
    };
    return key(a) < key(b);
  });
  std::vector<Assembly> assemblies(work.size());
  const double minVolume = std::max(options.minVolume.value_or(0), 1e-12 * source.volume());
  parallelFor(
      work.size(), 1,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          auto& [family, part] = work[i];
          assemblies[i] = assemble(source, *family->splitter, part->solid, part->code, minVolume);
          for (Piece& piece : assemblies[i].pieces) {
            if (!cells.empty()) piece.cell = family->cell;
            if (part->code.cell) piece.cell = part->code.cell;
          }
        }
      },
      progress);
  if (!options.minVolume) dropSplinters(assemblies, source.volume());
  return gathered(std::move(assemblies));
}

}  // namespace nephele::detail

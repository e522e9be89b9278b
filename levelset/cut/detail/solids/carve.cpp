// Parting a solid by surfaces.
//
// All surfaces are brought together at once, so that the order of the knives does not matter. Facets between
// the lines in which surfaces meet form patches. A patch is on one side of every other surface, and so are
// all patches that join without crossing that surface; one look at the surest point of them settles the side,
// far from any rounding. What the sides of a patch say puts it into a part: facets of the solid once, facets
// of a knife inside of it into both parts that they part, in reverse.
#include "nephele/levelset/cut/detail/solids/carve.h"

#include <fmt/format.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "nephele/levelset/cut/detail/solids/cut_source.h"
#include "nephele/levelset/cut/detail/solids/surface_arrangement.h"
#include "nephele/levelset/grid/disjoint_sets.h"
#include "nephele/levelset/mesh/winding_number.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {
namespace {

constexpr std::uint32_t kNone = ~0u;

class Carver {
 public:
  Carver(std::span<const Vec3d> positions, std::span<const TriangleIndices> triangles,
         std::span<const KnifeSheet> sheets, const Progress& progress)
      : solidPositions_(positions), solidTriangles_(triangles), sheets_(sheets), progress_(progress) {}

  Carved run() {
    gather();
    arrangement_ = arrange({positions_, triangles_, start_, names_}, progress_);
    surfaces_.resize(arrangement_.facets.size());
    for (std::size_t f = 0; f < surfaces_.size(); ++f) {
      const auto after = std::upper_bound(start_.begin(), start_.end(), arrangement_.facets[f].parent);
      surfaces_[f] = std::uint32_t(after - start_.begin()) - 1;
    }
    progress_.check();
    mergeEqualFacets();
    findPatches();
    findSides();
    return write();
  }

 private:
  /// One list of positions, none twice, and of triangles.
  void gather() {
    std::vector<Vec3d> all(solidPositions_.begin(), solidPositions_.end());
    for (const KnifeSheet& sheet : sheets_)
      all.insert(all.end(), sheet.positions.begin(), sheet.positions.end());
    const std::vector<std::uint32_t> same = firstEqualPosition(all);
    const auto add = [&](std::span<const TriangleIndices> list, std::uint32_t offset) {
      start_.push_back(std::uint32_t(triangles_.size()));
      for (std::uint32_t i = 0; i < list.size(); ++i) {
        const TriangleIndices t{same[offset + list[i][0]], same[offset + list[i][1]],
                                same[offset + list[i][2]]};
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
        triangles_.push_back(t);
        origins_.push_back(i);
      }
    };
    add(solidTriangles_, 0);
    names_.push_back("the mesh");
    auto offset = std::uint32_t(solidPositions_.size());
    for (const KnifeSheet& sheet : sheets_) {
      add(sheet.triangles, offset);
      names_.push_back(sheet.name);
      offset += std::uint32_t(sheet.positions.size());
    }
    start_.push_back(std::uint32_t(triangles_.size()));
    positions_ = std::move(all);
  }

  const TriangleIndices& vertices(std::uint32_t facet) const { return arrangement_.facets[facet].vertices; }
  const Vec3d& at(std::uint32_t v) const { return arrangement_.positions[v]; }

  /// Where facets of several surfaces coincide, the first surface keeps its own, and knows of the others.
  void mergeEqualFacets() {
    struct Entry {
      TriangleIndices sorted;
      std::uint32_t facet;
    };
    std::vector<Entry> entries;
    for (std::uint32_t f = 0; f < surfaces_.size(); ++f) {
      if (!arrangement_.isInPlane[arrangement_.facets[f].parent]) continue;
      TriangleIndices t = vertices(f);
      std::sort(t.begin(), t.end());
      entries.push_back({t, f});
    }
    std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
      return a.sorted != b.sorted ? a.sorted < b.sorted : a.facet < b.facet;
    });
    isKept_.assign(surfaces_.size(), true);
    const auto isEven = [](TriangleIndices t) { return (t[0] < t[1]) ^ (t[1] < t[2]) ^ (t[0] < t[2]); };
    for (std::size_t i = 0, end = 0; i < entries.size(); i = end) {
      for (end = i + 1; end < entries.size() && entries[end].sorted == entries[i].sorted;) ++end;
      if (end - i < 2) continue;
      const std::uint32_t first = surfaces_[entries[i].facet];
      for (std::size_t j = i; j < end; ++j) {
        const std::uint32_t facet = entries[j].facet, surface = surfaces_[facet];
        if (surface != first) {
          isKept_[facet] = false;
          continue;
        }
        for (std::size_t k = i; k < end; ++k) {
          const std::uint32_t other = entries[k].facet;
          if (surfaces_[other] == first) continue;
          Labels labels = labelsOf(other);
          if (isEven(vertices(facet)) != isEven(vertices(other))) std::swap(labels[0], labels[1]);
          also_[facet].emplace_back(surfaces_[other], labels);
        }
      }
    }
  }

  /// What is behind a facet and before it: sides of a knife, 1 the positive one, or cells.
  using Labels = std::array<std::uint32_t, 2>;
  using Also = std::vector<std::pair<std::uint32_t, Labels>>;

  Labels labelsOf(std::uint32_t facet) const {
    const std::uint32_t surface = surfaces_[facet];
    if (surface == 0 || sheets_[surface - 1].cells.empty()) return {1, 0};
    return sheets_[surface - 1].cells[origins_[arrangement_.facets[facet].parent]];
  }

  const Also& alsoOf(std::uint32_t facet) const {
    static const Also none;
    const auto found = also_.find(facet);
    return found == also_.end() ? none : found->second;
  }

  void findPatches() {
    struct Half {
      std::uint64_t key;
      std::uint32_t facet;
    };
    std::vector<Half> halves;
    halves.reserve(3 * surfaces_.size());
    for (std::uint32_t f = 0; f < surfaces_.size(); ++f) {
      if (!isKept_[f]) continue;
      const TriangleIndices& t = vertices(f);
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = t[k], b = t[(k + 1) % 3];
        halves.push_back({std::uint64_t(std::min(a, b)) << 32 | std::max(a, b), f});
      }
    }
    tbb::parallel_sort(halves, [](const Half& a, const Half& b) {
      return a.key != b.key ? a.key < b.key : a.facet < b.facet;
    });
    DisjointSets patches(surfaces_.size());
    std::vector<std::vector<std::uint32_t>> seams;
    for (std::size_t i = 0, end = 0; i < halves.size(); i = end) {
      for (end = i + 1; end < halves.size() && halves[end].key == halves[i].key;) ++end;
      const std::uint32_t first = halves[i].facet;
      const bool isSimple = std::all_of(halves.begin() + std::ptrdiff_t(i) + 1,
                                        halves.begin() + std::ptrdiff_t(end), [&](const Half& half) {
                                          return surfaces_[half.facet] == surfaces_[first] &&
                                                 labelsOf(half.facet) == labelsOf(first) &&
                                                 alsoOf(half.facet) == alsoOf(first);
                                        });
      if (isSimple) {
        for (std::size_t j = i + 1; j < end; ++j) patches.join(first, halves[j].facet);
      } else {
        seams.emplace_back();
        for (std::size_t j = i; j < end; ++j) seams.back().push_back(halves[j].facet);
      }
    }
    patchOf_.assign(surfaces_.size(), kNone);
    for (std::uint32_t f = 0; f < surfaces_.size(); ++f) {
      if (!isKept_[f]) continue;
      const std::uint32_t root = patches.root(f);
      if (root == f) {
        patchOf_[f] = std::uint32_t(largest_.size());
        largest_.push_back({f, 0});
      }
      const std::uint32_t patch = patchOf_[f] = patchOf_[root];
      const TriangleIndices& t = vertices(f);
      const double area = length(cross(at(t[1]) - at(t[0]), at(t[2]) - at(t[0])));
      if (area > largest_[patch].second) largest_[patch] = {f, area};
    }
    for (const auto& facets : seams) {
      Seam seam;
      for (const std::uint32_t f : facets) {
        seam.patches.push_back(patchOf_[f]);
        seam.surfaces.push_back(surfaces_[f]);
        for (const auto& [other, labels] : alsoOf(f)) seam.surfaces.push_back(other);
      }
      for (auto* list : {&seam.patches, &seam.surfaces}) {
        std::sort(list->begin(), list->end());
        list->erase(std::unique(list->begin(), list->end()), list->end());
      }
      seams_.push_back(std::move(seam));
    }
    // Most seams are long lines between the same patches.
    std::sort(seams_.begin(), seams_.end());
    seams_.erase(std::unique(seams_.begin(), seams_.end()), seams_.end());
  }

  bool isOn(std::uint32_t patch, std::uint32_t surface) const {
    const std::uint32_t facet = largest_[patch].first;
    const Also& also = alsoOf(facet);
    return surfaces_[facet] == surface ||
           std::any_of(also.begin(), also.end(), [&](const auto& a) { return a.first == surface; });
  }

  /// For every surface, the side on which each patch is.
  void findSides() {
    const std::size_t count = largest_.size();
    isInside_.assign(sheets_.size() + 1, {});
    isOutside_.assign(count, false);
    isInside_[0] = sidesOf(0, count);
    // Rough blades end somewhere outside, where both of their sides are one.
    for (std::uint32_t p = 0; p < count; ++p)
      isOutside_[p] = surfaces_[largest_[p].first] != 0 && isInside_[0][p] == 0;
    parallelFor(
        sheets_.size(), 1,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t s = begin; s < end; ++s) isInside_[s + 1] = sidesOf(std::uint32_t(s + 1), count);
        },
        progress_);
  }

  std::vector<std::uint32_t> sidesOf(std::uint32_t surface, std::size_t count) const {
    DisjointSets components(count);
    for (const Seam& seam : seams_) {
      if (std::binary_search(seam.surfaces.begin(), seam.surfaces.end(), surface)) continue;
      std::uint32_t last = kNone;
      for (const std::uint32_t patch : seam.patches) {
        if (isOutside_[patch]) continue;
        if (last != kNone) components.join(last, patch);
        last = patch;
      }
    }
    // And how sure it is.
    const auto sideAt = [&](std::uint32_t patch) -> std::pair<std::uint32_t, double> {
      const TriangleIndices& t = vertices(largest_[patch].first);
      const Vec3d middle = (at(t[0]) + at(t[1]) + at(t[2])) / 3.0;
      if (surface > 0 && sheets_[surface - 1].cellAt) return sheets_[surface - 1].cellAt(middle);
      const double side = surface == 0 ? windingNumber(solidPositions_, solidTriangles_, middle) - 0.5
                                       : sheets_[surface - 1].side(middle);
      return {side > 0, std::abs(side)};
    };
    // The patches to ask are the largest three of each component.
    std::vector<std::array<std::uint32_t, 3>> asked(count, {kNone, kNone, kNone});
    for (std::uint32_t p = 0; p < count; ++p) {
      if (isOutside_[p] || isOn(p, surface)) continue;
      std::uint32_t here = p;
      for (std::uint32_t& best : asked[components.root(p)])
        if (here != kNone && (best == kNone || largest_[here].second > largest_[best].second))
          std::swap(here, best);
    }
    std::vector<std::uint32_t> inside(count, 0);
    for (std::uint32_t p = 0; p < count; ++p) {
      if (components.root(p) != p) {
        inside[p] = inside[components.root(p)];
        continue;
      }
      double surest = 0;
      for (const std::uint32_t patch : asked[p]) {
        if (patch == kNone) break;
        const auto [side, sureness] = sideAt(patch);
        if (sureness > surest) {
          surest = sureness;
          inside[p] = side;
        }
        // A winding number near a whole one has said all.
        if (surface == 0 && std::abs(surest - 0.5) < 0.1) break;
      }
    }
    return inside;
  }

  /// The part on the given sides of all sheets, or nothing between the two of a knife.
  std::uint32_t partOf(const std::vector<std::uint32_t>& sheetSides) {
    PartKey key;
    for (std::size_t s = 0; s < sheets_.size(); ++s) {
      if (!sheets_[s].cells.empty()) {
        key.second = sheetSides[s];
      } else if (s > 0 && sheets_[s].knife == sheets_[s - 1].knife) {
        if (sheetSides[s] != sheetSides[s - 1]) return kNone;
      } else {
        key.first.push_back(sheetSides[s] != 0);
      }
    }
    return parts_.try_emplace(std::move(key), std::uint32_t(parts_.size())).first->second;
  }

  std::vector<std::uint32_t> sheetSides(std::uint32_t patch) const {
    std::vector<std::uint32_t> sides(sheets_.size());
    for (std::size_t s = 0; s < sheets_.size(); ++s) sides[s] = isInside_[s + 1][patch];
    return sides;
  }

  Carved write() {
    const std::size_t count = largest_.size();
    // Per patch: the parts that take it as it is and in reverse.
    std::vector<std::array<std::uint32_t, 2>> takers(count, {kNone, kNone});
    for (std::uint32_t p = 0; p < count; ++p) {
      const std::uint32_t facet = largest_[p].first, surface = surfaces_[facet];
      std::vector<std::uint32_t> sides = sheetSides(p);
      if (surface == 0) {
        // The solid is behind its facets, as the positive side is behind those of sheets.
        for (const auto& [other, labels] : alsoOf(facet)) sides[other - 1] = labels[0];
        takers[p][0] = partOf(sides);
      } else if (isInside_[0][p] != 0) {
        for (const std::size_t k : {0, 1}) {
          sides[surface - 1] = labelsOf(facet)[k];
          for (const auto& [other, labels] : alsoOf(facet)) sides[other - 1] = labels[k];
          takers[p][k] = partOf(sides);
        }
      }
    }
    Carved result;
    for (const auto& [key, number] : parts_) result.parts.push_back({key.first, {}, key.second});
    std::vector<std::uint32_t> order(parts_.size());
    for (std::uint32_t i = 0; const auto& [key, number] : parts_) order[number] = i++;
    std::vector<std::uint32_t> firstFrame{0};
    for (const KnifeSheet& sheet : sheets_) {
      result.frames.insert(result.frames.end(), sheet.frames.begin(), sheet.frames.end());
      firstFrame.push_back(std::uint32_t(result.frames.size()));
    }
    // Of the points only those that are used, after those of the solid.
    std::vector<std::uint32_t> numbers(arrangement_.positions.size(), kNone);
    result.positions.assign(solidPositions_.begin(), solidPositions_.end());
    std::iota(numbers.begin(), numbers.begin() + std::ptrdiff_t(solidPositions_.size()), 0u);
    for (std::uint32_t f = 0; f < surfaces_.size(); ++f) {
      if (!isKept_[f]) continue;
      const std::uint32_t origin = origins_[arrangement_.facets[f].parent], surface = surfaces_[f];
      std::uint32_t parent = origin;
      if (surface > 0) {
        const KnifeSheet& sheet = sheets_[surface - 1];
        parent = kOnPlane | (firstFrame[surface - 1] + (sheet.frameOf.empty() ? 0 : sheet.frameOf[origin]));
      }
      for (const std::size_t k : {0, 1}) {
        const std::uint32_t part = takers[patchOf_[f]][k];
        if (part == kNone) continue;
        TriangleIndices t = vertices(f);
        for (std::uint32_t& v : t) {
          if (numbers[v] == kNone) {
            numbers[v] = std::uint32_t(result.positions.size());
            result.positions.push_back(at(v));
          }
          v = numbers[v];
        }
        if (k == 1) std::swap(t[1], t[2]);
        result.parts[order[part]].triangles.push_back(std::uint32_t(result.triangles.size()));
        result.triangles.push_back(t);
        result.parents.push_back(parent);
      }
    }
    std::erase_if(result.parts, [](const Carved::Part& part) { return part.triangles.empty(); });
    for (const Carved::Part& part : result.parts) requireClosed(result, part);
    return result;
  }

  void requireClosed(const Carved& carved, const Carved::Part& part) const {
    std::vector<TriangleIndices> triangles;
    triangles.reserve(part.triangles.size());
    for (const std::uint32_t t : part.triangles) triangles.push_back(carved.triangles[t]);
    const std::size_t open = openEdges(triangles);
    require(open == 0,
            fmt::format("cut: {} edges of a piece stay open: the mesh or a knife overlaps itself where they "
                        "meet",
                        open));
  }

  struct Seam {
    std::vector<std::uint32_t> patches, surfaces;
    auto operator<=>(const Seam&) const = default;
  };

  std::span<const Vec3d> solidPositions_;
  std::span<const TriangleIndices> solidTriangles_;
  std::span<const KnifeSheet> sheets_;
  const Progress& progress_;

  std::vector<Vec3d> positions_;
  std::vector<TriangleIndices> triangles_;
  /// Per triangle: which of its surface it was.
  std::vector<std::uint32_t> origins_, start_;
  std::vector<std::string> names_;
  Arrangement arrangement_;
  /// Per facet; 0 is the solid, 1 and up the sheets.
  std::vector<std::uint32_t> surfaces_, patchOf_;
  std::vector<bool> isKept_;
  /// Other surfaces that a facet is part of, and whether it faces the same way there.
  std::map<std::uint32_t, Also> also_;
  /// Per patch: its largest facet and that one's area.
  std::vector<std::pair<std::uint32_t, double>> largest_;
  std::vector<Seam> seams_;
  /// Per surface and patch: the side, or the cell.
  std::vector<std::vector<std::uint32_t>> isInside_;
  /// Per patch: whether it is of a knife and outside the solid.
  std::vector<bool> isOutside_;
  using PartKey = std::pair<std::vector<bool>, std::optional<std::uint32_t>>;
  std::map<PartKey, std::uint32_t> parts_;
};

}  // namespace

Carved carve(std::span<const Vec3d> positions, std::span<const TriangleIndices> triangles,
             std::span<const KnifeSheet> sheets, const Progress& progress) {
  return Carver(positions, triangles, sheets, progress).run();
}

}  // namespace nephele::detail

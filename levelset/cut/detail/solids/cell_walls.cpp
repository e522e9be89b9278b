// Walls of rough Voronoi cells.
//
// A box around the solid is cut into the flat cells. What parts two of them, once, is the network of flat
// walls; its edges are halved until they are short, each by a rule that looks at the edge alone, so that
// walls keep meeting in the same points. Then the network is carried along a noise of three components for a
// while: a flow moves no two points to one place, so that walls cross neither themselves nor each other and
// part space as the flat ones did; only triangles that are coarse for how steep the noise is may. A point is
// in the cell that the flow brings it back to.
#include "nephele/levelset/cut/detail/solids/cell_walls.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <unordered_map>

#include "nephele/levelset/cut/cut.h"
#include "nephele/levelset/cut/detail/piece_measures.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {
namespace {

using Label = std::array<std::uint32_t, 2>;

/// Triangles with the cells behind and before them.
struct Walls {
  std::vector<Vec3d> positions;
  std::vector<TriangleIndices> triangles;
  std::vector<Label> cells;
};

Mesh boxMesh(const Vec3d& low, const Vec3d& high) {
  Mesh box;
  for (int k = 0; k < 8; ++k)
    box.positions.push_back({k & 1 ? high.x : low.x, k & 2 ? high.y : low.y, k & 4 ? high.z : low.z});
  constexpr std::array<std::array<std::uint32_t, 4>, 6> kSides{
      {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
  for (const auto& side : kSides) {
    box.addFace(std::array{side[0], side[1], side[2]});
    box.addFace(std::array{side[0], side[2], side[3]});
  }
  return box;
}

Walls flatWalls(const std::vector<Vec3f>& cells, const Vec3d& low, const Vec3d& high,
                const Progress& progress) {
  Knives flat;
  flat.cells = cells;
  const Pieces pieces = cutIntoMeshes(boxMesh(low, high), flat, {}, progress);
  std::vector<Vec3d> all;
  for (const Piece& piece : pieces.pieces)
    all.insert(all.end(), piece.mesh.positions.begin(), piece.mesh.positions.end());
  const std::vector<std::uint32_t> same = firstEqualPosition(all);
  Walls walls;
  std::map<TriangleIndices, std::pair<TriangleIndices, std::uint32_t>> single;
  std::uint32_t offset = 0;
  for (const Piece& piece : pieces.pieces) {
    for (const MeshGroup& group : piece.mesh.groups) {
      if (group.name != kInsideGroup) continue;
      for (std::size_t f = group.firstFace; f < std::size_t(group.firstFace) + group.faceCount; ++f) {
        const auto face = piece.mesh.face(f);
        const TriangleIndices t{same[offset + face[0]], same[offset + face[1]], same[offset + face[2]]};
        TriangleIndices key = t;
        std::sort(key.begin(), key.end());
        const auto [found, isNew] = single.try_emplace(key, t, *piece.cell);
        if (isNew) continue;
        walls.triangles.push_back(found->second.first);
        walls.cells.push_back({found->second.second, *piece.cell});
        single.erase(found);
      }
    }
    offset += std::uint32_t(piece.mesh.positions.size());
  }
  require(single.empty(),
          "cut: more than four cells meet in one place, which rough walls cannot; move a point");
  walls.positions = std::move(all);
  return walls;
}

double areaOf(const Walls& walls) {
  double sum = 0;
  for (const TriangleIndices& t : walls.triangles)
    sum += length(
        cross(walls.positions[t[1]] - walls.positions[t[0]], walls.positions[t[2]] - walls.positions[t[0]]));
  return sum / 2;
}

/// Halves all edges longer than `longest`; returns whether there were any. What is outside of the box is left
/// out.
bool halveEdges(Walls& walls, double longest, const Vec3d& low, const Vec3d& high) {
  std::unordered_map<std::uint64_t, std::uint32_t> middles;
  Walls next;
  next.positions = std::move(walls.positions);
  std::vector<Vec3d>& positions = next.positions;
  const auto middle = [&](std::uint32_t a, std::uint32_t b) -> std::uint32_t {
    constexpr std::uint32_t kNone = ~0u;
    if (a > b) std::swap(a, b);
    const Vec3d along = positions[b] - positions[a];
    if (dot(along, along) <= longest * longest) return kNone;
    const auto [found, isNew] =
        middles.try_emplace(std::uint64_t(a) << 32 | b, std::uint32_t(positions.size()));
    if (isNew) {
      const Vec3d between = (positions[a] + positions[b]) * 0.5;
      positions.push_back(between);
    }
    return found->second;
  };
  for (std::size_t i = 0; i < walls.triangles.size(); ++i) {
    TriangleIndices t = walls.triangles[i];
    const Vec3d least = min(min(positions[t[0]], positions[t[1]]), positions[t[2]]),
                most = max(max(positions[t[0]], positions[t[1]]), positions[t[2]]);
    if (least.x > high.x || least.y > high.y || least.z > high.z || most.x < low.x || most.y < low.y ||
        most.z < low.z)
      continue;
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
      next.triangles.push_back({a, b, c});
      next.cells.push_back(walls.cells[i]);
    };
    std::array<std::uint32_t, 3> m{middle(t[0], t[1]), middle(t[1], t[2]), middle(t[2], t[0])};
    const auto has = [&](std::size_t k) { return m[k] != ~0u; };
    const int count = int(has(0)) + int(has(1)) + int(has(2));
    // So that an edge without a middle comes last, and of two, one with it.
    while ((count == 1 && !has(0)) || (count == 2 && has(2))) {
      std::rotate(t.begin(), t.begin() + 1, t.end());
      std::rotate(m.begin(), m.begin() + 1, m.end());
    }
    if (count == 0) {
      add(t[0], t[1], t[2]);
    } else if (count == 1) {
      add(t[0], m[0], t[2]);
      add(m[0], t[1], t[2]);
    } else if (count == 2) {
      add(m[0], t[1], m[1]);
      const auto squared = [&](std::uint32_t a, std::uint32_t b) {
        return dot(positions[a] - positions[b], positions[a] - positions[b]);
      };
      if (squared(t[0], m[1]) < squared(m[0], t[2])) {
        add(t[0], m[0], m[1]);
        add(t[0], m[1], t[2]);
      } else {
        add(t[0], m[0], t[2]);
        add(m[0], m[1], t[2]);
      }
    } else {
      add(t[0], m[0], m[2]);
      add(m[0], t[1], m[1]);
      add(m[2], m[1], t[2]);
      add(m[0], m[1], m[2]);
    }
  }
  walls = std::move(next);
  return !middles.empty();
}

/// The flow along a noise, for the time that carries points as far as the roughness says.
class Flow {
 public:
  explicit Flow(const RoughnessOptions& roughness) : amplitude_(double(roughness.amplitude)) {
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      NoiseOptions noise = roughness.noise;
      noise.seed = noise.seed * 3 + axis;
      components_.push_back(fractalSum(noise, {.octaves = roughness.octaves,
                                               .frequency = 1.0f,
                                               .lacunarity = roughness.lacunarity,
                                               .roughness = roughness.roughness,
                                               .seed = noise.seed}));
    }
  }

  // Small enough that a step folds nothing either.
  static constexpr int kSteps = 12;

  void carryAStep(std::span<Vec3d> points) const {
    const std::vector<Vec3d> moves = velocity(points);
    for (std::size_t i = 0; i < points.size(); ++i) points[i] += moves[i] * (1.0 / kSteps);
  }

  Vec3d carriedBack(const Vec3d& point) const {
    constexpr int kCorrections = 4;
    Vec3d p = point;
    for (int step = 0; step < kSteps; ++step) {
      Vec3d before = p;
      for (int i = 0; i < kCorrections; ++i) before = p - velocity(std::span(&before, 1))[0] * (1.0 / kSteps);
      p = before;
    }
    return p;
  }

 private:
  std::vector<Vec3d> velocity(std::span<const Vec3d> points) const {
    std::array<std::vector<float>, 3> lanes;
    for (int axis = 0; axis < 3; ++axis)
      for (const Vec3d& p : points) lanes[std::size_t(axis)].push_back(float(p[axis]));
    std::vector<Vec3d> result(points.size());
    std::vector<float> values(points.size());
    for (int axis = 0; axis < 3; ++axis) {
      components_[std::size_t(axis)].eval({lanes[0], lanes[1], lanes[2]}, values);
      for (std::size_t i = 0; i < points.size(); ++i) result[i][axis] = amplitude_ * double(values[i]);
    }
    return result;
  }

  double amplitude_;
  std::vector<ScalarField> components_;
};

}  // namespace

KnifeSheet cellWalls(const Knives& knives, const CutSource& solid, const Progress& progress) {
  const RoughnessOptions& roughness = knives.cellRoughness;
  require(std::isfinite(roughness.amplitude) && roughness.amplitude >= 0,
          fmt::format("cut: the roughness of cells must be >= 0, got {}", roughness.amplitude));
  constexpr double kMargin = 0.1, kPeaks = 8, kMostTriangles = 3e6, kTriangleShare = 0.3, kDrawnOut = 1.3;
  const double diagonal = length(solid.high() - solid.low()), amplitude = double(roughness.amplitude);
  const double margin = std::max(kMargin * diagonal, kPeaks * amplitude);
  const Vec3d around{margin, margin, margin};
  const Vec3d low = solid.low() - around, high = solid.high() + around;
  Walls walls = flatWalls(knives.cells, low - around, high + around, progress);
  const double spacing = std::max(roughSpacing(roughness, diagonal),
                                  std::sqrt(areaOf(walls) / (kTriangleShare * kMostTriangles)));
  while (halveEdges(walls, spacing, low, high)) progress.check();

  const auto flow = std::make_shared<const Flow>(roughness);
  for (int step = 0; step < Flow::kSteps; ++step) {
    parallelFor(
        walls.positions.size(), 4096,
        [&](std::size_t begin, std::size_t end) {
          flow->carryAStep(std::span(walls.positions).subspan(begin, end - begin));
        },
        progress);
    // What is drawn out stays as smooth as the rest.
    if (double(walls.triangles.size()) < kMostTriangles) halveEdges(walls, kDrawnOut * spacing, low, high);
  }

  KnifeSheet sheet;
  sheet.name = "the network of rough walls (less roughness or fewer octaves keep it smooth)";
  std::map<Label, std::uint32_t> frames;
  for (const Label& cells : walls.cells) {
    const auto [found, isNew] = frames.try_emplace(cells, std::uint32_t(sheet.frames.size()));
    if (isNew)
      sheet.frames.push_back(
          PlaneFrame::of(normalize(Vec3d(knives.cells[cells[1]]) - Vec3d(knives.cells[cells[0]]))));
    sheet.frameOf.push_back(found->second);
  }
  sheet.cellAt = [flow, cells = knives.cells](const Vec3d& p) {
    const Vec3d at = flow->carriedBack(p);
    double nearest = INFINITY, second = INFINITY;
    std::uint32_t cell = 0;
    for (std::uint32_t i = 0; i < cells.size(); ++i) {
      const double distance = length(Vec3d(cells[i]) - at);
      if (distance < nearest) {
        second = std::exchange(nearest, distance);
        cell = i;
      } else {
        second = std::min(second, distance);
      }
    }
    return std::pair(cell, second - nearest);
  };
  sheet.positions = std::move(walls.positions);
  sheet.triangles = std::move(walls.triangles);
  sheet.cells = std::move(walls.cells);
  return sheet;
}

}  // namespace nephele::detail

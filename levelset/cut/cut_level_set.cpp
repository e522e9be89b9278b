// Cutting level sets by linear cells.
//
// Curved knives are brought to the level set's own lattice (lattice_carve.cpp). Planes and bisectors of cells
// are linear everywhere, so that splitting the closed parts that are left by them (cut_mesh.cpp) is the
// same as splitting all tetrahedra, without the pieces of faces that lie in one plane.
//
// Rounding, and ties, depend on the order in which knives are taken. They are taken in an order of their own:
// planes, rough blades and points by their numbers, fields by their values at some points; codes and cells
// are then put into the order of the caller.
#include "nephele/levelset/cut/cut_level_set.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "nephele/levelset/cut/detail/flat_cut.h"
#include "nephele/levelset/cut/detail/lattice_carve.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/noise/noise_draw.h"

namespace nephele {
namespace {

using detail::Carved;
using detail::LatticeKnife;
using detail::PlaneFrame;

auto numbersOf(const BladePlane& plane) {
  return std::tuple(plane.normal, plane.point);
}

/// Numbers from 0 in the order of their values.
template <class Values>
std::vector<std::uint32_t> sorted(const Values& values) {
  std::vector<std::uint32_t> order(values.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return values[a] < values[b]; });
  return order;
}

/// The values of a knife at some points of a box, the same for all knives.
std::vector<float> valuesOf(const Knife& knife, const Box& box) {
  constexpr std::size_t kPoints = 256;
  detail::Draw draw(1);
  std::array<std::vector<float>, 3> points;
  std::vector<float> values(kPoints);
  for (std::size_t i = 0; i < kPoints; ++i)
    for (int axis = 0; axis < 3; ++axis)
      points[std::size_t(axis)].push_back(box.min[axis] + draw.uniform() * (box.max - box.min)[axis]);
  knife.field.eval({points[0], points[1], points[2]}, values);
  for (float& v : values)
    if (std::isnan(v)) v = 0;
  values.push_back(knife.steepest);
  return values;
}

/// The knives that are no planes, and where the caller has them.
struct CurvedKnives {
  std::vector<LatticeKnife> knives;
  /// Per rough blade, then per field: its place in `knives`.
  std::vector<std::uint32_t> places;
};

CurvedKnives curvedKnives(const LevelSetCutOptions& options, const Box& box) {
  std::vector<LatticeKnife> given;
  for (const RoughBlade& blade : options.rough)
    given.push_back(
        {roughKnife(blade.plane, blade.roughness), PlaneFrame::of(normalize(Vec3d(blade.plane.normal)))});
  for (const Knife& knife : options.knives) {
    require(std::isfinite(knife.steepest) && knife.steepest >= 1,
            fmt::format("cut: a knife's steepest gradient must be >= 1, got {}", knife.steepest));
    given.push_back({knife});
  }
  std::vector<std::vector<float>> values;
  for (const LatticeKnife& knife : given) values.push_back(valuesOf(knife.knife, box));
  CurvedKnives result;
  result.places.resize(given.size());
  std::vector<std::uint32_t> taken;
  for (const std::uint32_t i : sorted(values)) {
    // Hills are not equal at some points unless they are everywhere.
    const auto isSame = [&](std::uint32_t j) {
      return given[i].knife.field.node() == given[j].knife.field.node() ||
             (given[i].frame && given[j].frame && values[i] == values[j]);
    };
    const auto same = std::find_if(taken.begin(), taken.end(), isSame);
    result.places[i] = std::uint32_t(same - taken.begin());
    if (same != taken.end()) continue;
    taken.push_back(i);
    result.knives.push_back(given[i]);
  }
  return result;
}

Mesh meshOf(const Carved& carved) {
  constexpr std::uint32_t kUnused = ~0u;
  std::vector<std::uint32_t> numbers(carved.positions.size(), kUnused);
  Mesh mesh;
  mesh.corners.reserve(3 * carved.triangles.size());
  mesh.faceStart.reserve(carved.triangles.size() + 1);
  for (const detail::TriangleIndices& t : carved.triangles) mesh.addFace(t);
  for (const std::uint32_t v : mesh.corners) numbers[v] = 0;
  for (std::size_t v = 0; v < numbers.size(); ++v) {
    if (numbers[v] == kUnused) continue;
    numbers[v] = std::uint32_t(mesh.positions.size());
    mesh.positions.push_back(carved.positions[v]);
  }
  for (std::uint32_t& v : mesh.corners) v = numbers[v];
  return mesh;
}

}  // namespace

Mesh marchingTetrahedra(const BrickGrid& level, const Progress& progress) {
  progress.begin("triangles");
  Mesh mesh = meshOf(detail::carveLattice(level, {}, 0, progress));
  progress.count("triangles", double(mesh.faceCount()));
  return mesh;
}

MeshPieces cutLevelSet(const BrickGrid& level, const LevelSetCutOptions& options, const Progress& progress) {
  return cutLevelSet(level, marchingTetrahedra(level, progress), options, progress);
}

MeshPieces cutLevelSet(const BrickGrid& level, const Mesh& whole, const LevelSetCutOptions& options,
                       const Progress& progress) {
  requireValid(whole);
  MeshCutOptions flat{.kerf = options.kerf};
  flat.minVolume = options.minVolume.value_or(std::abs(double(determinant(level.indexToWorld.linear))));
  std::vector<std::tuple<Vec3f, Vec3f>> planes;
  for (const BladePlane& plane : options.planes) planes.push_back(numbersOf(plane));
  const auto planeOrder = sorted(planes), cellOrder = sorted(options.cells);
  for (const std::uint32_t i : planeOrder) flat.planes.push_back(options.planes[i]);
  for (const std::uint32_t i : cellOrder) flat.cells.push_back(options.cells[i]);
  detail::requireFlatKnives(flat);
  const CurvedKnives curved = curvedKnives(options, level.worldBox());

  require(whole.faceCount() > 0, "cut: the level set has no surface");
  detail::CutSource source(whole, "the level set");
  std::vector<Carved::Part> parts(1);
  if (curved.knives.empty()) {
    parts[0].triangles.resize(source.triangles().size());
    std::iota(parts[0].triangles.begin(), parts[0].triangles.end(), 0u);
  } else {
    progress.begin("knives");
    Carved carved = detail::carveLattice(level, curved.knives, options.kerf, progress);
    parts = std::move(carved.parts);
    source.refine(std::move(carved));
  }
  MeshPieces result = detail::piecesOf(source, parts, flat, progress);

  for (MeshPiece& piece : result.pieces) {
    const std::vector<bool> taken = std::move(piece.code.sides);
    piece.code.sides.assign(options.planes.size() + curved.places.size(), false);
    for (std::size_t i = 0; i < planeOrder.size(); ++i) piece.code.sides[planeOrder[i]] = taken[i];
    for (std::size_t i = 0; i < curved.places.size(); ++i)
      piece.code.sides[options.planes.size() + i] = taken[options.planes.size() + curved.places[i]];
    if (piece.cell) piece.cell = cellOrder[*piece.cell];
  }
  return result;
}

}  // namespace nephele

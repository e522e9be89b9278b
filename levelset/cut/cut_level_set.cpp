// Cutting level sets by linear cells.
//
// Curved knives are brought to the level set's own lattice (lattice_carve.cpp). Planes and bisectors of cells
// are linear everywhere, so that splitting the closed parts that are left by them (flat_cut.cpp) is the
// same as splitting all tetrahedra, without the pieces of faces that lie in one plane.
//
// Rounding, and ties, depend on the order in which knives are taken. They are taken in an order of their own:
// planes, rough blades and points by their numbers, fields by their values at some points; codes and cells
// are then put into the order of the caller.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "nephele/levelset/cut/cut.h"
#include "nephele/levelset/cut/detail/piece_measures.h"
#include "nephele/levelset/cut/detail/solids/flat_cut.h"
#include "nephele/levelset/cut/detail/tetrahedra/lattice_carve.h"
#include "nephele/levelset/cut/detail/tetrahedra/level_set_cut.h"
#include "nephele/levelset/cut/marching_tetrahedra.h"
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
  /// Per rough blade, solid and field: its place in `knives`.
  std::vector<std::uint32_t> places;
};

CurvedKnives curvedKnives(const Knives& knives, float kerf, const BrickGrid& level,
                          const Progress& progress) {
  Knives curved = knives;
  curved.planes.clear();
  const Box box = level.worldBox();
  std::vector<LatticeKnife> given;
  for (const Knife& knife : asFields(curved, double(level.voxelSize()), kerf, progress))
    given.push_back({knife});
  for (std::size_t i = 0; i < knives.rough.size(); ++i)
    given[i].frame = PlaneFrame::of(normalize(Vec3d(knives.rough[i].plane.normal)));
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

}  // namespace

namespace detail {

Pieces cutLevelSet(const BrickGrid& level, const Mesh& whole, const Knives& knives, const CutOptions& options,
                   const Progress& progress) {
  requireValid(whole);
  requireKnives(knives, options);
  require(knives.cellRoughness.amplitude == 0, "cut: rough cells part meshes only, not level sets");
  CutOptions flatOptions = options;
  if (!options.minVolume) flatOptions.minVolume = std::abs(double(determinant(level.indexToWorld().linear)));
  std::vector<std::tuple<Vec3f, Vec3f>> planes;
  for (const BladePlane& plane : knives.planes) planes.push_back(numbersOf(plane));
  const auto planeOrder = sorted(planes), cellOrder = sorted(knives.cells);
  Knives flat;
  for (const std::uint32_t i : planeOrder) flat.planes.push_back(knives.planes[i]);
  for (const std::uint32_t i : cellOrder) flat.cells.push_back(knives.cells[i]);

  require(whole.faceCount() > 0, "cut: the level set has no surface");
  const CurvedKnives curved = curvedKnives(knives, options.kerf, level, progress);
  CutSource source(whole, "the level set");
  std::vector<Carved::Part> parts(1);
  if (curved.knives.empty()) {
    parts[0].triangles.resize(source.triangles().size());
    std::iota(parts[0].triangles.begin(), parts[0].triangles.end(), 0u);
  } else {
    progress.begin("knives");
    Carved carved = carveLattice(level, curved.knives, options.kerf, progress);
    parts = std::move(carved.parts);
    source.refine(std::move(carved));
  }
  Pieces result = piecesOf(source, parts, flat, flatOptions, progress);

  for (Piece& piece : result.pieces) {
    const std::vector<bool> taken = std::move(piece.code.sides);
    piece.code.sides.assign(knives.signs(), false);
    for (std::size_t i = 0; i < planeOrder.size(); ++i) piece.code.sides[planeOrder[i]] = taken[i];
    for (std::size_t i = 0; i < curved.places.size(); ++i)
      piece.code.sides[planeOrder.size() + i] = taken[planeOrder.size() + curved.places[i]];
    if (piece.cell) piece.cell = cellOrder[*piece.cell];
  }
  result.volumeOriginal = massProperties(whole).volume;
  sumUp(result);
  checkClosed(result.pieces, progress);
  return result;
}

}  // namespace detail

Pieces cutIntoMeshes(const BrickGrid& level, const Knives& knives, const CutOptions& options,
                     const Progress& progress) {
  return detail::cutLevelSet(level, marchingTetrahedra(level, progress), knives, options, progress);
}

}  // namespace nephele

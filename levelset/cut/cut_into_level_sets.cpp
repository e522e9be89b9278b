// Cutting level sets by knives in one pass.
//
// cut_bricks.cpp finds, for every brick, the samples inside the shape by the sides of all knives, numbered as
// they occur; the 2^N others never appear. These hang together as shells (cut_shells.cpp), of which some are
// slivers and some one piece (shell_necks.cpp); then pieces are written where their surfaces are
// (piece_samples.cpp). Everything is ordered by place, never by knife or thread.
#include <fmt/format.h>

#include <cmath>

#include "nephele/levelset/cut/cut.h"
#include "nephele/levelset/cut/detail/level_sets/piece_samples.h"
#include "nephele/levelset/cut/detail/level_sets/shell_necks.h"
#include "nephele/levelset/cut/detail/piece_measures.h"
#include "nephele/levelset/cut/detail/solids/flat_cut.h"
#include "nephele/modeling/base/error.h"

namespace nephele {

namespace {

using detail::CutCode;
using detail::CutPlan;
using detail::CutShells;
using detail::kNobody;

void requireLattice(const PieceLattice& lattice) {
  require(std::isfinite(lattice.voxelSize) && lattice.voxelSize > 0,
          fmt::format("cut: voxelSize must be > 0, got {}", lattice.voxelSize));
  require(!lattice.box.isEmpty() && isFinite(lattice.box.min) && isFinite(lattice.box.max),
          "cut: the box must be bounded and not empty");
  require(lattice.bandVoxels >= 2 && lattice.bandVoxels < BrickGrid::kBrick,
          fmt::format("cut: bandVoxels must be from 2 to 7, got {}", lattice.bandVoxels));
}

/// Which shells have fewer whole cells than the least volume, voxels, asks for: those with enough of them are
/// no slivers.
std::vector<bool> smallShells(const CutShells& shells, double minVolume) {
  std::vector<double> leastVolume(shells.ownerCount(), 0.0);
  for (const detail::ShellPart& part : shells.parts().items)
    if (leastVolume[part.owner] < minVolume)
      leastVolume[part.owner] += double(detail::wholeCells(part.samples));
  std::vector<bool> isSmall(shells.ownerCount());
  for (std::uint32_t s = 0; s < isSmall.size(); ++s) isSmall[s] = leastVolume[s] < minVolume;
  return isSmall;
}

Piece pieceOf(const CutCode& code, std::size_t knives) {
  Piece piece;
  piece.code.sides.resize(knives);
  for (std::uint32_t k = 0; k < knives; ++k) piece.code.sides[k] = detail::bitOf(code.sides, k);
  if (code.cell != CutCode::kNoCell) piece.cell = code.cell;
  return piece;
}

}  // namespace

Pieces cutIntoLevelSets(const ScalarField& shape, const PieceLattice& lattice, const Knives& knives,
                        const CutOptions& options, const Progress& progress) {
  requireLattice(lattice);
  detail::requireKnives(knives, options);
  require(knives.cellRoughness.amplitude == 0, "cut: rough cells part meshes only, not level sets");
  const CutPlan plan{lattice, asFields(knives, double(lattice.voxelSize), options.kerf, progress),
                     knives.cells, options.kerf};
  progress.begin("find pieces");
  const detail::CutBricks bricks = detail::cutBricks(shape, plan, progress);
  CutShells shells(bricks, lattice.bandVoxels, progress);
  const detail::PieceSamples samples(plan, shells);

  progress.begin("write pieces");
  const double voxel = double(lattice.voxelSize) * double(lattice.voxelSize) * double(lattice.voxelSize);
  const double minVolume = options.minVolume.value_or(voxel);
  const std::vector<bool> isSmall = smallShells(shells, minVolume / voxel);
  const std::vector<double> small = samples.smallVolumes(isSmall, progress);
  Pieces result;
  std::vector<std::uint32_t> kept;
  for (std::uint32_t s = 0; s < shells.ownerCount(); ++s) {
    if (!isSmall[s] || small[s] * voxel >= minVolume) {
      kept.push_back(s);
    } else {
      ++result.slivers;
      result.sliverVolume += small[s] * voxel;
    }
  }
  const auto groups = detail::joinedByNecks(shape, plan, shells, kept, progress);
  std::vector<std::uint32_t> pieceOfShell(shells.ownerCount(), kNobody);
  for (std::uint32_t g = 0; g < groups.size(); ++g)
    for (const std::uint32_t shell : groups[g]) pieceOfShell[shell] = g;
  shells.giveTo(pieceOfShell, groups.size());
  std::vector<PieceLevelSet> levels = samples.levelSets(progress);
  for (std::uint32_t g = 0; g < groups.size(); ++g) {
    result.pieces.push_back(pieceOf(bricks.codes[shells.codeOf(g)], plan.knives.size()));
    result.pieces.back().level = std::move(levels[g]);
  }
  detail::sumUp(result);
  return result;
}

}  // namespace nephele

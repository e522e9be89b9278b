#pragma once

#include <optional>
#include <vector>

#include "nephele/levelset/cut/piece_level_set.h"
#include "nephele/modeling/base/progress.h"
#include "nephele/modeling/shape/knives.h"

namespace nephele {

struct CutOptions {
  /// Edge of a voxel, world units, > 0. Voxels stand at integer multiples of it.
  float voxelSize = 0.0f;
  /// A box around the surface of the shape, world units.
  Box box{};
  std::vector<Knife> knives{};
  /// Points whose Voronoi cells part the shape, too. Empty: none.
  std::vector<Vec3f> cells{};
  /// Width of the cut, world units, >= 0: half of it goes from each side.
  float kerf = 0.0f;
  /// Shells with less volume are left out, voxels, >= 0.
  double minVolume = 1.0;
  /// How far from their surface the pieces hold values, voxels, 2 to 7.
  float bandVoxels = 3.0f;
};

/// A connected part of a shape that was cut. Where it is thinner than a voxel, its grid may show it as
/// several shells.
struct Piece {
  /// The sides of the knives, in their order.
  PieceCode code;
  /// Which of the cells, if there are any.
  std::optional<std::uint32_t> cell;
  /// min(shape, +-knives - kerf / 2, distance to the cell's sides) within the band of its surface, the band's
  /// ends beyond; positive inside. Other pieces of the same code are outside of it.
  PieceLevelSet level;
};

struct Pieces {
  /// In the order of their first voxels by z, y, x: the order of the knives does not change it.
  std::vector<Piece> pieces;
  /// Combinations of sides and cells that occur, of the many that could: slivers count.
  std::size_t codes = 0;
  /// Shells below `minVolume`, and the volume that went with them.
  std::size_t slivers = 0;
  double sliverVolume = 0.0;
};

/// Cuts a shape into pieces, as level sets.
///
/// `shape` is positive inside and a distance within the band; beyond it may be any number of the right sign.
/// One walk finds the side of every knife for every voxel inside; only combinations that occur are ever
/// looked at, so cost follows what is there: bricks that no blade passes are settled by ranges, and pieces
/// are written where their surfaces are. Voxels on a blade, or within half a kerf of it, belong to no piece.
/// The result is the same bit for bit at any thread count and for any order of the knives; the bits of the
/// codes follow the knives.
///
/// Where two surfaces meet at an angle the grid bevels the rim, by some (voxelSize)^2 / 4 across.
/// @throws Error for options outside their range, equal cells, a box too large for its voxels; Cancelled.
/// Source: Tessendorf, Resolution Independent Volumes, chapter 5.
Pieces cutIntoPieces(const ScalarField& shape, const CutOptions& options,
                     const Progress& progress = silent());

}  // namespace nephele

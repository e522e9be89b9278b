#pragma once

#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "nephele/levelset/grid/grid_field.h"
#include "nephele/levelset/grid/lattice.h"
#include "nephele/modeling/cloud/advect.h"

/// Semi-Lagrangian mapping (SELMA): a flow carries the map X instead of what it maps.
///
/// Rules for all: X(x) is where the matter at x was at the start; velocities are in world units per unit of
/// time. Source: Tessendorf, Resolution Independent Volumes, chapter 8.
namespace nephele {

/// The map of a flow, kept on bricks wherever matter of the start has arrived, and one brick around.
struct FlowMap {
  Lattice lattice;
  /// X - x, in world units, one grid per component; null for the map that moves nothing. Beyond the kept
  /// bricks the grids read 0, which means nothing there.
  VectorGrids displacement{};
  /// The bricks that are kept, in the order of the table.
  std::vector<Vec3i> bricks;

  bool isIdentity() const { return displacement[0] == nullptr; }
  /// Bytes held.
  std::size_t memoryBytes() const;
};

/// X as a field, interpolated by Catmull-Rom: compose(rho, mapField(map)) is rho carried along, in full
/// detail, wherever the map is kept. Elsewhere it is the identity.
VectorField mapField(const FlowMap& map);

/// Where grids hold anything but their background, as bricks of a lattice.
class Matter {
 public:
  /// Every part of `grids` that interpolation can read, however they stand in space.
  Matter(std::span<const std::shared_ptr<const BrickGrid>> grids, const Lattice& lattice);
  ~Matter();

  const Lattice& lattice() const { return lattice_; }
  /// The bricks, in the order of z, y, x.
  const std::vector<Vec3i>& bricks() const { return bricks_; }
  /// True where there may be matter.
  bool mayBeAt(const Vec3f& point) const;

 private:
  struct Table;
  Lattice lattice_;
  std::vector<Vec3i> bricks_;
  std::unique_ptr<Table> table_;
};

/// The map that moves nothing, on the lattice of `matter`.
FlowMap identityMap(const Matter& matter);

/// The map after one more step: X'(x) = X(x - u dt), traced with the midpoint rule (equation 8.8).
///
/// X - x is what is interpolated, so that a map which hardly moves is nearly exact; Catmull-Rom, whose errors
/// do not add up to a drift as those of trilinear maps do. Beyond the bricks that are kept the nearest one is
/// read. Kept are the bricks that hold a voxel whose X lies in `matter`, and their neighbours: what an
/// earlier call kept is all that the next one needs, so a map may be written and continued later. Time and
/// memory follow the bricks kept, not the steps before. All cores; the same bits at any thread count.
/// @throws Error if dt is not finite, the velocity is not, it carries a voxel farther than kLongestStep
/// voxels, or the map and the one before it take more than `mostBytes`; Cancelled.
FlowMap advanced(const FlowMap& map, const Matter& matter, const VectorField& velocity, float dt,
                 double mostBytes = std::numeric_limits<double>::infinity(),
                 const Progress& progress = silent());

/// Voxels that one step may move matter by.
inline constexpr float kLongestStep = 256.0f;

/// The bricks of the map that hold matter.
std::vector<Vec3i> matterBricks(const FlowMap& map, const Matter& matter);

/// Share of the voxels of `matterBricks` where det grad X <= 0: where the map has folded and tells little
/// more. A few percent say that it is time to bake what is mapped and to start a new map.
double foldedShare(const FlowMap& map, const Matter& matter);

}  // namespace nephele

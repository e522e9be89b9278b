#pragma once

#include <memory>
#include <string>
#include <vector>

#include "nephele/levelset/flow/flow_map.h"
#include "nephele/levelset/io/vdb_io.h"

/// The files of advection: grids that are carried together, maps, velocities.
namespace nephele {

/// The grids of a file that can be carried along, as bricks: one for a scalar grid, three for a vector grid.
struct CarriedGrids {
  std::vector<std::shared_ptr<const BrickGrid>> bricks;
  /// What the bricks were made of, in order.
  std::vector<VdbGrid> originals;
  /// Grids that cannot be carried (integers, bools, points), as "indexGrid (int32)".
  std::vector<std::string> leftOut;
  /// Around all active voxels, world units; empty if there are none.
  Box box;
};

/// @throws Error naming the grid if values or a transform are not usable, or two have one name.
CarriedGrids carriedGrids(const std::vector<VdbGrid>& grids);

/// `bricks` as the grids of a file again, in the order of `like.bricks`: with the names, classes, types
/// (double becomes float) and metadata of the originals.
std::vector<VdbGrid> toVdb(const CarriedGrids& like,
                           const std::vector<std::shared_ptr<const BrickGrid>>& bricks);

/// A map as the grids of a file: `displacement` (X - x, what readFlowMap reads) and `rest` (X, for textures
/// that travel with the matter).
std::vector<VdbGrid> toVdb(const FlowMap& map);

/// The map in a file that was written from `toVdb(map)`: the same bit for bit.
/// @throws Error naming the path and what it holds instead.
FlowMap readFlowMap(const std::string& path);

/// A velocity grid as a field, trilinear, 0 outside (the grid's background, to be exact): the one called
/// `name`, else `v`, `vel` or `velocity`, else the only vector grid. Staggered grids stand on the faces of
/// their voxels. @throws Error naming the path and the grids that are there, with their types.
VectorField readVelocity(const std::string& path, const std::string& name = {});

}  // namespace nephele

#pragma once

#include <array>
#include <cstdint>

#include "nephele/levelset/grid/detail/assembled_bricks.h"
#include "nephele/modeling/field/field_node.h"

/// What the kernels of grids and their plain loops share.
namespace nephele::detail {

constexpr int kRow = BrickGrid::kWidth;
constexpr int kPlane = kRow * kRow;

/// Offset of the row at (y - 1 + j, z - 1 + k) from a cell's first stored sample (x - 1, y - 1, z - 1).
constexpr int rowOffset(int j, int k) {
  return k * kPlane + j * kRow;
}

/// The stored sample at a cell's corner, counted from the one before it.
constexpr int kCorner = rowOffset(1, 1) + 1;

/// What locating a point needs, taken out of the grid once per block.
struct GridMap {
  std::array<float, 9> linear;
  std::array<float, 3> translation, low, high;
  std::array<int, 3> first;
  int countX, countY;
  /// No rotation or shear: each index coordinate depends on one world coordinate.
  bool diagonal;
  const std::int32_t* table;
  const float* values;
  /// The grid, if it is packed, and where its bricks are put together.
  const PackedGrid* packed;
  AssembledBricks* bricks;
};

/// Which samples of a cell are read, of 0 to 3 along each axis.
struct CellPart {
  int begin, count;
};
constexpr CellPart kNearestPart{1, 1}, kLinearPart{1, 2}, kWholeCell{0, 4};

GridMap mapOf(const GridView& grid);

/// A map by which the cell of a point is that of its nearest voxel.
GridMap nearestMapOf(const GridView& grid);

/// Writes the background, and gradients of 0, if the grid has no bricks, and says whether it has none.
bool fillIfEmpty(const GridView& grid, const PointBlock& points, float* values, const BlockLanes<3>* grads);

}  // namespace nephele::detail

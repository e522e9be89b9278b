#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "nephele/levelset/grid/brick_grid.h"

/// The cells of a lattice as tetrahedra: each is six about its diagonal (Kuhn), the same across all faces of
/// cells.
namespace nephele::detail {

/// Samples of a brick's cells, along one axis, and those with one more around them.
inline constexpr int kCellSide = BrickGrid::kBrick + 1, kRingSide = BrickGrid::kBrick + 3;
inline constexpr std::size_t kCellSamples = kCellSide * kCellSide * kCellSide;
inline constexpr std::size_t kRingSamples = kRingSide * kRingSide * kRingSide;

/// Offset of a cell's corner: one bit per axis.
constexpr Vec3i cornerOffset(unsigned corner) {
  return {int(corner & 1), int(corner >> 1 & 1), int(corner >> 2)};
}
constexpr int ringIndex(int x, int y, int z) {
  return ((z + 1) * kRingSide + y + 1) * kRingSide + x + 1;
}
constexpr int sampleIndex(const Vec3i& sample) {
  return (sample.z * kCellSide + sample.y) * kCellSide + sample.x;
}
constexpr int ringStep(unsigned corner) {
  const Vec3i o = cornerOffset(corner);
  return (o.z * kRingSide + o.y) * kRingSide + o.x;
}

/// The neighbours of a sample along edges of tetrahedra: 0 to 6 forward by the corner i + 1, 7 to 13 back.
inline constexpr std::array<int, 14> kEdgeSteps = [] {
  std::array<int, 14> steps{};
  for (unsigned i = 0; i < 7; ++i) {
    steps[i] = ringStep(i + 1);
    steps[i + 7] = -ringStep(i + 1);
  }
  return steps;
}();

/// Which neighbours of a sample are neighbours of each other, a bit each.
const std::array<std::uint16_t, 14>& neighboursOfNeighbours();

/// Whether the surface about a sample of 0 is a disc that stays one where all such samples become vertices:
/// positive samples around it hang together, the others do, and no edge or triangle of samples of 0 has more
/// surface at it than two faces. A bit for each neighbour.
bool isDisc(unsigned positive, unsigned zero);

/// The samples of the level set about a brick, read from the bricks to which they belong: bricks of one value
/// are shared and have no border of their own.
void gather(const BrickGrid& level, const Vec3i& brick, std::array<float, kRingSamples>& samples);

}  // namespace nephele::detail

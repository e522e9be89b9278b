#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "nephele/levelset/grid/voxel_grid.h"

namespace nephele::detail {

/// Blocks of 8^3 samples and constants in a box of bricks, wherever their values are kept: what a BrickGrid
/// is gathered from.
struct BlockTable {
  /// How the samples of blocks follow each other.
  enum class Order { xFastest, zFastest };

  /// For each brick: n > 0 is blocks[n - 1], else constants[-n].
  FlatBrickTable codes;
  /// The first is the background, which is also what stands beyond the box.
  std::vector<float> constants;
  std::vector<const float*> blocks;
  Order order = Order::xFastest;
  /// Multiplies all values.
  float sign = 1.0f;

  float constant(std::int32_t code) const { return constants[std::size_t(-code)]; }
  const float* block(std::int32_t code) const { return blocks[std::size_t(code) - 1]; }
};

/// @throws Error, naming the grid, if one of the samples is not finite.
void requireFinite(const float* samples, int count, const std::string& name);

/// Bricks with borders, whose samples `made` takes if it is there. Uses all cores; the result does not depend
/// on their number.
/// @throws Error, naming the grid, if a value is not finite or there are more bricks than can be numbered.
std::shared_ptr<BrickGrid> gatherBricks(const BlockTable& blocks, const Lattice& lattice, Beside beside,
                                        const std::string& name, const BrickSink& made = {});

}  // namespace nephele::detail

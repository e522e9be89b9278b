#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/render/volume/coded_bricks.h"

namespace nephele {

/// What a march needs to know of a brick beside its codes, all from its samples.
struct BrickMeasures {
  /// Sums over its voxels, what is below 0 counting as 0.
  double density = 0, squares = 0;
  /// First and last of the nodes 0 to 8 above 0 along every axis; the first lies behind the last if there are
  /// none.
  std::array<std::int8_t, 3> first{9, 9, 9}, last{-1, -1, -1};

  static BrickMeasures of(const float* brick);
};

/// A density that is coded brick by brick while it is read, so that its samples are never held all at once.
class CodedDensity {
 public:
  /// Room for a pool of so many bricks. @throws Error as CodedBricks.
  void begin(std::size_t bricks);
  /// Codes the kVolume samples of a brick; see BrickSink.
  void take(std::int32_t pool, const float* samples);
  /// All of this as such.
  BrickSink sink();

  const std::vector<BrickMeasures>& measures() const { return measures_; }
  /// Those of a grid all of whose bricks were taken; only once.
  CodedBricks codes(const BrickGrid& grid);

 private:
  CodedBricks codes_;
  std::vector<BrickMeasures> measures_;
};

}  // namespace nephele

#pragma once

#include <array>
#include <cstdint>

#include "nephele/levelset/grid/brick_mask.h"

namespace nephele::detail {

/// The corners of the cells of a brick: its own 8^3 samples and the first ones of the bricks after it.
struct BrickCells {
  static constexpr int kSide = 9;

  /// Samples of the bricks after this one by i & 1, i >> 1 & 1, i >> 2, x fastest.
  std::array<const float*, 8> samples{};
  /// Bit x of inside[rowOf(y, z)]: the sample is above 0. Rows past the last one are empty.
  std::array<std::uint16_t, kSide * kSide + 16> inside{};

  static constexpr std::size_t rowOf(int y, int z) { return std::size_t(z * kSide + y); }

  float valueAt(int x, int y, int z) const {
    return samples[std::size_t(x >> 3 | (y >> 3) << 1 | (z >> 3) << 2)]
                  [std::size_t((z & 7) << 6 | (y & 7) << 3 | (x & 7))];
  }
  /// Sets `inside`, from the samples above 0 of each of the bricks.
  void setInside(const std::array<BrickMask, 8>& bricks);
  /// Which cells have corners on both sides.
  BrickMask mixed() const;
};

/// The brick's share of the volume that the marching cubes mesh of a grid encloses, voxels cubed: the flux of
/// (x, 0, 0) through its triangles, x from the grid's origin. Sums over all bricks, not alone, are volumes.
/// Values are read at the ends of crossed edges and at the corners of ambiguous faces only. `first` is the
/// brick's first sample.
double volumeShare(const BrickCells& cells, const BrickMask& mixed, const Vec3i& first);

}  // namespace nephele::detail

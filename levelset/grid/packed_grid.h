#pragma once

#include <cstdint>
#include <vector>

#include "nephele/levelset/grid/brick_grid.h"

namespace nephele {

/// A BrickGrid that will only be sampled, in half the memory: every sample is 16 bits between the least and
/// the largest of its brick, off by at most 1/131070 of their distance; bricks of one value stay exact. Both
/// forms of a border sample are rounded within their own brick, so values jump by as much from brick to
/// brick.
class PackedGrid : public BrickLayout {
 public:
  /// How the codes of a brick become values: low + unit * code.
  struct Code {
    static constexpr float kLargest = 65535.0f;
    float low, unit;

    static constexpr Code of(const Interval& range) {
      return {range.min, (range.max - range.min) / kLargest};
    }
  };

  /// The background everywhere.
  PackedGrid(const Lattice& lattice, const BrickBox& places, float background);
  /// Gives the memory of `grid` back while it works. All cores; the result does not depend on their number.
  /// @throws Error if a sample is not finite.
  explicit PackedGrid(BrickGrid grid);

  /// As those of BrickGrid; the codes of new bricks are 0.
  void reserve(std::size_t bricks);
  std::int32_t append(std::size_t bricks);
  /// kVolume codes, in the order of samples.
  const std::uint16_t* codes(std::int32_t pool) const { return codes_.data() + std::size_t(pool) * kVolume; }
  /// Encodes kVolume samples, which lie in `range`, as those of a brick. @throws Error if it is not finite.
  void encode(std::int32_t pool, const float* samples, const Interval& range);
  /// As those of BrickGrid.
  float at(const Vec3i& voxel) const;
  std::size_t memoryBytes() const;

 private:
  std::vector<std::uint16_t> codes_;
};

/// A grid to be sampled, packed or not, which must outlive it.
struct GridView {
  GridView(const BrickGrid& grid) : layout(&grid), values(grid.brick(0)) {}
  GridView(const PackedGrid& grid) : layout(&grid), codes(grid.codes(0)) {}

  const BrickLayout* layout;
  const float* values = nullptr;
  const std::uint16_t* codes = nullptr;
};

}  // namespace nephele

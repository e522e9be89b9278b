#pragma once

#include <cstdint>
#include <vector>

#include "nephele/levelset/grid/brick_grid.h"

namespace nephele {

/// A grid that will only be sampled, in a fifth of the memory of a BrickGrid: bricks hold their own samples
/// alone, and the borders that interpolation reads are those of their neighbours when they are asked for.
/// Every sample is 16 bits between the least and the largest that its brick or its border holds, off by at
/// most 1/131070 of their distance; bricks of one value are exact, and so are their borders.
class PackedGrid : public BrickLayout {
 public:
  /// How the codes of a brick become values: low + unit * code.
  struct Code {
    static constexpr float kLargest = 65535.0f;
    float low, unit;

    float value(std::uint16_t code) const { return low + unit * float(code); }
    static constexpr Code of(const Interval& range) {
      return {range.min, (range.max - range.min) / kLargest};
    }
  };

  /// The background everywhere.
  PackedGrid(const Lattice& lattice, const BrickBox& places, float background);
  /// Gives the memory of `grid` back while it works. The borders of bricks must be what fillBorders makes of
  /// them. All cores; the result does not depend on their number.
  /// @throws Error if a sample is not finite.
  explicit PackedGrid(BrickGrid grid);

  /// As those of BrickGrid; the codes of new bricks are 0.
  void reserve(std::size_t bricks);
  std::int32_t append(std::size_t bricks);
  /// kBrickSamples codes, x fastest.
  const std::uint16_t* codes(std::int32_t pool) const {
    return codes_.data() + std::size_t(pool) * kBrickSamples;
  }
  /// Encodes kBrickSamples samples, x fastest, as those of a brick. They and its border lie in `range`. Of a
  /// brick without signs the absolute values are interpolated, of its border, too, while its neighbours see
  /// the signs. @throws Error if the range is not finite.
  void encode(std::int32_t pool, const float* samples, const Interval& range, bool isSignless = false);
  /// As those of BrickGrid.
  float at(const Vec3i& voxel) const;
  std::size_t memoryBytes() const;

  /// Writes the kVolume samples of the brick at a place of the table, with its border.
  void assemble(std::size_t place, float* samples) const;
  /// Writes those samples of the cell that begins at the stored sample `first` of that brick whose
  /// coordinates are `begin` to `begin + count - 1`, of 0 to 3, along each axis: to where they lie in a
  /// brick, counted from the cell's first.
  void assembleCell(std::size_t place, int first, int begin, int count, float* samples) const;
  /// Differs from that of any grid with other bricks.
  std::uint32_t serial() const { return serial_; }

 private:
  std::vector<std::uint16_t> codes_;
  std::vector<std::uint8_t> signless_;
  std::uint32_t serial_;
};

/// A grid to be sampled, packed or not, which must outlive it.
struct GridView {
  GridView(const BrickGrid& grid) : layout(&grid), values(grid.brick(0)) {}
  GridView(const PackedGrid& grid) : layout(&grid), packed(&grid) {}

  const BrickLayout* layout;
  const float* values = nullptr;
  const PackedGrid* packed = nullptr;
};

}  // namespace nephele

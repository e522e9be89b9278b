#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "nephele/levelset/grid/voxel_grid.h"

namespace nephele {

/// The voxels of a level set that is clamped, bit for bit, in the memory of those between its two ends: a
/// voxel at either end takes two bits. For grids that are kept and seldom read.
class NarrowBand {
 public:
  /// `grid` is given back while it is taken over. Values beyond `least` and `greatest` are held as they are.
  /// All cores.
  NarrowBand(VoxelGrid<float> grid, float least, float greatest);

  /// For grids that are made bit by bit: the grid, to which bricks may be added, and those that `takeOver`
  /// took are not in it any more.
  VoxelGrid<float>& unfinished() { return grid_; }
  /// Takes over most bricks that were added; all of them with `isFinished`, after which there must be no
  /// more.
  void takeOver(bool isFinished);

  /// As those of VoxelGrid.
  double voxelSize() const { return grid_.voxelSize(); }
  float background() const { return grid_.background(); }
  std::int32_t entryAt(const Vec3i& brick) const { return grid_.entryAt(brick); }
  const std::vector<float>& constants() const { return grid_.constants(); }
  template <class Visit>
  void forEachBrick(const Visit& visit) const {
    grid_.forEachBrick(visit);
  }
  /// Writes the kBrickSamples values of what stands for a brick, a constant, too; x fastest.
  void read(std::int32_t entry, float* samples) const;
  /// The grid that it was.
  VoxelGrid<float> voxels() const;
  /// Bytes held.
  std::size_t memoryBytes() const;

 private:
  struct Brick {
    /// A bit for each voxel, a word for each layer of z.
    std::array<std::uint64_t, kBrickSide> isBetween{}, isGreatest{};
    /// Where its values between the ends begin among those of its part.
    std::uint32_t first = 0;
  };

  void take(std::size_t first, std::size_t last);

  // Its samples have been given back.
  VoxelGrid<float> grid_;
  float least_, greatest_;
  /// Of those that were taken over.
  std::vector<Brick> bricks_;
  // Of VoxelGrid::kTogether bricks each.
  std::vector<std::vector<float>> parts_;
};

}  // namespace nephele

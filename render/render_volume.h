#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "levelset/brick_grid.h"
#include "modeling/box.h"

namespace nephele {

/// A density that is ready to be marched: bricks, which of them hold anything, and how far it is to the next
/// that does.
///
/// Densities are per world unit and multiply the extinction of a Medium. Values below zero count as zero.
class RenderVolume {
 public:
  /// Keeps a reference to `density`. Cost: one pass over the brick table, none over the samples.
  /// @throws Error if the background is not 0, a value is not finite, or the bricks are too many to index
  /// (1.6 million distinct ones, 8.5 GB).
  explicit RenderVolume(std::shared_ptr<const BrickGrid> density);

  const BrickGrid& density() const { return *density_; }
  /// True where nothing in the volume is above zero.
  bool isEmpty() const { return occupied_.empty(); }
  float maxDensity() const { return maxDensity_; }
  /// Mean density weighted by itself: what light meets where it meets anything. 0 for an empty volume.
  /// Cost: one pass over the samples.
  float typicalDensity() const;

  /// Brick coordinates of the bricks that hold density, in the table's order.
  const std::vector<Vec3i>& occupiedBricks() const { return occupied_; }
  /// Distance in bricks (largest of the three axes) from every entry of the brick table to the nearest brick
  /// that holds density: 0 in one, saturating at 32. A ray may leave the box of radius distance - 1 around an
  /// entry unseen.
  std::span<const std::uint8_t> emptiness() const { return emptiness_; }

  /// Box of the bricks that hold density, in voxels.
  const Box& indexBounds() const { return indexBounds_; }
  /// World box of the voxels above zero, grown by one voxel. Empty for an empty volume.
  const Box& worldBounds() const { return worldBounds_; }
  /// World-space corners of the voxels above zero, brick by brick; their hull contains all density.
  const std::vector<Vec3f>& outline() const { return outline_; }
  std::size_t memoryBytes() const;

 private:
  void findOccupied();
  void measureEmptiness();
  void measureBounds();

  std::shared_ptr<const BrickGrid> density_;
  std::vector<Vec3i> occupied_;
  std::vector<std::uint8_t> emptiness_;
  std::vector<Vec3f> outline_;
  Box indexBounds_, worldBounds_;
  float maxDensity_ = 0.0f;
};

}  // namespace nephele

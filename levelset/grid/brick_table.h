#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nephele/levelset/grid/brick_box.h"
#include "nephele/modeling/base/box.h"

namespace nephele {

/// What every sparse grid can hold, and so what each way of making one accepts: bricks are numbered by 31
/// bits, and so are the places of a box.
inline constexpr double kMostBricks = 2147483647.0;
/// Coordinates of voxels go so far from 0.
inline constexpr double kLargestIndex = 1e9;

/// @throws Error, which begins with `maker`, if a box of so many bricks along each axis has too many places.
void requireHoldable(const std::string& maker, double bricksX, double bricksY, double bricksZ);
inline void requireHoldable(const std::string& maker, const BrickBox& box) {
  requireHoldable(maker, box.count.x, box.count.y, box.count.z);
}
/// The same for the voxels of this size in a box in the world; they must lie within kLargestIndex, too.
void requireHoldable(const std::string& maker, const Box& box, float voxelSize);

}  // namespace nephele

namespace nephele::detail {

/// A number for each of some bricks, wherever they lie.
///
/// Two levels: cubes of 8^3 bricks, of which those that hold something have a number for every brick, and a
/// directory of all cubes in a box, which grows. So memory follows the bricks that are there, and 1/64 byte
/// is what each other place of the box costs. Look-ups take two steps: grids that are sampled have a flat
/// table instead.
class BrickTable {
 public:
  static constexpr std::int32_t kNone = -1;

  /// `maker` begins the messages of errors.
  explicit BrickTable(std::string maker) : maker_(std::move(maker)), numbers_(kPlaces, kNone) {}

  /// The number of `brick`, or kNone.
  std::int32_t at(const Vec3i& brick) const { return numbers_[placeOf(brick)]; }
  /// @throws Error if the box of all bricks becomes too large to hold.
  void set(const Vec3i& brick, std::int32_t number) {
    include(brick);
    numbers_[placeOf(brick)] = number;
  }
  bool isEmpty() const { return origins_.empty(); }
  /// Bytes held.
  std::size_t memoryBytes() const;

  /// Makes places for a brick and those of its cube. @throws Error as above.
  void include(const Vec3i& brick);
  /// The place of a brick, for values beside the numbers; less than kPlaces where it has none. Places are
  /// numbered as they are made, and stay.
  std::size_t placeOf(const Vec3i& brick) const {
    const Vec3i cube = cubeOf(brick);
    return (cubes_.covers(cube) ? directory_[cubes_.numberOf(cube)] * kPlaces : 0) + insideCube(brick);
  }
  std::size_t placeCount() const { return numbers_.size(); }
  /// The number at a place.
  std::int32_t& operator[](std::size_t place) { return numbers_[place]; }
  std::int32_t operator[](std::size_t place) const { return numbers_[place]; }
  /// The brick of a place, the first kPlaces being no brick's.
  Vec3i brickAt(std::size_t place) const;
  static constexpr std::size_t kPlaces = 512;

  /// A box that covers all bricks that have places.
  BrickBox bricks() const;

 private:
  static constexpr Vec3i cubeOf(const Vec3i& brick) { return {brick.x >> 3, brick.y >> 3, brick.z >> 3}; }
  static constexpr std::size_t insideCube(const Vec3i& brick) {
    return std::size_t((brick.z & 7) << 6 | (brick.y & 7) << 3 | (brick.x & 7));
  }

  std::string maker_;
  BrickBox cubes_;
  /// Of each cube, the number of its block of places; 0 for the block of those that have none.
  std::vector<std::size_t> directory_;
  std::vector<std::int32_t> numbers_;
  /// The first brick of every block of places but the first.
  std::vector<Vec3i> origins_;
};

}  // namespace nephele::detail

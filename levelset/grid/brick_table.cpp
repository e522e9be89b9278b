#include "nephele/levelset/grid/brick_table.h"

#include <fmt/format.h>

#include <algorithm>

#include "nephele/modeling/base/error.h"

namespace nephele {

void requireHoldable(const std::string& maker, double bricksX, double bricksY, double bricksZ) {
  require(bricksX * bricksY * bricksZ < kMostBricks,
          fmt::format("{}: {:.0f} x {:.0f} x {:.0f} voxels are more than can be held; use larger voxels",
                      maker, bricksX * kBrickSide, bricksY * kBrickSide, bricksZ * kBrickSide));
}

void requireHoldable(const std::string& maker, const Box& box, float voxelSize) {
  const Vec3d bricks = Vec3d(box.size()) / double(voxelSize * kBrickSide) + Vec3d{2, 2, 2};
  requireHoldable(maker, bricks.x, bricks.y, bricks.z);
  require(double(length(max(box.max, -box.min))) / double(voxelSize) < kLargestIndex,
          fmt::format("{}: the shape lies too far from the origin for voxels of {:g}; use larger voxels",
                      maker, voxelSize));
}

}  // namespace nephele

namespace nephele::detail {

namespace {

constexpr int kCube = 8;
/// Cubes added on every side when the directory grows, so that it grows rarely.
constexpr int kGrowth = 1;

}  // namespace

void BrickTable::include(const Vec3i& brick) {
  const Vec3i cube = cubeOf(brick);
  if (!cubes_.covers(cube)) {
    const Vec3i margin{kGrowth, kGrowth, kGrowth}, one{1, 1, 1};
    const Vec3i first = isEmpty() ? cube - margin : min(cubes_.first, cube - margin);
    const Vec3i last = isEmpty() ? cube + margin : max(cubes_.first + cubes_.count - one, cube + margin);
    const BrickBox larger{first, last - first + one};
    requireHoldable(maker_, double(kCube) * larger.count.x, double(kCube) * larger.count.y,
                    double(kCube) * larger.count.z);
    std::vector<std::size_t> directory(larger.size(), 0);
    for (int z = cubes_.first.z; z < (cubes_.first + cubes_.count).z; ++z)
      for (int y = cubes_.first.y; y < (cubes_.first + cubes_.count).y; ++y) {
        const Vec3i row{cubes_.first.x, y, z};
        std::copy_n(directory_.begin() + std::ptrdiff_t(cubes_.numberOf(row)), cubes_.count.x,
                    directory.begin() + std::ptrdiff_t(larger.numberOf(row)));
      }
    cubes_ = larger;
    directory_ = std::move(directory);
  }
  std::size_t& block = directory_[cubes_.numberOf(cube)];
  if (block != 0) return;
  origins_.push_back(cube * kCube);
  block = origins_.size();
  numbers_.resize(numbers_.size() + kPlaces, kNone);
}

Vec3i BrickTable::brickAt(std::size_t place) const {
  const int i = int(place % kPlaces);
  return origins_[place / kPlaces - 1] + Vec3i{i & 7, i >> 3 & 7, i >> 6};
}

BrickBox BrickTable::bricks() const {
  return {cubes_.first * kCube, cubes_.count * kCube};
}

std::size_t BrickTable::memoryBytes() const {
  return directory_.capacity() * sizeof(std::size_t) + numbers_.capacity() * sizeof(std::int32_t) +
         origins_.capacity() * sizeof(Vec3i);
}

}  // namespace nephele::detail

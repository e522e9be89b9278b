#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/grid/brick_table.h"
#include "nephele/levelset/grid/packed_grid.h"
#include "nephele/modeling/base/system.h"

/// Sparse grids while they are made: bricks without the borders that interpolation reads. For the
/// implementation of bakes.
namespace nephele::detail {

/// Floats in pages of their own, which go back to the system at once when they are given up.
class SampleStore {
 public:
  SampleStore() = default;
  explicit SampleStore(std::size_t count) : bytes_(count * sizeof(float)) {
    if (count == 0) return;
    data_ = static_cast<float*>(newPages(bytes_));
  }
  SampleStore(SampleStore&& other) noexcept { swap(other); }
  SampleStore& operator=(SampleStore&& other) noexcept {
    SampleStore taken(std::move(other));
    swap(taken);
    return *this;
  }
  ~SampleStore() {
    if (data_) freePages(data_, bytes_);
  }

  float* data() const { return data_; }
  bool contains(const float* p) const { return p >= data_ && p < data_ + bytes_ / sizeof(float); }

 private:
  void swap(SampleStore& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(bytes_, other.bytes_);
  }

  float* data_ = nullptr;
  std::size_t bytes_ = 0;
};

/// What a BrickGrid is made from: the same table, and of every brick in the pool its own 8^3 samples, two
/// fifths of what it stores with borders.
struct BrickSamples {
  static constexpr int kCount = kBrickSamples;
  /// The samples of some bricks, none of which lies above `lastZ`.
  struct Store {
    SampleStore samples;
    int lastZ;
  };

  float voxelSize = 1.0f;
  float background = 0.0f;
  /// Indices into the pool. Pool brick 0 is all background.
  FlatBrickTable table;
  /// kCount samples of each, x fastest. Bricks of nothing but the background may share those of brick 0.
  std::vector<float*> pool;
  /// Whether others have samples of this, too, so that they must not be written to.
  bool areShared = false;
  /// Of those samples.
  std::vector<Interval> ranges;
  /// The bricks that stand at a position of their own, the last of the pool; the others are constants.
  std::vector<PlacedBrick> placed;
  std::vector<Store> stores;

  /// The box of all positions.
  const BrickBox& places() const { return table.box; }
  /// Where sample (x, y, z) of a brick stands among its samples; coordinates 0 to 7.
  static constexpr int offset(int x, int y, int z) {
    return (z * BrickGrid::kBrick + y) * BrickGrid::kBrick + x;
  }

  /// Appends bricks whose samples are yet to be written, in one store, at the end of the pool.
  void append(const std::vector<Vec3i>& bricks);
  /// Appends a brick whose samples are those of others, which must outlive it.
  void appendShared(const Vec3i& brick, float* samples, const Interval& range);
  /// Gives some bricks of the pool samples of their own, the same as before.
  void own(const std::vector<std::size_t>& bricks);
  /// Gives every position but those of pool brick 0 a brick of its own.
  void separate();

 private:
  void place(const Vec3i& brick, float* samples, const Interval& range);
};

/// `bake` up to the samples. Their order is by z first, in steps of 8 bricks.
BrickSamples bakeSamples(const ScalarField& field, const BakeOptions& options,
                         const Progress& progress = silent());

/// A packed grid with the layout of `samples` and without bricks other than the background.
std::shared_ptr<PackedGrid> emptyPackedGrid(const BrickSamples& samples);

/// What becomes of a brick when it is packed.
enum class Packing : std::uint8_t {
  leaveOut,
  whole,
  absolute  ///< Of all samples that the brick stores, the absolute value.
};

/// The bricks around a brick, itself among them, 0 to 26: from where it stands.
constexpr Vec3i neighbour(int number) {
  return {number % 3 - 1, number / 3 % 3 - 1, number / 9 - 1};
}
/// A bit for each of them that points less than a voxel from a sample of the brick are interpolated from.
std::uint32_t neighboursReadAround(int sample);

/// Appends bricks of `samples` with their borders to a packed grid whose table covers theirs; `packing` has
/// an entry for every pool brick. The stores are given back while it works, from below in z. Uses all cores.
/// @throws Error if a sample is not finite.
void appendPacked(PackedGrid& grid, BrickSamples samples, const std::vector<Packing>& packing);

/// The grid of these samples.
std::shared_ptr<PackedGrid> packed(BrickSamples samples);

}  // namespace nephele::detail

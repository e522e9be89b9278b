#pragma once

#include <string>
#include <vector>

#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/levelset/grid/lattice.h"
#include "nephele/levelset/grid/sparse_bricks.h"

namespace nephele {

/// Values of voxels wherever they lie, each held once: the form in which grids are made and written. The form
/// to interpolate, with borders, is BrickGrid; see `toBricks`.
///
/// Bricks of 8^3 voxels hold a value of each voxel, x fastest, or one constant; what was not set is
/// `background()`. Values have the sign and the units of the library: level sets are positive inside. Memory
/// follows the bricks that hold samples. It moves and is not copied.
template <class Value>
class VoxelGrid {
 public:
  /// Voxel (i, j, k) stands at (i, j, k) * voxelSize. `maker` begins the messages of errors.
  VoxelGrid(const std::string& maker, double voxelSize, const Value& background)
      : bricks_(maker),
        lattice_(Lattice::uniform(float(voxelSize))),
        voxelSize_(voxelSize),
        constants_{background} {}
  VoxelGrid(const std::string& maker, const Lattice& lattice, const Value& background)
      : bricks_(maker), lattice_(lattice), voxelSize_(double(lattice.voxelSize)), constants_{background} {}

  const Lattice& lattice() const { return lattice_; }
  /// Edge of a voxel, world units.
  double voxelSize() const { return voxelSize_; }
  const Value& background() const { return constants_.front(); }

  /// Gives a brick samples, which are not set, and returns their place, which stays. The brick must have
  /// none.
  /// @throws Error if the box of all bricks becomes too large to hold.
  Value* add(const Vec3i& brick) { return bricks_.samples(bricks_.add(brick)); }
  /// Makes a brick constant. Samples that it had are held on to. @throws Error as `add`.
  void setConstant(const Vec3i& brick, const Value& value) {
    if (!(constants_[lastConstant_] == value)) {
      lastConstant_ = value == constants_.front() ? 0 : constants_.size();
      if (lastConstant_ != 0) constants_.push_back(value);
    }
    bricks_.table().set(brick, -1 - std::int32_t(lastConstant_));
  }

  /// What stands for a brick: its number, which is at least 0, if it holds samples, and else -1 - c, c being
  /// the constant that it is.
  std::int32_t entryAt(const Vec3i& brick) const { return bricks_.table().at(brick); }
  /// Of a number. They count up in the order in which bricks were added.
  const Value* samples(std::int32_t number) const { return bricks_.samples(number); }
  Value* samples(std::int32_t number) { return bricks_.samples(number); }
  /// The constants; the first is the background.
  const std::vector<Value>& constants() const { return constants_; }
  /// Bricks that were given samples.
  std::size_t sampledBricks() const { return bricks_.count(); }
  /// A box that covers all bricks that were set.
  BrickBox box() const { return bricks_.table().bricks(); }
  /// visit(brick, entry) for all bricks that were set, in an order that depends on nothing but the order in
  /// which they were.
  template <class Visit>
  void forEachBrick(const Visit& visit) const {
    const detail::BrickTable& table = bricks_.table();
    for (std::size_t place = detail::BrickTable::kPlaces; place < table.placeCount(); ++place)
      if (const std::int32_t entry = table[place]; entry != detail::BrickTable::kNone)
        visit(table.brickAt(place), entry);
  }

  /// The value of a voxel.
  const Value& at(const Vec3i& voxel) const {
    const std::int32_t entry = entryAt(brickOf(voxel));
    if (entry < 0) return constants_[std::size_t(-1 - entry)];
    return samples(entry)[(insideBrick(voxel.z) * kBrickSide + insideBrick(voxel.y)) * kBrickSide +
                          insideBrick(voxel.x)];
  }
  /// Bytes held.
  std::size_t memoryBytes() const { return bricks_.memoryBytes() + constants_.capacity() * sizeof(Value); }

  /// Bricks whose samples are given back together.
  static constexpr std::size_t kTogether = detail::SparseBricks<Value>::kTogether;
  /// Gives back the samples of the numbers [first, last), both multiples of kTogether or the end: they must
  /// not be asked for again. For those who turn a grid into another form and have no room for both.
  void releaseSamples(std::size_t first, std::size_t last) { bricks_.release(first, last); }

 private:
  detail::SparseBricks<Value> bricks_;
  Lattice lattice_;
  double voxelSize_;
  std::vector<Value> constants_;
  std::size_t lastConstant_ = 0;
};

/// What a constant brick of a VoxelGrid becomes where its borders reach into other bricks.
enum class Beside {
  varying,   ///< It gets samples, so that values between the two are interpolated.
  constant,  ///< It stays constant: for grids that hold all bricks that matter, in less memory.
};

/// The values of `grid`, ready to be interpolated: 2.6 times the memory of its samples, unless `made` takes
/// them. All cores.
/// @throws Error if the box of its bricks is too large to hold.
std::shared_ptr<BrickGrid> toBricks(const VoxelGrid<float>& grid, Beside beside = Beside::varying,
                                    const BrickSink& made = {});

/// The voxels of bricks: the way back.
VoxelGrid<float> toVoxels(const BrickGrid& bricks);

}  // namespace nephele

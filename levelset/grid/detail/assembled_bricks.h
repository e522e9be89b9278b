#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "nephele/levelset/grid/packed_grid.h"

namespace nephele::detail {

/// Bricks of packed grids as floats with their borders, which are what is interpolated: put together where
/// several points lie in them, and kept for those that follow. For one thread.
class AssembledBricks {
 public:
  static AssembledBricks& local();

  /// How many other bricks and cells may be asked for until the samples of one may be gone.
  static constexpr std::uint64_t kLasting = 48;

  /// The kVolume samples of the brick at a place of the table, for the next `points` points; null if it is
  /// not there and not worth it, as points are few and none lay in it just before.
  const float* find(const PackedGrid& grid, std::size_t place, int points) {
    const std::uint64_t key = std::uint64_t(grid.serial()) << 32 | place;
    const std::size_t entry = entryOf(key);
    asked_ += std::uint64_t(points);
    if (const Entry& e = made_[entry]; e.key == key && makes_ - e.at < kBricks - kLasting)
      return samples_.data() + e.at % kBricks * PackedGrid::kVolume;
    constexpr int kEnough = 3;
    constexpr std::uint64_t kJustBefore = 128;
    Entry& missed = missed_[entry];
    if (points >= kEnough || (missed.key == key && asked_ - missed.at < kJustBefore))
      return make(grid, place, entry, key);
    missed = {key, asked_};
    return nullptr;
  }

  /// The first of the samples in a cell: see PackedGrid::assembleCell. The others lie where they do in a
  /// brick.
  const float* cell(const PackedGrid& grid, std::size_t place, int first, int begin, int count) {
    float* samples = cells_.data() + ++cellsMade_ % kCells * kCellVolume;
    grid.assembleCell(place, first, begin, count, samples);
    return samples;
  }
  /// The same of a cell that is all background.
  const float* outside(const PackedGrid& grid);

 private:
  /// Some 1.4 MB, about what the caches of a core hold.
  static constexpr std::uint64_t kBricks = 256, kCells = 64;
  static constexpr int kCellVolume = 3 * PackedGrid::kWidth * (PackedGrid::kWidth + 1) + 4;
  static constexpr int kEntryBits = 10;

  /// Bricks are counted as they are made, and overwrite those that were made kBricks before.
  struct Entry {
    std::uint64_t key = ~std::uint64_t(0), at = 0;
  };

  AssembledBricks();
  static std::size_t entryOf(std::uint64_t key) { return key * 0x9e3779b97f4a7c15u >> (64 - kEntryBits); }
  const float* make(const PackedGrid& grid, std::size_t place, std::size_t entry, std::uint64_t key);

  std::vector<float> samples_, cells_;
  std::vector<Entry> made_, missed_;
  std::uint64_t makes_ = 0, cellsMade_ = 0, asked_ = 0;
};

}  // namespace nephele::detail

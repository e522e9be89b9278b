#include "nephele/levelset/grid/detail/assembled_bricks.h"

#include <algorithm>

namespace nephele::detail {

AssembledBricks::AssembledBricks()
    : samples_(kBricks * PackedGrid::kVolume),
      cells_(kCells * kCellVolume),
      made_(std::size_t(1) << kEntryBits),
      missed_(std::size_t(1) << kEntryBits) {}

AssembledBricks& AssembledBricks::local() {
  static thread_local AssembledBricks bricks;
  return bricks;
}

const float* AssembledBricks::make(const PackedGrid& grid, std::size_t place, std::size_t entry,
                                   std::uint64_t key) {
  const std::uint64_t at = ++makes_;
  float* samples = samples_.data() + at % kBricks * PackedGrid::kVolume;
  grid.assemble(place, samples);
  made_[entry] = {key, at};
  return samples;
}

const float* AssembledBricks::outside(const PackedGrid& grid) {
  float* samples = cells_.data() + ++cellsMade_ % kCells * kCellVolume;
  std::fill_n(samples, kCellVolume, grid.background());
  return samples;
}

}  // namespace nephele::detail

#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "nephele/levelset/grid/brick_table.h"

namespace nephele::detail {

/// Samples of bricks wherever they lie, while they are found: what grids are made from. A brick that was not
/// added has no samples; what stands in its place is up to the reader. Bricks are numbered in the order in
/// which they were added, and their samples never move.
template <class Sample>
class SparseBricks {
 public:
  /// Bricks whose samples are allocated at a time.
  static constexpr std::size_t kTogether = 512;

  /// `maker` begins the messages of errors.
  explicit SparseBricks(std::string maker, std::size_t samplesPerBrick = kBrickSamples)
      : table_(std::move(maker)), samplesPerBrick_(samplesPerBrick) {}

  /// Adds a brick that is not there, whose samples are not set, and returns its number.
  /// @throws Error if the box of all bricks becomes too large to hold.
  std::int32_t add(const Vec3i& brick) {
    table_.include(brick);
    return addAt(table_.placeOf(brick));
  }
  /// The same for a place of the table.
  std::int32_t addAt(std::size_t place) {
    if (count_ % kTogether == 0)
      samples_.push_back(std::make_unique_for_overwrite<Sample[]>(kTogether * samplesPerBrick_));
    return table_[place] = std::int32_t(count_++);
  }

  std::size_t count() const { return count_; }
  std::size_t samplesPerBrick() const { return samplesPerBrick_; }
  Sample* samples(std::int32_t number) const {
    return samples_[std::size_t(number) / kTogether].get() +
           std::size_t(number) % kTogether * samplesPerBrick_;
  }
  /// The samples of `brick`; null where there are none.
  Sample* find(const Vec3i& brick) const {
    const std::int32_t number = table_.at(brick);
    return number < 0 ? nullptr : samples(number);
  }
  /// Gives back the samples of the bricks with these numbers, which must not be asked for again. Numbers
  /// begin and end at multiples of kTogether.
  void release(std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; i += kTogether) samples_[i / kTogether].reset();
  }
  BrickTable& table() { return table_; }
  const BrickTable& table() const { return table_; }
  /// Bytes held.
  std::size_t memoryBytes() const {
    const auto held = std::ranges::count_if(samples_, [](const auto& samples) { return bool(samples); });
    return table_.memoryBytes() + std::size_t(held) * kTogether * samplesPerBrick_ * sizeof(Sample);
  }

 private:
  BrickTable table_;
  std::size_t samplesPerBrick_, count_ = 0;
  std::vector<std::unique_ptr<Sample[]>> samples_;
};

}  // namespace nephele::detail

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/modeling/base/math.h"

namespace nephele {

class BrickGrid;

/// Bricks of 9^3 nodes in 16 bits each, as the march reads them: half the bytes of a float, and the eight
/// corners of a cell in two loads of 64 bits.
///
/// A node is (code - kZero) * unit with a unit for every brick, so that it errs by at most half a unit: 1 /
/// 114686 of the brick's largest value, and by less than a unit of the last place in bricks of one value. 0
/// stays 0. Negative values keep a seventh of that scale; where they are larger, the unit grows with them.
/// Values above 1e30 count as 1e30, those of bricks that hold nothing above 1e-30 as 0.
class CodedBricks {
 public:
  static constexpr int kWidth = 9;
  static constexpr int kPlane = kWidth * kWidth;
  static constexpr int kNodes = kPlane * kWidth;
  /// A pair for every node but those of the last plane: its code, and above it that of the next plane's.
  static constexpr int kPairs = kNodes - kPlane;
  static constexpr float kZero = 8192.0f, kLargest = 65535.0f - kZero;

  /// Of one place in the table of bricks: where its pairs begin, and its unit.
  struct Entry {
    std::uint32_t first;
    float unit;
  };

  CodedBricks() = default;

  /// The nodes 0 to 8 of the bricks of a grid. Cost: one pass over its pool, all cores.
  /// @throws Error if the grid has more bricks than can be addressed (5.8 million).
  explicit CodedBricks(const BrickGrid& grid);
  /// The same, and gives the memory of the grid's samples back while it goes through them: they read as 0
  /// from then on. Ranges and layout stay.
  static CodedBricks inPlaceOf(BrickGrid& grid);

  /// Takes the memory of `nodes`, kNodes for every pool brick, and codes them in place.
  /// @throws Error as above.
  CodedBricks(detail::UnsetVector<float> nodes, std::span<const std::int32_t> table);

  bool isEmpty() const { return entries_.empty(); }
  /// Pairs, as the bits of floats.
  const float* pairs() const { return pairs_.get(); }
  /// As many as the table of bricks has.
  const Entry* entries() const { return entries_.data(); }
  /// The value at a node, 0 to 8 on every axis, of the brick at a place in the table. Slow; for tests.
  float at(std::size_t place, const Vec3i& node) const;

  /// Copies share their pairs.
  std::size_t memoryBytes() const {
    return floatCount_ * sizeof(float) + entries_.capacity() * sizeof(Entry);
  }
  /// Those that a grid will take.
  static std::size_t estimateBytes(const BrickGrid& grid);

 private:
  template <class Done>
  CodedBricks(const BrickGrid& grid, const Done& done);
  void enter(std::span<const std::int32_t> table, const std::vector<float>& units, std::size_t stride);

  std::shared_ptr<const float> pairs_;
  std::size_t floatCount_ = 0;
  std::vector<Entry> entries_;
};

}  // namespace nephele

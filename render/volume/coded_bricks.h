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

/// Bricks of 9^3 nodes in 16 bits each, as the march reads them: half the bytes of a float, and two corners
/// of a cell in a load of 32 bits.
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
  static constexpr float kZero = 8192.0f, kLargest = 65535.0f - kZero;

  /// Of one place in the table of bricks: where its nodes begin, first axis fastest, and
  /// its unit.
  struct Entry {
    std::uint32_t first;
    float unit;
  };

  CodedBricks() = default;

  /// Room for a pool of so many bricks, each to be `set` once, and then to be placed by `setTable`.
  /// @throws Error if they are more than can be addressed (5.8 million).
  explicit CodedBricks(std::size_t bricks);
  /// The nodes 0 to 8 of the bricks of a grid. Cost: one pass over its pool, all cores. @throws Error as
  /// above.
  explicit CodedBricks(const BrickGrid& grid);
  /// The same, and gives the memory of the grid's samples back while it goes through them: they read as 0
  /// from then on. Ranges and layout stay.
  static CodedBricks inPlaceOf(BrickGrid& grid);
  /// The same of kNodes for every pool brick, whose memory is given back meanwhile.
  CodedBricks(detail::UnsetVector<float> nodes, std::span<const std::int32_t> table);

  /// Codes kWidth^3 numbers, of which rows begin `row` and planes row^2 apart. From several threads for
  /// different bricks.
  void set(std::int32_t pool, const float* nodes, int row = kWidth);
  /// Gives up all but the first bricks of the pool, which never take memory if they were not set.
  void keepFirst(std::size_t bricks) { units_.resize(bricks); }
  /// Lets bricks stand at places.
  void setTable(std::span<const std::int32_t> table);

  bool isEmpty() const { return entries_.empty(); }
  const std::uint16_t* codes() const { return codes_.get(); }
  /// As many as the table of bricks has.
  const Entry* entries() const { return entries_.data(); }
  /// The value at a node, 0 to 8 on every axis, of the brick at a place in the table. Slow.
  float at(std::size_t place, const Vec3i& node) const {
    const Entry& entry = entries_[place];
    const auto inside = std::size_t((node.z * kWidth + node.y) * kWidth + node.x);
    return (float(codes_.get()[entry.first + inside]) - kZero) * entry.unit;
  }

  /// All kNodes of it.
  void decode(std::size_t place, float* nodes) const {
    const Entry entry = entries_[place];
    const std::uint16_t* codes = codes_.get() + entry.first;
    for (int n = 0; n != kNodes; ++n) nodes[n] = (float(codes[n]) - kZero) * entry.unit;
  }

  /// Copies share their codes.
  std::size_t memoryBytes() const {
    return units_.size() * (kNodes * sizeof(std::uint16_t) + sizeof(float)) +
           entries_.capacity() * sizeof(Entry);
  }
  /// Those that a pool of so many bricks at so many places takes.
  static double estimateBytes(double bricks, double places) {
    return bricks * (kNodes * sizeof(std::uint16_t) + sizeof(float)) + places * sizeof(Entry);
  }

 private:
  template <class NodesOf, class Done>
  void setAll(const std::size_t (&strides)[2], const NodesOf& nodesOf, const Done& done);

  // Made to be set and then shared.
  std::shared_ptr<std::uint16_t[]> codes_;
  std::vector<float> units_;
  std::vector<Entry> entries_;
};

}  // namespace nephele

#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/modeling/base/math.h"

namespace nephele {

class BrickGrid;

/// Bricks of 9^3 nodes in 16 bits each, as the march reads them: about half the bytes of floats, and four
/// corners of a cell in a load of 16 bytes.
///
/// A node is (code - kZero) * unit with a unit for every brick, so that it errs by at most half a unit: 1 /
/// 114686 of the brick's largest value, and by less than a unit of the last place in bricks of one value. 0
/// stays 0. Negative values keep a seventh of that scale; where they are larger, the unit grows with them.
/// Values above 1e30 count as 1e30, those of bricks that hold nothing above 1e-30 as 0.
class CodedBricks {
 public:
  static constexpr int kWidth = 9;
  static constexpr int kNodes = kWidth * kWidth * kWidth;
  /// Codes come in two halves along x, of four cells each, so that rows are short enough for a load to reach
  /// the next one; the nodes between the halves stand in both. Along a row, from row to row and from plane to
  /// plane it is 1, kRow and kPlane codes.
  static constexpr int kHalfCells = 4, kRow = kHalfCells + 1, kPlane = kWidth * kRow, kHalf = kWidth * kPlane,
                       kCodes = 2 * kHalf;
  /// How many codes a load of 16 bytes at a cell may reach behind the last brick.
  static constexpr int kBehind = 8 - (kRow + 2);
  static constexpr float kLeast = -32768.0f, kZero = kLeast + 8192.0f, kMost = 32767.0f,
                         kLargest = kMost - kZero;

  /// Where a node lies behind the first of its brick, and the first node of a cell so that the others lie
  /// behind it in the same half.
  static constexpr int offsetOf(const Vec3i& node) {
    return offsetAlongX(node.x) + node.y * kRow + node.z * kPlane;
  }
  static constexpr int offsetAlongX(int x) { return x < kHalfCells ? x : x - kHalfCells + kHalf; }

  /// Of one place in the table of bricks: where its nodes begin, and its unit.
  struct Entry {
    std::uint32_t first;
    float unit;
  };

  CodedBricks() = default;

  /// Room for a pool of so many bricks, each to be `set` once, and then to be placed by `setTable`.
  /// @throws Error if they are more than can be addressed (5.3 million).
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
  const std::int16_t* codes() const { return codes_.get(); }
  /// As many as the table of bricks has.
  const Entry* entries() const { return entries_.data(); }
  /// The value at a node, 0 to 8 on every axis, of the brick at a place in the table. Slow.
  float at(std::size_t place, const Vec3i& node) const {
    const Entry& entry = entries_[place];
    return (float(codes_.get()[entry.first + std::size_t(offsetOf(node))]) - kZero) * entry.unit;
  }

  /// All kNodes of it, first axis fastest.
  void decode(std::size_t place, float* nodes) const {
    const Entry entry = entries_[place];
    const std::int16_t* codes = codes_.get() + entry.first;
    for (int row = 0; row != kWidth * kWidth; ++row, codes += kRow)
      nodes = std::ranges::copy(rowOf(codes, entry.unit), nodes).out;
  }
  /// A row, the first node of which is the first of `codes`.
  static std::array<float, kWidth> rowOf(const std::int16_t* codes, float unit) {
    std::array<float, kWidth> nodes;
    for (int half = 0; half != 2; ++half)
      for (int x = 0; x != kHalfCells; ++x)
        nodes[std::size_t(half * kHalfCells + x)] = (float(codes[half * kHalf + x]) - kZero) * unit;
    nodes.back() = (float(codes[offsetAlongX(kWidth - 1)]) - kZero) * unit;
    return nodes;
  }

  /// Copies share their codes.
  std::size_t memoryBytes() const {
    return units_.size() * (kCodes * sizeof(std::int16_t) + sizeof(float)) +
           entries_.capacity() * sizeof(Entry);
  }
  /// Those that a pool of so many bricks at so many places takes.
  static double estimateBytes(double bricks, double places) {
    return bricks * (kCodes * sizeof(std::int16_t) + sizeof(float)) + places * sizeof(Entry);
  }

 private:
  template <class NodesOf, class Done>
  void setAll(const std::size_t (&strides)[2], const NodesOf& nodesOf, const Done& done);

  // Made to be set and then shared.
  std::shared_ptr<std::int16_t[]> codes_;
  std::vector<float> units_;
  std::vector<Entry> entries_;
};

}  // namespace nephele

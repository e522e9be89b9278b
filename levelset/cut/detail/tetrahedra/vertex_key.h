#pragma once

#include <compare>
#include <cstdint>
#include <span>

#include "nephele/levelset/grid/brick_grid.h"

namespace nephele::detail {

/// A vertex: the brick that it belongs to, and within that the first sample of its edge, face or tetrahedron,
/// the other corners relative to it, and the functions that are 0 there.
class VertexKey {
 public:
  VertexKey() = default;
  /// `base` is relative to the brick that asks, -1 to 8.
  VertexKey(const Vec3i& base, unsigned first, unsigned second, std::span<const std::uint32_t> functions) {
    const Vec3i owner = brickOf(base);
    const int place = (owner.x + 1) + 3 * (owner.y + 1) + 9 * (owner.z + 1);
    // 0 is the brick itself: its keys come first.
    bits_ = std::uint64_t((place + 14) % 27);
    bits_ =
        bits_ << 9 | std::uint64_t((insideBrick(base.z) * 8 + insideBrick(base.y)) * 8 + insideBrick(base.x));
    bits_ = (bits_ << 3 | first) << 3 | second;
    for (std::size_t i = 0; i < 3; ++i) bits_ = bits_ << 14 | (i < functions.size() ? functions[i] + 1 : 0);
  }

  bool isOwn() const { return bits_ >> 57 == 0; }
  Vec3i owner() const {
    const int place = (int(bits_ >> 57) + 13) % 27;
    return {place % 3 - 1, place / 3 % 3 - 1, place / 9 - 1};
  }
  VertexKey inOwner() const {
    VertexKey key;
    key.bits_ = bits_ & ((std::uint64_t(1) << 57) - 1);
    return key;
  }
  /// Relative to the owner.
  Vec3i base() const {
    const int s = int(bits_ >> 48 & 511);
    return {s & 7, s >> 3 & 7, s >> 6};
  }
  unsigned first() const { return unsigned(bits_ >> 45 & 7); }
  unsigned second() const { return unsigned(bits_ >> 42 & 7); }
  std::uint32_t function(std::size_t i) const { return std::uint32_t(bits_ >> (28 - 14 * i) & 0x3FFF) - 1; }
  std::size_t functionCount() const {
    return (bits_ & 0x3FFF) != 0 ? 3 : (bits_ >> 14 & 0x3FFF) != 0 ? 2 : 1;
  }
  auto operator<=>(const VertexKey&) const = default;

 private:
  std::uint64_t bits_ = 0;
};

}  // namespace nephele::detail

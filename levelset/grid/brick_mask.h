#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "nephele/modeling/base/math.h"

namespace nephele::detail {

/// A set of the 8^3 samples of a brick: one word per slice of z, bit x + 8 y.
struct BrickMask {
  std::array<std::uint64_t, 8> slices{};

  static BrickMask all() {
    BrickMask m;
    m.slices.fill(~std::uint64_t(0));
    return m;
  }
  bool isEmpty() const {
    std::uint64_t any = 0;
    for (const std::uint64_t s : slices) any |= s;
    return any == 0;
  }
  int count() const {
    int n = 0;
    for (const std::uint64_t s : slices) n += std::popcount(s);
    return n;
  }
  /// Number of the first sample in it, x fastest; 512 if there is none.
  int first() const {
    for (int z = 0; z < 8; ++z)
      if (slices[std::size_t(z)] != 0) return 64 * z + std::countr_zero(slices[std::size_t(z)]);
    return 512;
  }
  bool contains(int sample) const { return (slices[std::size_t(sample >> 6)] >> (sample & 63) & 1) != 0; }
  void add(int sample) { slices[std::size_t(sample >> 6)] |= std::uint64_t(1) << (sample & 63); }
  bool operator==(const BrickMask&) const = default;
};

inline BrickMask operator&(const BrickMask& a, const BrickMask& b) {
  BrickMask m;
  for (std::size_t z = 0; z < 8; ++z) m.slices[z] = a.slices[z] & b.slices[z];
  return m;
}

inline BrickMask without(const BrickMask& a, const BrickMask& b) {
  BrickMask m;
  for (std::size_t z = 0; z < 8; ++z) m.slices[z] = a.slices[z] & ~b.slices[z];
  return m;
}

inline BrickMask operator|(const BrickMask& a, const BrickMask& b) {
  BrickMask m;
  for (std::size_t z = 0; z < 8; ++z) m.slices[z] = a.slices[z] | b.slices[z];
  return m;
}

/// The samples on a face of the brick, the first or the last along an axis: one bit for each, in the same
/// order for both.
std::uint64_t faceOf(const BrickMask& mask, int axis, bool isLast);

/// How many cells have all of their eight corners in the set.
int wholeCells(const BrickMask& mask);

/// The set moved by `offset` samples; what leaves the brick is lost.
BrickMask moved(const BrickMask& mask, const Vec3i& offset);

/// The least and the greatest coordinates of a set that is not empty.
struct MaskBounds {
  Vec3i low, high;
};
MaskBounds boundsOf(const BrickMask& mask);

/// The samples of `mask` that hang together with its first one, each with its 6 neighbours.
BrickMask connectedPart(const BrickMask& mask);

}  // namespace nephele::detail

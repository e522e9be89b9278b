// Moving along x and y is a shift of each slice; what would enter the next row or slice is masked out first.
#include "nephele/levelset/grid/brick_mask.h"

#include <algorithm>

namespace nephele::detail {

namespace {

constexpr std::uint64_t kColumn = 0x0101010101010101ull, kRow = 0xFF;

/// Bits whose coordinate, in steps of `stride` bits, is at least n; n from 0 to 8.
constexpr std::uint64_t atLeast(int n, int stride) {
  if (n >= 8) return 0;
  if (stride == 8) return ~std::uint64_t(0) << (8 * n);
  return ((kRow << n) & kRow) * kColumn;
}

/// Moved by d along the axis, -15 to 15; what leaves the brick is lost.
std::uint64_t moved(std::uint64_t slice, int d, int stride) {
  if (d > 7 || d < -7) return 0;
  if (d >= 0) return (slice & ~atLeast(8 - d, stride)) << (d * stride);
  return (slice & atLeast(-d, stride)) >> (-d * stride);
}

}  // namespace

MaskBounds boundsOf(const BrickMask& mask) {
  std::uint64_t flat = 0;
  MaskBounds bounds{{0, 0, 8}, {7, 7, -1}};
  for (int z = 0; z < 8; ++z) {
    if (mask.slices[std::size_t(z)] == 0) continue;
    flat |= mask.slices[std::size_t(z)];
    bounds.low.z = std::min(bounds.low.z, z);
    bounds.high.z = z;
  }
  bounds.low.y = std::countr_zero(flat) / 8;
  bounds.high.y = 7 - std::countl_zero(flat) / 8;
  while ((flat & (kColumn << bounds.low.x)) == 0) ++bounds.low.x;
  while ((flat & (kColumn << bounds.high.x)) == 0) --bounds.high.x;
  return bounds;
}

std::uint64_t faceOf(const BrickMask& mask, int axis, bool isLast) {
  if (axis == 2) return mask.slices[isLast ? 7 : 0];
  std::uint64_t face = 0;
  for (std::size_t z = 0; z < 8; ++z) {
    const std::uint64_t slice = mask.slices[z];
    if (axis == 1) {
      face |= (isLast ? slice >> 56 : slice & kRow) << (8 * z);
    } else {
      // Column 0: any order will do that is the same for all.
      face |= ((isLast ? slice >> 7 : slice) & kColumn) << z;
    }
  }
  return face;
}

int wholeCells(const BrickMask& mask) {
  int count = 0;
  for (std::size_t z = 0; z < 7; ++z) {
    const std::uint64_t both = mask.slices[z] & mask.slices[z + 1],
                        square = both & both >> 1 & ~(kColumn << 7);
    count += std::popcount(square & square >> 8);
  }
  return count;
}

BrickMask moved(const BrickMask& mask, const Vec3i& offset) {
  BrickMask result;
  for (int z = 0; z < 8; ++z)
    if (const int target = z + offset.z; target >= 0 && target < 8)
      result.slices[std::size_t(target)] =
          moved(moved(mask.slices[std::size_t(z)], offset.x, 1), offset.y, 8);
  return result;
}

BrickMask connectedPart(const BrickMask& mask) {
  BrickMask part;
  if (mask.isEmpty()) return part;
  part.add(mask.first());
  // Up and down through the slices, each filled before the next.
  for (bool isGrowing = true; isGrowing;) {
    isGrowing = false;
    for (int step = 0; step < 16; ++step) {
      const auto z = std::size_t(step < 8 ? step : 15 - step);
      std::uint64_t filled =
          part.slices[z] | (z > 0 ? part.slices[z - 1] : 0) | (z < 7 ? part.slices[z + 1] : 0);
      filled &= mask.slices[z];
      for (std::uint64_t before = 0; before != filled;) {
        before = filled;
        filled |= moved(filled, 1, 1) | moved(filled, -1, 1) | moved(filled, 1, 8) | moved(filled, -1, 8);
        filled &= mask.slices[z];
      }
      isGrowing |= filled != part.slices[z];
      part.slices[z] = filled;
    }
  }
  return part;
}

}  // namespace nephele::detail

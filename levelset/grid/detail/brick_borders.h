#pragma once

#include <array>

#include "nephele/levelset/grid/brick_layout.h"

/// The one gathering of the samples that a brick stores from those that bricks own.
namespace nephele::detail {

/// How far samples lie apart in memory.
struct SampleStrides {
  int x, y, z;
};
/// Of the 8^3 own samples of a brick; of the same in OpenVDB's order; of a brick stored with its borders.
inline constexpr SampleStrides kOwnStrides{1, 8, 64};
inline constexpr SampleStrides kZFastestStrides{64, 8, 1};
inline constexpr SampleStrides kStoredStrides{1, BrickLayout::kWidth,
                                              BrickLayout::kWidth* BrickLayout::kWidth};

/// What a brick stores of one of the 27 bricks around it, itself among them.
struct BorderPart {
  /// Where that brick stands, -1 to 1 along each axis.
  Vec3i side;
  /// Its first sample that is stored, 0 to 7, and how many are along each axis.
  Vec3i source, count;
  /// Where the first is stored.
  int target;
};

/// All of them, x fastest.
inline constexpr std::array<BorderPart, 27> kBorderParts = [] {
  constexpr int kSource[3] = {BrickLayout::kBrick - BrickLayout::kBefore, 0, 0},
                kCount[3] = {BrickLayout::kBefore, BrickLayout::kBrick, BrickLayout::kAfter},
                kTarget[3] = {-BrickLayout::kBefore, 0, BrickLayout::kBrick};
  std::array<BorderPart, 27> parts{};
  for (int i = 0; i < 27; ++i) {
    const int x = i % 3, y = i / 3 % 3, z = i / 9;
    parts[std::size_t(i)] = {{x - 1, y - 1, z - 1},
                             {kSource[x], kSource[y], kSource[z]},
                             {kCount[x], kCount[y], kCount[z]},
                             sampleOffset(kTarget[x], kTarget[y], kTarget[z])};
  }
  return parts;
}();

/// Stores `factor` times the samples of one of these bricks; `own` is its sample (0, 0, 0).
inline void copyPart(const BorderPart& part, const float* own, const SampleStrides& strides, float factor,
                     float* stored) {
  const float* from = own + part.source.x * strides.x + part.source.y * strides.y + part.source.z * strides.z;
  float* to = stored + part.target;
  for (int z = 0; z < part.count.z; ++z)
    for (int y = 0; y < part.count.y; ++y)
      for (int x = 0; x < part.count.x; ++x)
        to[z * kStoredStrides.z + y * kStoredStrides.y + x] =
            factor * from[z * strides.z + y * strides.y + x * strides.x];
}

/// Stores one value in the place of the samples of one of these bricks.
inline void fillPart(const BorderPart& part, float value, float* stored) {
  copyPart({part.side, {}, part.count, part.target}, &value, {0, 0, 0}, 1.0f, stored);
}

}  // namespace nephele::detail

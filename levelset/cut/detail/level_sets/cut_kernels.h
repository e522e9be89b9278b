#pragma once

#include <span>

#include "nephele/levelset/grid/brick_mask.h"
#include "nephele/modeling/base/interval.h"

/// Loops over the 8^3 samples of a brick, x fastest. Not for other folders.
namespace nephele::detail {

/// The samples with value > limit, and those with -value > limit.
struct Sides {
  BrickMask above, below;
};
Sides sidesOf(const float* values, float limit);

/// Samples of a knife and on which side of it a piece lies.
struct KnifeSide {
  const float* samples;
  /// 1 or -1.
  float sign;
};

/// min(shape, sign_i knife_i - halfKerf ...), not beyond the ends -band and band; returns its range.
Interval pieceSamples(const float* shape, std::span<const KnifeSide> knives, float halfKerf, float band,
                      float* values);

/// The same as plain loops: the truth that the vector code is tested against, bit for bit.
Sides sidesOfScalar(const float* values, float limit);
Interval pieceSamplesScalar(const float* shape, std::span<const KnifeSide> knives, float halfKerf, float band,
                            float* values);

}  // namespace nephele::detail

#pragma once

#include <cmath>
#include <cstddef>

namespace nephele {

/// What hides a ray from some depth on: pairs of a depth along the line of sight and the optical depth in
/// front of it, both not decreasing, straight between them and constant beyond. Empty: nothing does.
struct HoldoutCurve {
  struct Knot {
    float depth = 0.0f, opticalDepth = 0.0f;
  };
  const Knot* knots = nullptr;
  std::size_t count = 0;

  bool empty() const { return count == 0; }
  /// At `depth`; `cursor` starts at 0 and is kept by the caller for depths that do not decrease.
  float transmittance(float depth, std::size_t& cursor) const {
    while (cursor != count && knots[cursor].depth <= depth) ++cursor;
    if (cursor == 0) return 1.0f;
    const Knot& a = knots[cursor - 1];
    if (cursor == count) return std::exp(-a.opticalDepth);
    const Knot& b = knots[cursor];
    const float share = (depth - a.depth) / (b.depth - a.depth);
    return std::exp(-(a.opticalDepth + (b.opticalDepth - a.opticalDepth) * share));
  }
};

}  // namespace nephele

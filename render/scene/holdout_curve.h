#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace nephele {

/// What hides a ray from some depth on: pairs of a depth along the line of sight and the optical depth in
/// front of it, both not decreasing, straight between them and constant beyond. Empty: nothing does.
struct HoldoutCurve {
  struct Knot {
    float depth = 0.0f, opticalDepth = 0.0f;
  };
  /// From here on nothing is seen.
  static constexpr float kOpaque = 80;
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

  /// The share of the opacity of a medium that is seen: one from `begin` to `end` (depths), homogeneous, with
  /// `ownDepth` as its optical depth. Exact, whatever the curve does on the way: where the medium and what
  /// holds it out are in the same place, what is seen of each is its share of what both stop. `cursor` as
  /// above, for beginnings that do not decrease.
  float seen(float begin, float end, float ownDepth, std::size_t& cursor) const {
    const float first = transmittance(begin, cursor);
    if (cursor == count || knots[cursor].depth >= end) {
      // Even on the way, most often constant.
      if (cursor == 0 || cursor == count || !(end > begin)) return first;
    }
    // (1 - exp(-x)) / x
    const auto mean = [](float x) { return x > 1e-4f ? -std::expm1(-x) / x : 1 - 0.5f * x; };
    float at = begin, own = 0, held = -std::log(first), sum = 0;
    if (!(held < kOpaque)) return 0;
    for (std::size_t next = cursor; at < end;) {
      const float to = next != count && knots[next].depth < end ? knots[next].depth : end;
      float heldEnd = held;
      if (next != 0 && next != count) {
        const Knot &a = knots[next - 1], &b = knots[next];
        heldEnd = a.opticalDepth + (b.opticalDepth - a.opticalDepth) * ((to - a.depth) / (b.depth - a.depth));
      }
      const float share = (to - at) / (end - begin), part = ownDepth * share;
      sum += std::exp(-own - held) * share * mean(part + std::max(heldEnd - held, 0.0f));
      own += part;
      held = heldEnd;
      at = to;
      for (; next != count && knots[next].depth <= at; ++next) held = knots[next].opticalDepth;
    }
    return std::min(sum / mean(ownDepth), 1.0f);
  }
};

}  // namespace nephele

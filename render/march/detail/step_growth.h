#pragma once

#include <algorithm>
#include <cmath>

#include "nephele/render/volume/march_scene.h"

namespace nephele::detail {

/// How much longer steps may be behind an optical depth for the same error in the picture: that of a step is
/// as its transmittance and the cube of its length, which would be exp(x), with a third of the depth as x.
/// The start of its series is near enough.
///
/// In a constant density steps that grow all the way are places v of equal distances. There x is
/// v (6 - v) / (6 - 4 v), near enough to -log(1 - v), and a line from where steps are as long as they may be.
struct StepGrowth {
  explicit StepGrowth(const MarchScene& scene)
      : most(scene.mostGrowth),
        xPerDepth(scene.leastColour() * (1.0f / 3)),
        opaque(-std::log(scene.cutoff) / scene.leastColour()),
        lastV(1.5f - std::sqrt(2.25f - 9 * (most - 1) / (4 * most - 1))),
        lastX(curve(lastV)) {}

  float at(float depth) const {
    const float x = depth * xPerDepth;
    return std::min(1 + x + 0.5f * x * x, most);
  }

  float xOf(float v) const { return v < lastV ? curve(v) : lastX + most * (v - lastV); }
  float vOf(float x) const {
    if (!(x < lastX)) return lastV + (x - lastX) / most;
    const float a = 3 + 2 * x;
    return 6 * x / (a + std::sqrt(a * a - 6 * x));
  }

  float most;
  /// Of the colour that is seen through the most.
  float xPerDepth;
  /// Optical depth behind which less than the cutoff is seen of any colour.
  float opaque;
  /// Up to where steps grow.
  float lastV, lastX;

 private:
  static float curve(float v) { return v * (6 - v) / (6 - 4 * v); }
};

/// Steps through a constant density that grow all the way: the first of them `length` long behind nothing.
struct GrowingSteps {
  /// From s0 to s1, which has `thickness` of optical depth per length, behind `depth`.
  GrowingSteps(const StepGrowth& growthLaw, float s0, float s1, float length, float thickness, float depth)
      : law(growthLaw), start(s0) {
    const float xPerLength = thickness * law.xPerDepth, x0 = depth * law.xPerDepth;
    firstV = law.vOf(x0);
    const float v1 = law.vOf(x0 + (s1 - s0) * xPerLength);
    count = std::max(int(std::ceil((v1 - firstV) / (length * xPerLength))), 1);
    each = (v1 - firstV) / float(count);
    firstX = law.xOf(firstV);
    lengthPerX = 1 / xPerLength;
  }

  /// Where step n begins.
  float placeOf(float n) const { return start + (law.xOf(firstV + n * each) - firstX) * lengthPerX; }

  const StepGrowth& law;
  int count = 0;
  float start, firstV = 0.0f, each = 0.0f, firstX = 0.0f, lengthPerX = 0.0f;
};

}  // namespace nephele::detail

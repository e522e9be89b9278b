// Expected numbers are closed forms: the exponential, its series, and what steps of a run have to add up to.
#include "nephele/render/march/detail/step_growth.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace nephele::detail {
namespace {

MarchScene growingUpTo(float most) {
  MarchScene scene;
  scene.mostGrowth = most;
  return scene;
}

TEST(StepGrowth, IsNearlyExponentialUpToItsLimit) {
  const StepGrowth growth(growingUpTo(4));
  EXPECT_EQ(growth.at(0), 1);
  // 1 + x + x^2 / 2 of a third of the depth: short of the exponential by less than x^3 / 6 exp(x).
  for (float x = 0; x < 1.6f; x += 0.1f) {
    EXPECT_LE(growth.at(3 * x), 1.0001f * std::exp(x));
    EXPECT_GE(growth.at(3 * x), std::exp(x) * (0.9999f - x * x * x / 6));
  }
  EXPECT_EQ(growth.at(100), 4);
  // Behind this, 1e-4 is seen.
  EXPECT_NEAR(growth.opaque, -std::log(1e-4f), 1e-5f);
}

TEST(StepGrowth, OfOneIsNone) {
  const StepGrowth growth(growingUpTo(1));
  for (const float x : {0.0f, 0.3f, 1.0f, 7.0f}) {
    EXPECT_EQ(growth.at(x), 1);
    EXPECT_NEAR(growth.xOf(x), x, 1e-6f * x);
    EXPECT_NEAR(growth.vOf(x), x, 1e-6f * x);
  }
}

TEST(StepGrowth, HasPlacesOfEqualDistances) {
  for (const float most : {1.5f, 3.0f, 4.0f}) {
    const StepGrowth growth(growingUpTo(most));
    for (float v = 0; v < 3; v += 0.01f) {
      const float x = growth.xOf(v);
      EXPECT_NEAR(growth.vOf(x), v, 2e-6f * (1 + v)) << most;
      // The length of a step there, as a difference.
      const double h = 1e-2, slope = (double(growth.xOf(v + 1e-2f)) - double(x)) / h;
      const float middle = growth.xOf(v + 5e-3f);
      EXPECT_NEAR(slope, growth.at(middle / growth.xPerDepth), 0.035 * slope) << most << " " << v;
    }
    for (float v = 0; v < std::min(0.45f, growth.lastV); v += 0.1f)
      EXPECT_NEAR(growth.xOf(v), -std::log(1 - v), 0.01f * v) << most;
  }
}

TEST(GrowingSteps, FillTheirWayAndAreAsLongAsTheyMayBe) {
  const StepGrowth growth(growingUpTo(4));
  for (const float length : {0.002f, 0.01f, 0.05f})
    for (const float thickness : {3.0f, 10.0f, 200.0f})
      for (const float depth : {0.0f, 0.7f, 3.0f, 8.0f}) {
        const float s0 = 0.25f, s1 = 1.5f;
        const GrowingSteps steps(growth, s0, s1, length, thickness, depth);
        EXPECT_NEAR(steps.placeOf(0), s0, 1e-6f);
        EXPECT_NEAR(steps.placeOf(float(steps.count)), s1, 1e-5f);
        for (int n = 0; n != steps.count; ++n) {
          const float begin = steps.placeOf(float(n)), own = steps.placeOf(float(n + 1)) - begin;
          const float near = growth.at(depth + thickness * (begin - s0)),
                      far = growth.at(depth + thickness * (begin + own - s0));
          EXPECT_LE(own, 1.04f * length * far + 2e-6f) << n;
          // The last of them may shorten all.
          EXPECT_GE(own, (0.96f - 1.0f / float(steps.count)) * length * near - 2e-6f) << n;
        }
      }
}

TEST(GrowingSteps, AreOneWhereTheWayIsShort) {
  const StepGrowth growth(growingUpTo(4));
  const GrowingSteps steps(growth, 1, 1.5f, 1, 3, 0);
  EXPECT_EQ(steps.count, 1);
  EXPECT_NEAR(steps.placeOf(1), 1.5f, 1e-6f);
}

}  // namespace
}  // namespace nephele::detail

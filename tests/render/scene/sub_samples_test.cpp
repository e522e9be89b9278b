#include "nephele/render/scene/sub_samples.h"

#include <gtest/gtest.h>

#include <cmath>

namespace nephele {
namespace {

TEST(SubSamples, LieEvenlyAroundTheCentreOfThePixel) {
  // Their mean is the centre, so that a picture does not move with their number; a tent reaches one pixel.
  for (const int count : {1, 2, 3, 4, 8, 16, 61})
    for (const std::uint64_t seed : {0, 7}) {
      double x = 0, y = 0;
      for (const SubSample& sub : pixelPattern(count, seed)) {
        x += sub.x / count;
        y += sub.y / count;
        EXPECT_LT(std::fabs(sub.x - 0.5), 1.5);
        EXPECT_LT(std::fabs(sub.y - 0.5), 1.5);
      }
      EXPECT_NEAR(x, 0.5, 1e-12) << count;
      EXPECT_NEAR(y, 0.5, 1e-12) << count;
    }
}

}  // namespace
}  // namespace nephele

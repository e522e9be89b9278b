// Obstacles that are half-spaces and balls: closed forms.
#include "nephele/modeling/cloud/obstacle.h"

#include <gtest/gtest.h>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"
#include "nephele/modeling/noise/noise.h"
#include "nephele/modeling/shape/shapes.h"
#include "tests/support/check_field.h"

namespace nephele::test {
namespace {

/// Inside below y = 0; three times as steep as a distance.
ScalarField ground() {
  return -3.0f * component(position(), 1);
}

TEST(Obstacle, TurnsBackWhatFlowsIn) {
  const VectorField down(Vec3f{1, -2, 3});
  const Vec3f inside{4, -0.5f, 0}, outside{4, 0.5f, 0};
  EXPECT_LT(length(reflected(down, ground())(inside) - Vec3f{1, 2, 3}), 1e-6f);
  EXPECT_LT(length(reflected(down, ground(), {.retained = 0.25f})(inside) - Vec3f{1, 0.5f, 3}), 1e-6f);
  EXPECT_LT(length(reflected(down, ground(), {.retained = 0})(inside) - Vec3f{1, 0, 3}), 1e-6f);
  EXPECT_EQ(reflected(down, ground())(outside), (Vec3f{1, -2, 3}));
}

TEST(Obstacle, LeavesWhatFlowsOut) {
  EXPECT_EQ(reflected(VectorField(Vec3f{1, 2, 3}), ground())(Vec3f{4, -0.5f, 0}), (Vec3f{1, 2, 3}));
}

TEST(Obstacle, NothingFlowsIntoABall) {
  const ScalarField ball = sphere({0, 0, 0}, 1);
  const VectorField u = vectorNoise({.frequency = 2, .seed = 3});
  for (const float retained : {0.0f, 0.5f, 1.0f})
    for (int i = 0; i < 300; ++i) {
      const Vec3f p =
          Vec3f{std::sin(7.0f * float(i)), std::sin(5.0f * float(i)), std::sin(3.0f * float(i))} * 0.57f;
      // Towards the centre.
      EXPECT_LT(-dot(reflected(u, ball, {.retained = retained})(p), normalize(p)), 1e-5f);
    }
}

TEST(Obstacle, StaysWhereTheObjectHasNoGradient) {
  EXPECT_EQ(reflected(VectorField(Vec3f{1, 2, 3}), ScalarField(1.0f))(Vec3f{}), (Vec3f{1, 2, 3}));
}

TEST(Obstacle, KeepsThePromisesOfFields) {
  checkField(
      reflected(vectorNoise({.frequency = 1.5f, .seed = 3}), sphere({0, 0, 0}, 0.7f), {.retained = 0.5f}),
      {{-1, -1, -1}, {1, 1, 1}}, {.step = 5e-4f, .tolerance = 2e-2f});
}

TEST(Obstacle, RefusesBadShares) {
  EXPECT_THROW(reflected(VectorField(Vec3f{}), ground(), {.retained = -0.1f}), Error);
  EXPECT_THROW(reflected(VectorField(Vec3f{}), ground(), {.retained = 1.5f}), Error);
  EXPECT_THROW(reflected(VectorField(Vec3f{}), ground(), {.retained = NAN}), Error);
}

}  // namespace
}  // namespace nephele::test

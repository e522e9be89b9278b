// Expected: the distance to a sphere, radius - |P|, within the errors of first order of the sweep and of the
// mesh of the surface.
#include "nephele/levelset/cloud/renormalise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/shape/shapes.h"

namespace nephele {
namespace {

// Levels of a sphere that are no distances.
ScalarField steepSphere(float radius) {
  return sphere({0, 0, 0}, radius) * 3.0f;
}

BakeOptions around(float radius) {
  const float side = 2 * radius;
  return {.voxelSize = radius / 16, .box = {{-side, -side, -side}, {side, side, side}}};
}

TEST(Renormalise, MakesLevelsDistancesInAnyUnits) {
  const DistanceBand band{0.5f, 0.5f};
  const ScalarField swept = sweptDistance(steepSphere(1), around(1), band),
                    rebuilt = rebuiltDistance(steepSphere(1), around(1), band);
  std::vector<Vec3f> points;
  for (const Vec3f& direction : {Vec3f{1, 0, 0}, Vec3f{0, -0.6f, 0.8f}, Vec3f{0.36f, 0.48f, 0.8f}})
    for (const float at : {0.6f, 0.85f, 1.0f, 1.15f, 1.4f}) points.push_back(direction * at);
  for (const Vec3f& p : points) {
    constexpr float kVoxel = 1.0f / 16;
    EXPECT_NEAR(swept(p), 1 - length(p), kVoxel);
    EXPECT_NEAR(rebuilt(p), 1 - length(p), 0.1f * kVoxel);
  }
  // Powers of two round nothing.
  for (const int power : {-30, 30}) {
    const float unit = std::ldexp(1.0f, power);
    const ScalarField other = sweptDistance(steepSphere(unit), around(unit), {0.5f * unit, 0.5f * unit});
    for (const Vec3f& p : points) EXPECT_FLOAT_EQ(other(p * unit), swept(p) * unit) << power;
  }
}

}  // namespace
}  // namespace nephele

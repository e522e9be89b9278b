// What density is multiplied by, against closed forms.
#include "nephele/modeling/cloud/density_profile.h"

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/space.h"
#include "nephele/modeling/shape/shapes.h"
#include "tests/support/check_field.h"

namespace nephele::test {
namespace {

const Box kBox{{-1, -1, -1}, {1, 1, 1}};

ScalarField height() {
  return plane({}, {0, 1, 0});
}

TEST(Ramp, IsThePolylineOfItsStops) {
  const ScalarField f = ramp(height(), {{0, 2}, {1, 4}, {3, 0}});
  EXPECT_EQ(f({0, -5, 0}), 2);
  EXPECT_EQ(f({0, 0, 0}), 2);
  EXPECT_EQ(f({0, 0.25f, 0}), 2.5f);
  EXPECT_EQ(f({0, 1, 0}), 4);
  EXPECT_EQ(f({0, 2.5f, 0}), 1);
  EXPECT_EQ(f({0, 9, 0}), 0);
  EXPECT_EQ(f({0, NAN, 0}), 2);
}

TEST(Ramp, JumpsWhereTwoStopsShareAPlace) {
  const ScalarField f = ramp(height(), {{0, 1}, {0, 3}});
  EXPECT_EQ(f({0, std::nextafter(0.0f, -1.0f), 0}), 1);
  EXPECT_EQ(f({0, 0, 0}), 3);
  EXPECT_EQ(f.range({{0, -1, 0}, {0, 1, 0}}), (Interval{1, 3}));
}

TEST(Ramp, KeepsWhatFieldsPromise) {
  checkField(ramp(height(), {{-0.6f, 1}, {-0.1f, 0.3f}, {0.2f, 0.3f}, {0.7f, 2}}), kBox);
}

TEST(Ramp, IsConstantOnBoxesBetweenEqualStops) {
  const ScalarField f = ramp(height(), {{-1, 0.3f}, {0.5f, 0.3f}, {1, 5}});
  EXPECT_EQ(f.range({{-1, -2, -1}, {1, 0.49f, 1}}), Interval::of(0.3f));
}

TEST(Ramp, RefusesStopsThatFallAreMissingOrNotFinite) {
  EXPECT_THROW(ramp(height(), {}), Error);
  EXPECT_THROW(ramp(height(), {{1, 0}, {0, 0}}), Error);
  EXPECT_THROW(ramp(height(), {{0, INFINITY}}), Error);
  EXPECT_THROW(ramp(height(), {{NAN, 0}}), Error);
}

TEST(DensityFactor, IsTheConstantOneWhereNothingIsAskedFor) {
  EXPECT_EQ(densityFactor({}).range(Box::everywhere()), Interval::of(1));
}

TEST(DensityFactor, CutsTheBaseBySmoothstep) {
  const ScalarField f =
      densityFactor({.flatBase = DensityProfile::FlatBase{.height = 0.2f, .softness = 0.4f}});
  EXPECT_EQ(f({0, 0.1f, 0}), 0);
  EXPECT_EQ(f({5, 0.2f, 1}), 0);
  // t = 1/4: t t (3 - 2 t) = 5/32.
  EXPECT_NEAR(f({0, 0.3f, 0}), 5.0 / 32, 1e-6);
  EXPECT_NEAR(f({0, 0.4f, 0}), 0.5, 1e-6);
  EXPECT_EQ(f({0, 0.61f, 0}), 1);
  // Whole boxes are settled by their range, so that a bake need not look.
  EXPECT_EQ(f.range({{-1, -1, -1}, {1, 0.19f, 1}}), Interval::of(0));
  EXPECT_EQ(f.range({{-1, 0.61f, -1}, {1, 2, 1}}), Interval::of(1));
}

TEST(DensityFactor, FollowsTheHeightsOfTheShape) {
  const ScalarField f =
      densityFactor({.low = 10, .high = 20, .heightProfile = {{0, 1}, {0.5f, 0.5f}, {1, 0}}});
  EXPECT_EQ(f({0, 9, 0}), 1);
  EXPECT_NEAR(f({0, 12.5f, 0}), 0.75, 1e-6);
  EXPECT_NEAR(f({0, 17.5f, 0}), 0.25, 1e-6);
  EXPECT_EQ(f({0, 25, 0}), 0);
}

TEST(DensityFactor, ThinsOutTowardsTheTop) {
  const ScalarField f = densityFactor({.low = 0, .high = 2, .thinOut = 0.8f, .thinOutFrom = 0.5f});
  EXPECT_EQ(f({0, 0.9f, 0}), 1);
  // Half of the way from 0.5 to 1 is h = 0.75, y = 1.5: smoothstep 1/2.
  EXPECT_NEAR(f({0, 1.5f, 0}), 0.6, 1e-6);
  EXPECT_NEAR(f({0, 2.5f, 0}), 0.2, 1e-6);
}

TEST(DensityFactor, MultipliesWhatIsAskedForTogether) {
  const DensityProfile::FlatBase base{.height = -0.5f, .softness = 0.6f};
  const ScalarField both = densityFactor({.low = -1, .high = 1, .flatBase = base, .thinOut = 0.5f});
  const ScalarField first = densityFactor({.flatBase = base});
  const ScalarField second = densityFactor({.low = -1, .high = 1, .thinOut = 0.5f});
  for (const float y : {-0.4f, -0.2f, 0.0f, 0.3f, 0.8f})
    EXPECT_NEAR(both({0, y, 0}), first({0, y, 0}) * second({0, y, 0}), 1e-6) << y;
}

TEST(DensityFactor, VariesWithTheRmsAskedForAroundOneAndIsNeverNegative) {
  const Box wide{{-40, -40, -40}, {40, 40, 40}};
  std::mt19937 random(3);
  const Points points = randomPoints(wide, 200000, random);
  for (const float amount : {0.1f, 0.25f, 2.0f}) {
    const ScalarField f = densityFactor({.interiorNoise = amount, .interiorFrequency = 1.3f, .seed = 4});
    const Values<float> values = evaluate(f, points);
    double sum = 0, squares = 0;
    float least = 1;
    for (const float v : values.data[0]) {
      sum += v;
      squares += (double(v) - 1) * (double(v) - 1);
      least = std::min(least, v);
    }
    const double n = double(points.size());
    EXPECT_GE(least, 0);
    if (amount > 0.5f) continue;
    // Unit-rms noise; the sampling error over some 10^5 independent cells is below 1 %.
    EXPECT_NEAR(sum / n, 1, 0.01 * amount + 0.002);
    EXPECT_NEAR(std::sqrt(squares / n), amount, 0.03 * amount);
  }
}

TEST(DensityFactor, KeepsWhatFieldsPromise) {
  checkField(densityFactor({.low = -1,
                            .high = 1,
                            .interiorNoise = 0.4f,
                            .interiorFrequency = 0.2f,
                            .flatBase = DensityProfile::FlatBase{.height = -0.5f, .softness = 0.3f},
                            .heightProfile = {{0, 1}, {0.7f, 0.5f}, {1, 0.2f}},
                            .thinOut = 0.5f}),
             kBox);
}

TEST(DensityFactor, IsNeverNegativeByItsRange) {
  const ScalarField f = densityFactor({.low = -1,
                                       .high = 1,
                                       .interiorNoise = 2,
                                       .flatBase = DensityProfile::FlatBase{.height = 0, .softness = 0.1f},
                                       .heightProfile = {{0, 1}, {1, 0}},
                                       .thinOut = 1});
  EXPECT_GE(f.range(kBox).min, 0);
  EXPECT_GE(f.range(Box::everywhere()).min, 0);
}

TEST(DensityFactor, RefusesNumbersOutsideTheirRange) {
  using Base = DensityProfile::FlatBase;
  EXPECT_THROW(densityFactor({.interiorNoise = -0.1f}), Error);
  EXPECT_THROW(densityFactor({.interiorNoise = NAN}), Error);
  EXPECT_THROW(densityFactor({.interiorNoise = 0.1f, .interiorFrequency = 0}), Error);
  EXPECT_THROW(densityFactor({.flatBase = Base{.height = 0, .softness = 0}}), Error);
  EXPECT_THROW(densityFactor({.flatBase = Base{.height = NAN, .softness = 1}}), Error);
  EXPECT_THROW(densityFactor({.heightProfile = {{0, -1}}}), Error);
  EXPECT_THROW(densityFactor({.low = 1, .high = 1, .heightProfile = {{0, 1}}}), Error);
  EXPECT_THROW(densityFactor({.thinOut = 1.5f}), Error);
  EXPECT_THROW(densityFactor({.thinOut = 1, .thinOutFrom = 1}), Error);
}

}  // namespace
}  // namespace nephele::test

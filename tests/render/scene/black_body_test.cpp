#include "nephele/render/scene/black_body.h"

#include <gtest/gtest.h>

#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"

namespace nephele {
namespace {

TEST(BlackBody, HasTheChromaticitiesOfThePlanckianLocus) {
  // Wyszecki and Stiles, Color Science, table of the Planckian locus (CIE 1931): x, y by temperature. The
  // fitted matching functions are within 0.003.
  const double known[][3] = {{2000, 0.5267, 0.4133}, {3000, 0.4369, 0.4041}, {6500, 0.3135, 0.3237}};
  for (const auto& [kelvin, x, y] : known) {
    const Vec3d xyz = blackBodyXyz(kelvin);
    const double sum = xyz.x + xyz.y + xyz.z;
    EXPECT_NEAR(xyz.x / sum, x, 0.003) << kelvin;
    EXPECT_NEAR(xyz.y / sum, y, 0.003) << kelvin;
  }
}

TEST(BlackBody, HasLuminanceOneAt2000Kelvin) {
  EXPECT_DOUBLE_EQ(blackBodyXyz(2000).y, 1.0);
  const Vec3f colour = blackBody(2000);
  EXPECT_NEAR(0.2126f * colour.x + 0.7152f * colour.y + 0.0722f * colour.z, 1, 2e-3);
}

TEST(BlackBody, GrowsAsWiensLawWhereItIsCool) {
  // At 555 nm, where the eye is most sensitive, Planck's law goes with exp(-c2 / (lambda T)) as long as
  // that is small; c2 = 0.014388 m K. The eye's effective wavelength is a little longer for redder light.
  const double ratio = blackBodyXyz(1500).y / blackBodyXyz(1400).y;
  const double wien = std::exp(0.014388 / 580e-9 * (1.0 / 1400 - 1.0 / 1500));
  EXPECT_NEAR(ratio / wien, 1, 0.1);
}

TEST(BlackBody, IsDarkAtZeroAndNeverNegative) {
  EXPECT_EQ(blackBody(0), Vec3f{});
  EXPECT_EQ(blackBody(-5), Vec3f{});
  for (double kelvin = 100; kelvin < 20000; kelvin *= 1.3) {
    const Vec3f colour = blackBody(kelvin);
    EXPECT_GE(std::fmin(colour.x, std::fmin(colour.y, colour.z)), 0.0f);
    // Redder than neutral below 6500 K, bluer above.
    if (kelvin < 6000) {
      EXPECT_GE(colour.x, colour.z);
    }
    if (kelvin > 7000) {
      EXPECT_LE(colour.x, colour.z);
    }
  }
}

TEST(BlackBody, IsAFieldOfATemperature) {
  const VectorField glow = blackBody(1000.0f * component(position(), 0), 4000);
  for (const float kelvin : {1200.0f, 2000.0f, 3999.0f}) {
    const Vec3f found = glow({kelvin / 1000, 0, 0}), expected = blackBody(double(kelvin));
    for (int c = 0; c != 3; ++c) {
      // Within the table's steps.
      EXPECT_NEAR(found[c], expected[c], 1e-3f * expected[c] + 1e-6f);
      EXPECT_TRUE(glow.range({{0.5f, 0, 0}, {kelvin / 1000, 1, 1}})[std::size_t(c)].contains(found[c]));
    }
  }
  EXPECT_EQ(glow({9, 0, 0}), glow({4, 0, 0}));
  EXPECT_EQ(glow({-1, 0, 0}), Vec3f{});
  EXPECT_EQ(BlackBodyColours(6500)(NAN), Vec3f{});
  EXPECT_THROW(blackBody(component(position(), 0), NAN), Error);
  EXPECT_EQ(glow.range({{-2, 0, 0}, {0, 1, 1}})[0], Interval::of(0));
}

}  // namespace
}  // namespace nephele

#include "nephele/render/scene/clear_sky.h"

#include <gtest/gtest.h>

#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/render/scene/lights.h"

namespace nephele {
namespace {

float luminance(const Vec3f& c) {
  return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z;
}

ClearSky skyAt(float elevation, float turbidity = 2, float height = 1000) {
  ClearSky::Options options;
  options.sun = directionTowards(90, elevation);
  options.turbidity = turbidity;
  options.height = height;
  return ClearSky(options);
}

TEST(ClearSky, HazeTakesWhatTurbiditySays) {
  // From the ground upwards air takes 0.013558 * 8 in green, haze turbidity - 1 times as much.
  const float air = skyAt(90, 1, 0).sunlight().y, hazy = skyAt(90, 4, 0).sunlight().y;
  EXPECT_NEAR(std::log(hazy / air), -3 * 0.013558 * 8, 2e-3);
}

TEST(ClearSky, TakesTwiceAsMuchAtThirtyDegrees) {
  // Air in flat layers; that the earth is round changes the way at 30 degrees by less than 1 %.
  const auto depth = [](float elevation) {
    const Vec3f clear = skyAt(elevation, 1, 0).sunlight(), hazy = skyAt(elevation, 3, 0).sunlight();
    return std::log(clear.y / hazy.y);
  };
  EXPECT_NEAR(depth(30) / depth(90), 2, 0.02);
}

TEST(ClearSky, SunHasItsLuminanceAtThirtyEightDegrees) {
  EXPECT_NEAR(luminance(skyAt(38).sunlight()), 3.6f, 0.04f);
}

TEST(ClearSky, LightsLevelGroundGreyAtThirtyEightDegrees) {
  // By the midpoint rule in the square of the cosine.
  const ClearSky sky = skyAt(38, 2);
  Vec3f irradiance = sky.sunlight() * std::sin(radians(38.0f));
  constexpr int kCount = 60;
  for (int i = 0; i != kCount; ++i)
    for (int j = 0; j != kCount; ++j) {
      const float square = (float(i) + 0.5f) / kCount, up = std::sqrt(square), flat = std::sqrt(1 - square),
                  turn = 2 * kPi * (float(j) + 0.5f) / kCount;
      irradiance +=
          sky.radiance({flat * std::cos(turn), up, flat * std::sin(turn)}) * (kPi / float(kCount * kCount));
    }
  EXPECT_NEAR(irradiance.x / irradiance.y, 1, 0.01);
  EXPECT_NEAR(irradiance.z / irradiance.y, 1, 0.01);
}

TEST(ClearSky, SunGetsRedAndSets) {
  float before = 0;
  for (const float elevation : {60.0f, 30.0f, 10.0f, 4.0f, 1.0f}) {
    const Vec3f sun = skyAt(elevation).sunlight();
    EXPECT_GT(sun.x / sun.z, before) << elevation;
    before = sun.x / sun.z;
  }
  EXPECT_GT(before, 10);
  EXPECT_EQ(skyAt(-3).sunlight(), Vec3f{});
}

TEST(ClearSky, IsBlueAboveAndWhiterAtTheHorizon) {
  const ClearSky sky = skyAt(45);
  const Vec3f up = sky.radiance({0, 1, 0}), away = sky.radiance(directionTowards(-90, 2));
  EXPECT_GT(up.z, 1.5f * up.y);
  EXPECT_GT(up.y, 1.2f * up.x);
  EXPECT_LT(away.z / away.x, 0.7f * up.z / up.x);
  EXPECT_GT(luminance(away), luminance(up));
}

TEST(ClearSky, SendsAboutAQuarterOfTheSunsLightToTheGround) {
  // The share of the sky in what a level surface gets on clear days with the sun high: 0.1 to 0.3 (Iqbal, An
  // Introduction to Solar Radiation, 1983, chapter 7).
  const ClearSky sky = skyAt(60, 2.5f, 0);
  const Environment map = sky.map(64);
  double onGround = 0;
  for (int i = 0; i != 20; ++i)
    for (int k = 0; k != 40; ++k) {
      const float rise = std::sqrt((float(i) + 0.5f) / 20), turn = float(k) * 9;
      const Vec3f towards = directionTowards(turn, std::asin(rise) * 180 / kPi);
      onGround += double(kPi) / 800 * double(luminance(map.radiance(towards)));
    }
  const double sun = double(luminance(sky.sunlight())) * std::sin(double(radians(60)));
  EXPECT_GT(onGround / (onGround + sun), 0.1);
  EXPECT_LT(onGround / (onGround + sun), 0.3);
}

TEST(ClearSky, FadesFromDuskToNight) {
  float before = luminance(skyAt(10).radiance({0, 1, 0}));
  for (const float elevation : {0.0f, -4.0f, -8.0f, -12.0f}) {
    const float now = luminance(skyAt(elevation).radiance({0, 1, 0}));
    EXPECT_LT(now, before) << elevation;
    EXPECT_GT(now, 0) << elevation;
    before = now;
  }
  EXPECT_LT(luminance(skyAt(-18).radiance({0, 1, 0})), 1e-4f * luminance(skyAt(45).radiance({0, 1, 0})));
}

TEST(ClearSky, GroundIsBrighterWhereItReflectsMore) {
  ClearSky::Options options;
  options.groundAlbedo = {};
  const Vec3f dark = ClearSky(options).radiance({0, -1, 0});
  options.groundAlbedo = {1, 1, 1};
  const Vec3f bright = ClearSky(options).radiance({0, -1, 0});
  // White ground that sends back all that it gets: within the light of the sun above the air, by pi.
  EXPECT_GT(bright.y, 3 * dark.y);
  EXPECT_LT(bright.y, 1.8504f * 2.734f / kPi * 1.2f);
}

TEST(ClearSky, MapHoldsItsRadiance) {
  ClearSky::Options options;
  options.sun = directionTowards(130, 20);
  const ClearSky sky(options);
  const Environment map = sky.map(64);
  // Middles of pixels, which are 2.8125 degrees wide: their azimuths are counted from the sun's.
  for (const float row : {3.0f, 20.0f, 31.0f, 40.0f})
    for (const float column : {0.0f, 7.0f, 40.0f}) {
      const Vec3f towards = directionTowards(130 + (column + 0.5f) * 2.8125f, 90 - (row + 0.5f) * 2.8125f);
      const Vec3f expected = sky.radiance(towards), found = map.radiance(towards);
      for (int c = 0; c != 3; ++c) EXPECT_NEAR(found[c], expected[c], 1e-4f * expected[c]) << row << column;
    }
}

TEST(ClearSky, RefusesWhatIsOutsideOfItsRange) {
  for (const float turbidity : {0.9f, 11.0f, NAN}) EXPECT_THROW(skyAt(38, turbidity), Error) << turbidity;
  EXPECT_THROW(skyAt(38, 2, -1), Error);
  ClearSky::Options options;
  options.sun = {};
  EXPECT_THROW(ClearSky{options}, Error);
  options = {};
  options.groundAlbedo.y = 1.5f;
  EXPECT_THROW(ClearSky{options}, Error);
  EXPECT_THROW(ClearSky().map(3), Error);
}

}  // namespace
}  // namespace nephele

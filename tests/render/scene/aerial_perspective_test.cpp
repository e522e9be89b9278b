#include "nephele/render/scene/aerial_perspective.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "nephele/modeling/base/error.h"
#include "nephele/render/scene/lights.h"

namespace nephele {
namespace {

ClearSky skyAt(float elevation, float height = 1000) {
  ClearSky::Options options;
  options.sun = directionTowards(90, elevation);
  options.height = height;
  return ClearSky(options);
}

TEST(AirBefore, TakesAsMuchAsItsDensitySays) {
  // Level, over 5 km, of which the earth's roundness lifts the end by 2 m: the extinction of air, haze (of
  // turbidity 2: as much as all air above the ground, in a layer of 1.2 km) and no ozone, at 1 km.
  const double air = 13.558e-3 * std::exp(-1.0 / 8), haze = 13.558e-3 * 8 / 1.2 * std::exp(-1 / 1.2);
  const ClearSky::Air before = skyAt(38).airBefore({1, 0, 0}, 5000);
  EXPECT_NEAR(before.left.y, std::exp(-(air + haze) * 5), 2e-3);
}

TEST(AirBefore, IsNothingAtHandAndTheSkyFarAway) {
  const ClearSky sky = skyAt(38);
  const ClearSky::Air none = sky.airBefore({0, 0, 1}, 0);
  EXPECT_EQ(none.left, (Vec3f{1, 1, 1}));
  EXPECT_EQ(none.light, Vec3f{});
  const Vec3f way = directionTowards(0, 20);
  const ClearSky::Air all = sky.airBefore(way, 1e7f);
  const Vec3f radiance = sky.radiance(way);
  for (int c = 0; c != 3; ++c) EXPECT_NEAR(all.light[c], radiance[c], 1e-5f);
  EXPECT_THROW(sky.airBefore(way, -1), Error);
}

TEST(AirBefore, TurnsWithItsSun) {
  const Vec3f way = directionTowards(20, 10), turned = directionTowards(75, 10);
  const ClearSky::Air before = skyAt(20).airBefore(way, 3000),
                      after = skyAt(20).turned(55).airBefore(turned, 3000);
  for (int c = 0; c != 3; ++c) EXPECT_NEAR(before.light[c], after.light[c], 1e-5f);
}

Image pictureOf(int width, int height, float depth) {
  Image image;
  image.width = width;
  image.height = height;
  for (const char* name : {"R", "G", "B", "A"}) image.add(name);
  for (const char* name : {"Z_mean", "light_sun.R", "light_sun.G", "light_sun.B"}) image.add(name, false);
  for (std::size_t i = 0; i != std::size_t(width * height); ++i) {
    // Nothing in the last pixel.
    const bool isThere = i + 1 != std::size_t(width * height);
    for (const char* name : {"R", "G", "B", "light_sun.R", "light_sun.G", "light_sun.B"})
      const_cast<Image::Channel*>(image.find(name))->values[i] = isThere ? 0.5f : 0.0f;
    const_cast<Image::Channel*>(image.find("A"))->values[i] = isThere ? 0.8f : 0.0f;
    const_cast<Image::Channel*>(image.find("Z_mean"))->values[i] =
        isThere ? depth * (1 + 0.2f * float(i % std::size_t(width)) / float(width))
                : std::numeric_limits<float>::infinity();
  }
  return image;
}

Camera camera(int width, int height) {
  return Camera::lookingAt({0, 0, 10}, {0, 0, 0}, {0, 1, 0}, {.width = width, .height = height});
}

TEST(AddAir, DoesWithEveryPixelWhatTheAirBeforeItDoes) {
  constexpr int width = 50, height = 37;
  const Image before = pictureOf(width, height, 10);
  Image after = before;
  const AerialPerspective air{skyAt(15), 800, 0.7f};
  addAir(after, camera(width, height), air);
  for (int y = 0; y < height; y += 6)
    for (int x = 0; x < width - 1; x += 7) {
      const Ray ray = camera(width, height).ray(x + 0.5, y + 0.5);
      const double cosine = dot(ray.direction, camera(width, height).forward());
      const ClearSky::Air expected = air.sky.airBefore(
          Vec3f(ray.direction), float(double(before.at("Z_mean", x, y)) / cosine) * air.metresPerUnit);
      const char* names[] = {"R", "G", "B"};
      for (int c = 0; c != 3; ++c) {
        const float light = 0.8f * 0.7f * expected.light[c], left = 0.5f * expected.left[c];
        const std::string name = names[c];
        EXPECT_NEAR(after.at(name, x, y), left + light, 2e-3f);
        EXPECT_NEAR(after.at("light_sun." + name, x, y), left, 2e-3f);
        EXPECT_NEAR(after.at("light_air." + name, x, y), light, 2e-3f);
      }
      EXPECT_EQ(after.at("A", x, y), 0.8f);
    }
  EXPECT_EQ(after.at("R", width - 1, height - 1), 0);
  EXPECT_EQ(after.at("light_air.R", width - 1, height - 1), 0);
}

TEST(AddAir, HoldsFromHereToTheHorizon) {
  constexpr int width = 64, height = 4;
  Image image = pictureOf(width, height, 1);
  std::vector<float> depths;
  for (int i = 0; i != width * height; ++i)
    depths.push_back(0.3f * std::exp2(18.0f * float(i % width) / float(width - 1)));
  const_cast<Image::Channel*>(image.find("Z_mean"))->values = depths;
  const AerialPerspective air{skyAt(15), 1, 1};
  addAir(image, camera(width, height), air);
  for (int x = 0; x != width; ++x) {
    const Ray ray = camera(width, height).ray(x + 0.5, 0.5);
    const double cosine = dot(ray.direction, camera(width, height).forward());
    const ClearSky::Air expected =
        air.sky.airBefore(Vec3f(ray.direction), float(double(depths[std::size_t(x)]) / cosine));
    EXPECT_NEAR(image.at("light_air.B", x, 0), 0.8f * expected.light.z, 2e-3f * expected.light.z + 1e-6f)
        << depths[std::size_t(x)];
    EXPECT_NEAR(image.at("light_sun.B", x, 0), 0.5f * expected.left.z, 2e-3f) << depths[std::size_t(x)];
  }
}

TEST(AddAir, RefusesWhatHasNoDepthOrNoLength) {
  Image image = pictureOf(8, 8, 10);
  EXPECT_THROW(addAir(image, camera(8, 8), {skyAt(15), 0}), Error);
  EXPECT_THROW(addAir(image, camera(8, 8), {skyAt(15), 1, -1}), Error);
  std::erase_if(image.channels, [](const Image::Channel& c) { return c.name == "Z_mean"; });
  EXPECT_THROW(addAir(image, camera(8, 8), {skyAt(15)}), Error);
}

}  // namespace
}  // namespace nephele

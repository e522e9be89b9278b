#include "nephele/render/light/detail/sky_parts.h"

#include <gtest/gtest.h>

#include <cmath>

#include "nephele/render/light/detail/harmonics.h"
#include "nephele/render/scene/clear_sky.h"
#include "nephele/render/scene/lights.h"

namespace nephele::detail {
namespace {

std::vector<Vec3f> ways() {
  std::vector<Vec3f> result;
  for (const Ordinate& ordinate : levelSymmetric(6)) result.push_back(ordinate.way);
  return result;
}

// The root mean square of what is missing of a colour, over its mean.
float missing(const SkyParts& parts, const std::vector<Vec3f>& radiance, int colour) {
  double squares = 0, mean = 0;
  for (std::size_t i = 0; i != radiance.size(); ++i) {
    double sum = 0;
    for (std::size_t part = 0; part != parts.values.size(); ++part)
      sum += double(parts.values[part][i]) * double(parts.colours[part][colour]);
    squares += std::pow(sum - double(radiance[i][colour]), 2) / double(radiance.size());
    mean += double(radiance[i][colour]) / double(radiance.size());
  }
  return float(std::sqrt(squares) / mean);
}

void expectNoneIsNegative(const SkyParts& parts) {
  for (const std::vector<float>& values : parts.values)
    for (const float value : values) EXPECT_GE(value, 0);
}

TEST(SkyParts, OneColourIsOnePart) {
  std::vector<Vec3f> radiance;
  for (const Vec3f& way : ways()) radiance.push_back(Vec3f{0.2f, 0.4f, 0.9f} * (1.1f + way.y));
  const SkyParts parts = partsOfSky(radiance);
  ASSERT_EQ(parts.values.size(), 1u);
  for (int c = 0; c != 3; ++c) EXPECT_LT(missing(parts, radiance, c), 1e-5f);
  expectNoneIsNegative(parts);
}

TEST(SkyParts, TwoColoursAreTwoParts) {
  std::vector<Vec3f> radiance;
  for (const Vec3f& way : ways())
    radiance.push_back(Vec3f{0.1f, 0.3f, 0.9f} * (1 + way.y) + Vec3f{0.9f, 0.5f, 0.1f} * (1 - way.x));
  const SkyParts parts = partsOfSky(radiance);
  ASSERT_EQ(parts.values.size(), 2u);
  for (int c = 0; c != 3; ++c) EXPECT_LT(missing(parts, radiance, c), 1e-5f);
  expectNoneIsNegative(parts);
}

TEST(SkyParts, ThreeColoursAreTheirOwnParts) {
  std::vector<Vec3f> radiance;
  for (const Vec3f& way : ways()) radiance.push_back({1 + way.x, 1 + way.y, 1 + way.z});
  const SkyParts parts = partsOfSky(radiance);
  ASSERT_EQ(parts.values.size(), 3u);
  for (int c = 0; c != 3; ++c) EXPECT_LT(missing(parts, radiance, c), 1e-5f);
}

TEST(SkyParts, ClearSkiesAreTwoPartsAtMostByDay) {
  for (const float elevation : {70.0f, 55.0f, 38.0f}) {
    ClearSky::Options options;
    options.sun = directionTowards(90, elevation);
    const ClearSky sky(options);
    std::vector<Vec3f> radiance;
    for (const Vec3f& way : ways()) radiance.push_back(sky.radiance(way));
    const SkyParts parts = partsOfSky(radiance);
    EXPECT_LE(parts.values.size(), 2u) << elevation;
    for (int c = 0; c != 3; ++c) EXPECT_LT(missing(parts, radiance, c), 0.0255f) << elevation;
    for (int c = 0; c != 3; ++c) {
      double sum = 0, expected = 0;
      for (std::size_t i = 0; i != radiance.size(); ++i) {
        expected += double(radiance[i][c]);
        for (std::size_t part = 0; part != parts.values.size(); ++part)
          sum += double(parts.values[part][i]) * double(parts.colours[part][c]);
      }
      EXPECT_NEAR(sum, expected, 1e-5 * expected) << elevation;
    }
    expectNoneIsNegative(parts);
  }
}

TEST(SkyParts, BlackIsOnePart) {
  const SkyParts parts = partsOfSky(std::vector<Vec3f>(48));
  ASSERT_EQ(parts.values.size(), 1u);
  for (const float value : parts.values[0]) EXPECT_EQ(value, 0);
}

}  // namespace
}  // namespace nephele::detail

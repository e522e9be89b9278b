// Nothing is lost and nothing prefers a side: albedo 1 sends out what came in, and a mirrored cloud in a
// mirrored sun looks mirrored.
#include "tests/support/energy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

#include "nephele/render/light/scattered_light.h"
#include "nephele/render/march/raymarch.h"
#include "tests/support/density.h"

namespace nephele {
namespace {

using test::ball;

TEST(Energy, WhatTheSunSendsInComesOut) {
  // A ball that does not absorb: what it takes of the sun (its opacity from there) is what all directions
  // get, summed up over the 48 of a quadrature whose error here is below a thousandth.
  const RenderVolume volume(ball(1.0f, 0.05f));
  const Vec3f towards = normalize(Vec3f{0.4f, 0.7f, 0.5f});
  for (const float depth : {0.05f, 0.3f, 1.0f, 2.0f, 4.0f, 8.0f, 16.0f}) {
    const Medium medium{depth / 0.05f, {1, 1, 1}, Phase()};
    const LitVolume lit(volume, medium, {{{"sun", towards, {1, 1, 1}}}, {}}, {});
    const double share = test::shareThatComesOut(lit, towards, {{}, 2.6f, 40}, 6);
    EXPECT_NEAR(share, 1, 0.01) << depth;
  }
}

// A ball with bumps and an edge a tenth of its radius wide.
RenderVolume bumpy(int voxelsPerRadius) {
  const int n = voxelsPerRadius * 13 / 10 + 2;
  return RenderVolume(test::densityGrid(
      test::voxels(1.0f / float(voxelsPerRadius)), {-n, -n, -n}, {n, n, n}, [](const Vec3f& p) {
        const float bumps = 0.15f * std::sin(7 * p.x + 1) * std::sin(6 * p.y) * std::cos(5 * p.z);
        return std::fmin(std::fmax((1 + bumps - length(p)) / 0.1f + 0.5f, 0.0f), 1.0f);
      }));
}

TEST(Energy, TheSameCloudIsAsBrightAtAnyResolution) {
  // 128 and 256 voxels across, a free path deep and half of one.
  const auto meanOf = [](const RenderVolume& volume, float g, float azimuth) {
    const Medium medium{50, {0.999f, 0.999f, 0.999f}, Phase::henyeyGreenstein(g)};
    const Lights lights{{{"sun", {std::sin(azimuth), 0.6f, std::cos(azimuth)}, {1, 1, 1}}},
                        {0.1f, 0.1f, 0.1f}};
    constexpr int pixels = 60;
    const Camera camera =
        Camera::lookingAt({0, 0.5f, 6}, {}, {0, 1, 0}, {.width = pixels, .height = pixels, .fovDegrees = 26});
    const Image image = renderImage(volume, medium, lights, camera, {}).image;
    const std::vector<float>& red = image.channel("R").values;
    return std::accumulate(red.begin(), red.end(), 0.0) / (pixels * pixels);
  };
  const RenderVolume coarse = bumpy(50), fine = bumpy(100);
  for (const float g : {0.3f, 0.85f})
    for (const float azimuth : {0.5f, 2.0f, 3.0f})
      EXPECT_NEAR(meanOf(coarse, g, azimuth) / meanOf(fine, g, azimuth), 1, 0.02) << g << " " << azimuth;
}

// A cloud, or its mirror image where `side` is -1. Voxels and bricks lie as far to the left of x = 0 as to
// the right of it.
RenderVolume lopsided(float side) {
  return RenderVolume(test::densityGrid(
      {Mat3f::scaling(0.1f), {0.05f, 0.05f, 0.05f}}, {-16, -16, -16}, {15, 15, 15}, [=](const Vec3f& p) {
        const Vec3f q{side * p.x, p.y, p.z};
        const float bumps = 0.3f * std::sin(5 * q.x + 1) * std::sin(4 * q.y);
        return std::fmin(std::fmax((1 + bumps - length(q)) / 0.3f, 0.0f), 1.0f);
      }));
}

TEST(Energy, ScatteredLightIsMirroredWithTheCloud) {
  const auto sentBy = [](float side) {
    const RenderVolume volume = lopsided(side);
    const Vec3f towards{side * 0.5f, 0.6f, 0.4f};
    const LightVolume sun(volume, towards);
    const ScatteredLight light(volume, {15.0f, 0.98f, legendreMoments(Phase::henyeyGreenstein(0.7f))},
                               ScatteredSource::of(sun, towards));
    return std::pair{light.towards({Vec3f{side * 3, 1, 2}, {}}), light.size()};
  };
  const auto [left, size] = sentBy(1);
  const auto [right, same] = sentBy(-1);
  ASSERT_EQ(size.x, same.x);
  float most = 0, off = 0;
  for (std::size_t i = 0; i != left.size(); ++i) {
    const std::size_t x = i % std::size_t(size.x), mirrored = i - x + (std::size_t(size.x) - 1 - x);
    most = std::max(most, left[i]);
    off = std::max(off, std::fabs(left[i] - right[mirrored]));
  }
  EXPECT_GT(most, 0);
  EXPECT_LT(off, 1e-6f * most);
}

TEST(Energy, MirroredCloudsLookMirrored) {
  const RenderVolume left = lopsided(1), right = lopsided(-1);
  const auto pixelOf = [](const RenderVolume& volume, float side, float height) {
    const Lights lights{{{"sun", {side * 0.5f, 0.6f, 0.4f}, {1, 1, 1}}}, {0.2f, 0.2f, 0.2f}};
    const Medium medium{15.0f, {0.98f, 0.98f, 0.98f}, Phase::henyeyGreenstein(0.7f)};
    RenderOptions options;
    options.samples = 1;
    options.aovs = {"light"};
    const Camera camera = Camera::lookingAt({side * 3, 1, 2}, {side * 0.3f, height, 0}, {0, 1, 0},
                                            {.width = 1, .height = 1, .fovDegrees = 1});
    const Image image = renderImage(volume, medium, lights, camera, options).image;
    return std::pair{image.at("light_sun.R", 0, 0), image.at("light_sky.R", 0, 0)};
  };
  for (const float height : {-0.5f, 0.0f, 0.6f}) {
    const auto a = pixelOf(left, 1, height), b = pixelOf(right, -1, height);
    EXPECT_GT(a.first, 0);
    // The march begins its steps anew at faces of bricks, which lie between voxels on one side only.
    EXPECT_NEAR(a.first / b.first, 1, 1e-4f) << height;
    EXPECT_NEAR(a.second / b.second, 1, 1e-4f) << height;
  }
}

}  // namespace
}  // namespace nephele

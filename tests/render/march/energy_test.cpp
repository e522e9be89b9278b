// Nothing is lost and nothing prefers a side: albedo 1 sends out what came in, and a mirrored cloud in a
// mirrored sun looks mirrored.
#include "tests/support/energy.h"

#include <gtest/gtest.h>

#include <cmath>

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

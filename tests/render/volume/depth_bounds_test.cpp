#include "nephele/render/volume/depth_bounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/density.h"

namespace nephele {
namespace {

// Two balls apart from each other, on a lattice that is turned, so that there is emptiness between them.
RenderVolume twoBalls() {
  return RenderVolume(
      test::densityGrid(test::voxels(0.02f), {-50, -50, -50}, {50, 50, 50}, [](const Vec3f& p) {
        const float r = std::min(length(p - Vec3f{-0.5f, 0, 0.3f}), length(p - Vec3f{0.5f, 0.2f, -0.4f}));
        return std::clamp((0.25f - r) / 0.02f, 0.0f, 1.0f);
      }));
}

// Depths at which the line of sight through (x, y) is within one of the balls: by steps of a thousandth.
void expectBounds(const Camera& camera) {
  const RenderVolume volume = twoBalls();
  const DepthBounds bounds(volume, camera, camera.window());
  const PixelBox window = camera.window();
  int met = 0, empty = 0;
  for (int y = window.y0; y < window.y1; ++y)
    for (int x = window.x0; x < window.x1; ++x) {
      empty += bounds.at(x, y).isEmpty();
      for (const double corner : {-0.5, 0.5, 1.5}) {
        const Ray ray = camera.ray(x + corner, y + 1 - corner);
        const double cosine = dot(ray.direction, camera.forward());
        for (double s = 0; s < 6; s += 0.005) {
          const Vec3f p(ray.origin + ray.direction * s);
          const float r = std::min(length(p - Vec3f{-0.5f, 0, 0.3f}), length(p - Vec3f{0.5f, 0.2f, -0.4f}));
          if (r > 0.25f) continue;
          ++met;
          ASSERT_GE(s * cosine, bounds.at(x, y).near) << x << " " << y;
          ASSERT_LE(s * cosine, bounds.at(x, y).far) << x << " " << y;
        }
      }
    }
  EXPECT_GT(met, 0);
  // Not everything: that would be bounds, too.
  EXPECT_GT(empty, window.width() * window.height() / 8);
}

TEST(DepthBounds, HoldWhatAPerspectiveCameraSees) {
  expectBounds(Camera::lookingAt({1, 1, 3}, {0, 0, 0}, {0, 1, 0}, {70, 50, 40}));
}

TEST(DepthBounds, HoldWhatAnOrthographicCameraSees) {
  Camera::Frame frame{70, 50, 40};
  frame.projection = Camera::Projection::orthographic;
  frame.orthographicWidth = 2.4f;
  expectBounds(Camera::lookingAt({2, 1, 2}, {0, 0, 0}, {0, 1, 0}, frame));
}

TEST(DepthBounds, HoldWhatACropSees) {
  Camera::Frame frame{140, 100, 40};
  frame.crop = PixelBox{30, 21, 101, 75};
  expectBounds(Camera::lookingAt({1, 1, 3}, {0, 0, 0}, {0, 1, 0}, frame));
}

TEST(DepthBounds, AreOpenWhereTheVolumeReachesBehindTheCamera) {
  const Camera camera = Camera::lookingAt({-0.5f, 0, 0.3f}, {1, 0, 0}, {0, 1, 0}, {40, 30, 40});
  const DepthBounds bounds(twoBalls(), camera, camera.window());
  const DepthBounds::Range range = bounds.at(0, 0);
  EXPECT_EQ(range.near, 0);
  EXPECT_TRUE(std::isinf(range.far));
}

TEST(DepthBounds, HoldWithCubesInThePlaceOfManyBricks) {
  // A plate of 250 x 250 bricks, more than are projected one by one.
  const RenderVolume volume(test::densityGrid(test::voxels(0.001f), {-999, -999, 0}, {999, 999, 1},
                                              [](const Vec3f&) { return 1.0f; }));
  ASSERT_GT(volume.occupiedBricks().size(), 40000u);
  const Camera camera = Camera::lookingAt({0, 0, 3}, {0, 0, 0}, {0, 1, 0}, {64, 64, 30});
  const DepthBounds bounds(volume, camera, camera.window());
  const DepthBounds::Range range = bounds.at(32, 32);
  EXPECT_LE(range.near, 3.0f - 0.001f);
  EXPECT_GE(range.far, 3.0f);
  EXPECT_GE(range.near, 2.9f);
}

}  // namespace
}  // namespace nephele

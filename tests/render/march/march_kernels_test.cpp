#include "nephele/render/march/march_kernels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "nephele/render/light/light_volume.h"
#include "nephele/render/volume/render_volume.h"
#include "tests/support/density.h"
#include "tests/support/each_target.h"
#include "tests/support/march_scene.h"
#include "tests/support/scalar_march.h"

namespace nephele {
namespace {

LatticeRay through(const Affine& map, const Vec3i& firstBrick, const Vec3f& origin, const Vec3f& direction) {
  return {map(origin) - Vec3f(firstBrick * 8), map.linear * direction};
}

TEST(MarchKernels, AgreeWithTheScalarLoop) {
  const auto grid = test::densityGrid(test::voxels(0.1f), {-20, -20, -20}, {20, 20, 20}, [](const Vec3f& p) {
    return std::fmax(0.0f, std::sin(3 * p.x) * std::cos(4 * p.y) + std::sin(5 * p.z));
  });
  const RenderVolume volume(grid);
  const test::SunColumns sun({volume, {0.3f, 0.8f, 0.4f}});
  const LightVolume& light = sun.light;
  std::vector<float> sky(2 * 5 * 4 * 3);
  for (std::size_t i = 0; i != sky.size(); ++i) sky[i] = 0.5f + 0.4f * std::sin(float(i));
  const Affine toSky{Mat3f::scaling(0.9f), {2, 1.5f, 1}};

  MarchScene scene = test::sceneOf(volume, sun);
  // Three colours of the sun, of which green has none, and of the sky.
  constexpr int kSky = MarchScene::Scattered::kSky;
  scene.scattered = {{sky.data(), 2, {{0, 0}, {0, 2}}},
                     {sky.data() + 2, 2, {{kSky, 0}, {kSky, 1}}},
                     {sky.data(), 1, {{kSky, 2}, {kSky, 2}}}};
  scene.scatteredSize = {5, 4, 2};
  scene.octaves = 5;
  for (int n = 0; n != 5; ++n) scene.attenuation[n] = 1.0f / float(1 + n);
  scene.colours = scene.skyParts = 3;
  scene.step = 0.1f;
  scene.leastStep = 0.0125f;

  std::vector<MarchRay> rays;
  for (int i = 0; i != 300; ++i) {
    const Vec3f direction = normalize(Vec3f{std::sin(i * 1.3f), std::sin(i * 2.1f + 1), std::cos(i * 0.7f)});
    const Vec3f origin =
        Vec3f{std::sin(i * 0.9f), std::cos(i * 1.9f), std::sin(i * 0.4f)} * 0.8f - direction * 1.2f;
    MarchRay ray;
    ray.density = through(grid->worldToIndex(), grid->firstBrick(), origin, direction);
    ray.suns[0] = through(light.worldToLattice(), light.firstBrick(), origin, direction);
    ray.scattered = through(toSky, {}, origin, direction);
    ray.length = 2.5f;
    ray.jitter = 0.3f;
    for (int c = 0; c != 3; ++c)
      for (int n = 0; n != 5; ++n) ray.weight[0][c][n] = 0.1f * float(c + 1) / float(n + 1);
    rays.push_back(ray);
  }
  for (const float extinction : {0.05f, 2.0f, 40.0f}) {
    scene.extinction = extinction;
    std::vector<MarchResult> expected(rays.size());
    test::marchRaysScalar(scene, rays, expected);
    test::forEachTarget([&] {
      std::vector<MarchResult> results(rays.size());
      marchRays(scene, rays, results);
      for (std::size_t i = 0; i != rays.size(); ++i) {
        // The vectors notice only every 64 samples that nothing is left to see.
        const float seen = std::exp(-expected[i].opticalDepth);
        ASSERT_NEAR(std::exp(-results[i].opticalDepth), seen, 1.1e-4f);
        for (int c = 0; c != 3; ++c) ASSERT_NEAR(results[i].sky[c], expected[i].sky[c], 2e-4f);
        ASSERT_EQ(std::isinf(results[i].distance), std::isinf(expected[i].distance));
        if (std::isfinite(results[i].distance)) {
          ASSERT_NEAR(results[i].distance, expected[i].distance, 1e-4f);
        }
        for (int c = 0; c != 3; ++c)
          ASSERT_NEAR(results[i].suns[0][c], expected[i].suns[0][c], 2e-4f) << i << " " << c;
      }
    });
  }
}

// Along a row of bricks longer than what is walked at once, of which some are empty, some constant, and some
// so dense that what is behind them is not seen.
TEST(MarchKernels, GiveARayTheSameInAnyCompany) {
  const auto grid = test::densityGrid(test::voxels(0.1f), {-8, -8, -400}, {8, 8, 400}, [](const Vec3f& p) {
    const float wave = std::sin(0.4f * p.z);
    return wave > 0.9f ? 1.0f : std::fmax(0.0f, wave + 0.3f * std::sin(9 * p.x + 7 * p.y + 5 * p.z));
  });
  const RenderVolume volume(grid);
  const test::SunColumns sun({volume, {0.3f, 0.8f, 0.4f}});
  MarchScene scene = test::sceneOf(volume, sun);
  scene.step = 0.083f;
  scene.leastStep = 0.0125f;
  std::vector<MarchRay> rays;
  for (int i = 0; i != 45; ++i) {
    // Every third runs exactly along the row, every seventh leaves it soon.
    const Vec3f side{std::sin(i * 1.3f), std::sin(i * 2.1f + 1), 0},
        direction = normalize(Vec3f{0, 0, i % 2 ? 1.0f : -1.0f} + side * (i % 3 == 0   ? 0.0f
                                                                          : i % 7 == 0 ? 0.2f
                                                                                       : 0.01f)),
        origin = side * 0.35f + Vec3f{0, 0, i % 2 ? -40.5f : 40.5f};
    MarchRay& ray = rays.emplace_back();
    ray.density = through(grid->worldToIndex(), grid->firstBrick(), origin, direction);
    ray.suns[0] = through(sun.light.worldToLattice(), sun.light.firstBrick(), origin, direction);
    ray.length = 90;
    ray.weight[0][0][0] = 1;
  }
  for (const float extinction : {0.02f, 0.3f, 20.0f}) {
    scene.extinction = extinction;
    std::vector<MarchResult> expected(rays.size());
    test::marchRaysScalar(scene, rays, expected);
    test::forEachTarget([&] {
      std::vector<MarchResult> together(rays.size());
      marchRays(scene, rays, together);
      for (std::size_t i = 0; i != rays.size(); ++i) {
        MarchResult alone;
        marchRays(scene, {&rays[i], 1}, {&alone, 1});
        ASSERT_EQ(alone.opticalDepth, together[i].opticalDepth) << i;
        ASSERT_EQ(alone.suns[0][0], together[i].suns[0][0]) << i;
        ASSERT_EQ(alone.samples, together[i].samples) << i;
        ASSERT_NEAR(std::exp(-alone.opticalDepth), std::exp(-expected[i].opticalDepth), 1.1e-4f) << i;
        ASSERT_NEAR(alone.suns[0][0], expected[i].suns[0][0], 2e-4f) << i;
      }
    });
  }
}

TEST(HoldoutCurve, SeesItsShareOfAMediumInTheSamePlace) {
  // Optical depth m over [2, 4], and a medium of depth n in the same place: of what both stop, 1 - exp(-m -
  // n), the medium's share is n / (m + n), and all of its own opacity is 1 - exp(-n).
  for (const float m : {0.01f, 0.7f, 5.0f})
    for (const float n : {0.02f, 1.0f, 6.0f}) {
      const HoldoutCurve::Knot knots[] = {{2, 0}, {4, m}};
      std::size_t cursor = 0;
      const float expected = n / (m + n) * (1 - std::exp(-m - n)) / (1 - std::exp(-n));
      EXPECT_NEAR(HoldoutCurve({knots, 2}).seen(2, 4, n, cursor), expected, 2e-5f) << m << " " << n;
      cursor = 0;
      // A quarter of it in front, the rest as above with three quarters of the medium behind that.
      const float front = 1 - std::exp(-n / 4), k = 0.75f * n,
                  rest = std::exp(-n / 4) * k / (m + k) * (1 - std::exp(-m - k));
      EXPECT_NEAR(HoldoutCurve({knots, 2}).seen(4.0f / 3, 4, n, cursor), (front + rest) / (1 - std::exp(-n)),
                  2e-5f)
          << m << " " << n;
    }
}

// Parallel rays across the ball of radius 1 about the origin, side by side.
std::vector<MarchRay> raysAcross(const BrickGrid& grid, const LightVolume& light, int count) {
  std::vector<MarchRay> rays;
  for (int i = 0; i != count; ++i) {
    MarchRay& ray = rays.emplace_back();
    const Vec3f origin{-0.9f + 1.8f / float(count) * float(i), 0.1f, 2}, direction{0, 0, -1};
    ray.density = through(grid.worldToIndex(), grid.firstBrick(), origin, direction);
    ray.suns[0] = through(light.worldToLattice(), light.firstBrick(), origin, direction);
    ray.start = 7;
    ray.length = 4;
    ray.weight[0][0][0] = 1;
  }
  return rays;
}

TEST(MarchKernels, EndWithTheStepBehindWhichNothingIsSeenWithRecordsAndWithout) {
  const auto grid = test::ball(1.0f, 0.1f);
  const RenderVolume volume(grid);
  const test::SunColumns sun({volume, {0, 0, 1}});
  MarchScene scene = test::sceneOf(volume, sun);
  scene.step = 0.01f;
  const HoldoutCurve::Knot thin[] = {{8.5f, 0}, {9.0f, 0.4f}}, wall[] = {{8.6f, 0}, {8.6f, 30}};
  std::vector<MarchRay> rays = raysAcross(*grid, sun.light, 60);
  for (std::size_t i = 0; i != rays.size(); ++i) {
    if (i % 3 == 1) rays[i].holdout = {thin, std::size(thin)};
    if (i % 3 == 2) rays[i].holdout = {wall, std::size(wall)};
  }
  for (const float extinction : {0.5f, 8.0f, 20.0f, 400.0f}) {
    scene.extinction = extinction;
    std::vector<MarchResult> expected(rays.size());
    test::marchRaysScalar(scene, rays, expected);
    test::forEachTarget([&] {
      std::vector<MarchResult> recorded(rays.size()), plain(rays.size());
      std::vector<MarchRecord> records(rays.size());
      marchRays(scene, rays, recorded, records);
      marchRays(scene, rays, plain);
      for (std::size_t i = 0; i != rays.size(); ++i) {
        EXPECT_EQ(recorded[i].samples, plain[i].samples) << extinction << " " << i;
        EXPECT_EQ(recorded[i].opticalDepth, plain[i].opticalDepth) << extinction << " " << i;
        EXPECT_EQ(recorded[i].suns[0][0], plain[i].suns[0][0]) << extinction << " " << i;
        EXPECT_EQ(recorded[i].heldOpacity[0], plain[i].heldOpacity[0]) << extinction << " " << i;
        EXPECT_EQ(recorded[i].distance, plain[i].distance) << extinction << " " << i;
        // The scalar loop does not end behind a wall, and ends elsewhere where rounding takes it over the
        // cutoff a step sooner or later.
        if (i % 3 != 2) {
          EXPECT_NEAR(plain[i].samples, expected[i].samples, 1) << extinction << " " << i;
        }
      }
    });
  }
}

TEST(MarchKernels, HoldOutAndRecordAsTheScalarLoopDoes) {
  const auto grid = test::ball(1.0f, 0.1f);
  const RenderVolume volume(grid);
  const test::SunColumns sun({volume, {0, 0, 1}});
  MarchScene scene = test::sceneOf(volume, sun);
  scene.extinction = 1.5f;
  scene.step = 0.05f;
  const HoldoutCurve::Knot knots[] = {{8.5f, 0}, {9.0f, 0.4f}, {9.0f, 0.9f}, {9.3f, 1.0f}};
  std::vector<MarchRay> rays = raysAcross(*grid, sun.light, 40);
  for (std::size_t i = 0; i < rays.size(); i += 2) rays[i].holdout = {knots, std::size(knots)};
  std::vector<MarchResult> expected(rays.size());
  test::marchRaysScalar(scene, rays, expected);
  test::forEachTarget([&] {
    std::vector<MarchResult> results(rays.size()), unrecorded(rays.size());
    std::vector<MarchRecord> records(rays.size());
    marchRays(scene, rays, results, records);
    marchRays(scene, rays, unrecorded);
    for (std::size_t i = 0; i != rays.size(); ++i) {
      EXPECT_EQ(results[i].suns[0][0], unrecorded[i].suns[0][0]);
      EXPECT_EQ(results[i].opticalDepth, unrecorded[i].opticalDepth);
      EXPECT_NEAR(results[i].suns[0][0], expected[i].suns[0][0], 1e-5f);
      const bool isHeld = i % 2 == 0;
      const float opacity = isHeld ? results[i].heldOpacity[0] : 1 - std::exp(-results[i].opticalDepth);
      if (isHeld) {
        EXPECT_NEAR(opacity, expected[i].heldOpacity[0], 1e-5f);
      }
      if (std::isfinite(expected[i].distance)) {
        EXPECT_NEAR(results[i].distance, expected[i].distance, 1e-4f);
      }
      // The record ends with what the result says, its steps one behind the other.
      ASSERT_FALSE(records[i].marks.empty());
      EXPECT_EQ(records[i].marks.back().result.suns[0][0], results[i].suns[0][0]);
      EXPECT_EQ(records[i].marks.back().stepCount, records[i].steps.size());
      EXPECT_NEAR(records[i].steps.empty() ? 0 : records[i].steps.back().opacity, opacity, 1e-5f);
      for (std::size_t k = 1; k < records[i].steps.size(); ++k) {
        EXPECT_GE(records[i].steps[k].begin, records[i].steps[k - 1].end - 1e-4f);
        EXPECT_GE(records[i].steps[k].opacity, records[i].steps[k - 1].opacity);
      }
    }
  });
}

}  // namespace
}  // namespace nephele

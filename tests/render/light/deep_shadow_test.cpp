#include "nephele/render/light/deep_shadow.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "nephele/modeling/base/error.h"
#include "nephele/render/light/light_volume.h"
#include "nephele/render/light/projected_light_volume.h"
#include "nephele/render/march/path_trace.h"
#include "nephele/render/march/raymarch.h"
#include "tests/support/density.h"

namespace nephele {
namespace {

using test::ball;
using test::densityGrid;
using test::voxels;

std::shared_ptr<BrickGrid> smallCloud(int size = 24) {
  return densityGrid(voxels(1.5f / float(size)), {-size, -size, -size}, {size, size, size},
                     [](const Vec3f& p) {
                       const float bumps = 0.3f * std::sin(5 * p.x) * std::sin(4 * p.y) * std::sin(6 * p.z);
                       return std::fmin(std::fmax((1 + bumps - length(p)) / 0.3f, 0.0f), 1.0f);
                     });
}

LocalLight spot() {
  LocalLight light;
  light.name = "spot";
  light.position = {0.5f, 4, 1};
  light.cone = LocalLight::Cone{{-0.5f, -4, -1}, 22, 5};
  return light;
}

Vec3f somewhere(int i, float within) {
  return Vec3f{std::sin(i * 1.3f), std::sin(i * 2.1f + 1), std::cos(i * 0.7f)} * within;
}

TEST(DeepShadow, KeepsTheTransmittanceOfABallWithinItsTolerance) {
  // Way through a unit ball to the light, closed form. Beside the tolerance, half a voxel of the ball's edge.
  const float h = 0.04f, sigma = 2;
  const RenderVolume volume(ball(1.0f, h));
  const DistantLight sun{"sun", {0.3f, 0.8f, 0.4f}, {1, 1, 1}};
  for (const float tolerance : {0.02f, 0.001f}) {
    const DeepShadowMap map(volume, sun, sigma, {tolerance});
    const Vec3f towards = normalize(sun.direction);
    for (int i = 0; i != 300; ++i) {
      const Vec3f p = somewhere(i, 0.52f);
      const float b = dot(p, towards), way = -b + std::sqrt(b * b + 1 - dot(p, p));
      EXPECT_NEAR(std::exp(-map.opticalDepth(p)), std::exp(-sigma * way), tolerance + 0.25f * sigma * h) << i;
    }
  }
}

TEST(DeepShadow, KeepsTheTransmittanceOfLayersWithinItsTolerance) {
  // Density 2 + 2 sin(3 y), the same in x and z: nothing is interpolated but along the way. The integral from
  // y to where the layers end, in closed form; trapezoids of half voxels err by less than 1e-3 of it.
  const RenderVolume volume(densityGrid(voxels(0.05f), {-30, -30, -30}, {30, 30, 30}, [](const Vec3f& p) {
    return std::fabs(p.y) < 1.225f ? 2 + 2 * std::sin(3 * p.y) : 0.0f;
  }));
  const auto exact = [](float y) {
    return 2 * (1.225f - y) - (std::cos(3 * 1.225f) - std::cos(3 * y)) / 1.5f;
  };
  for (const float tolerance : {0.05f, 0.01f, 1e-3f}) {
    const DeepShadowMap map(volume, DistantLight{}, 1.5f, {tolerance});
    double worst = 0;
    for (int i = 0; i != 400; ++i) {
      const float y = 1.2f - 2.3f * float(i) / 400;
      const float column = 1.5f * exact(y);
      worst = std::max(worst,
                       double(std::fabs(std::exp(-map.opticalDepth({0.1f, y, -0.2f})) - std::exp(-column))));
    }
    // The outermost layer ramps to zero within half a voxel: 1.5 * 2 * 0.05 / 8 of optical depth at most.
    EXPECT_LT(worst, double(tolerance) + 0.02);
    if (tolerance == 0.05f) {
      EXPECT_GT(worst, 0.01);
    }
  }
}

TEST(DeepShadow, AgreesWithTheLightVolume) {
  const RenderVolume volume(smallCloud(48));
  const float sigma = 4;
  const DistantLight sun{"sun", {1, 0.7f, 0.4f}, {1, 1, 1}};
  const LightVolume sunVolume(volume, sun.direction);
  const ProjectedLightVolume spotVolume(volume, spot());
  const DeepShadowMap sunMap(volume, sun, sigma, {2e-3f}), spotMap(volume, spot(), sigma, {2e-3f});
  double sunError = 0, spotError = 0;
  for (int i = 0; i != 500; ++i) {
    const Vec3f p = somewhere(i, 0.5f);
    const auto error = [&](const DeepShadowMap& map, float column) {
      return double(std::fabs(std::exp(-map.opticalDepth(p)) - std::exp(-sigma * column))) / 500;
    };
    sunError += error(sunMap, sunVolume.columnDensity(p));
    spotError += error(spotMap, spotVolume.columnDensity(p));
  }
  // On average within the tolerance; where a ray grazes a bump, interpolation between rays a voxel apart,
  // which are not the same ones, adds to it, by the square of the voxel.
  EXPECT_LT(sunError, 2e-3);
  EXPECT_LT(spotError, 2e-3);
}

TEST(DeepShadow, TakesFewerSamplesWhereMoreErrorIsAllowed) {
  const RenderVolume volume(smallCloud());
  const DistantLight sun{"sun", {1, 0.7f, 0.4f}, {1, 1, 1}};
  const auto count = [&](float tolerance) {
    return DeepShadowMap(volume, sun, 4, {tolerance}).sampleCount();
  };
  EXPECT_LT(2 * count(0.02f), count(0.0005f));
}

TEST(DeepShadow, IsEstimatedBeforeItIsMade) {
  const RenderVolume volume(test::ball(1, 0.02f));
  Lights lights{.suns = {DistantLight{}}};
  const Camera camera = Camera::lookingAt({0, 0, 4}, {}, {0, 1, 0}, {8, 8, 40});
  const double without = estimateRenderBytes(volume, lights, camera, {});
  const DeepShadowMap map(volume, lights.suns[0], 4, {2e-3f});
  const double estimate = DeepShadowMap::estimateBytes(volume, lights.suns[0]);
  EXPECT_GE(estimate, double(map.memoryBytes()));
  // A crisp cloud takes more than a ball, but not a hundred times as much.
  EXPECT_LT(estimate, 100 * double(map.memoryBytes()));
  // Columns that a map takes the place of are held as floats until then.
  const double floats =
      LightVolume::estimateBytes(volume, {}) - LightVolume::estimateBytes(volume, {.coded = true});
  EXPECT_GT(floats, 0);
  lights.deepTolerance = 2e-3f;
  EXPECT_DOUBLE_EQ(estimateRenderBytes(volume, lights, camera, {}), without + floats + estimate);
  lights.deepTolerance.reset();
  lights.suns[0].deepShadow = std::make_shared<const DeepShadowMap>(map);
  EXPECT_DOUBLE_EQ(estimateRenderBytes(volume, lights, camera, {}),
                   without + floats + double(map.memoryBytes()));
}

TEST(DeepShadow, GoesThroughAFile) {
  const RenderVolume volume(smallCloud());
  const auto path = std::filesystem::temp_directory_path() / "nephele_deep_shadow_test.exr";
  const DistantLight sun{"sun", {1, 0.7f, 0.4f}, {1, 1, 1}};
  for (const DeepShadowMap& map :
       {DeepShadowMap(volume, sun, 4, {2e-3f}), DeepShadowMap(volume, spot(), 4, {2e-3f})}) {
    map.write(path.string());
    const DeepShadowMap read = DeepShadowMap::read(path.string());
    // Opacities are 16 bit floats already; matrices are 32 bit in both.
    for (int i = 0; i != 200; ++i)
      ASSERT_FLOAT_EQ(read.opticalDepth(somewhere(i, 0.6f)), map.opticalDepth(somewhere(i, 0.6f)));
    EXPECT_THROW(read.write(path.string()), Error);
  }
  std::filesystem::remove(path);
  EXPECT_THROW(DeepShadowMap::read(path.string()), Error);
}

TEST(DeepShadow, LightsAPictureAsTheVolumeDoes) {
  const RenderVolume volume(smallCloud());
  const Camera camera = Camera::framing(volume.outline(), 25, 15, {24, 20, 35});
  Lights lights{{{"sun", {1, 0.7f, 0.4f}, {2, 2, 2}}}, {}, {spot()}};
  lights.locals[0].intensity = {20, 20, 20};
  const Medium cloud{4, {0.95f, 0.95f, 0.95f}};
  const Image plain = renderImage(volume, cloud, lights, camera).image;
  lights.deepTolerance = 2e-3f;
  const Image deep = renderImage(volume, cloud, lights, camera).image;
  for (int y = 0; y != 20; ++y)
    for (int x = 0; x != 24; ++x)
      // As far apart as the transmittances may be, of a pixel's light.
      ASSERT_NEAR(deep.at("R", x, y), plain.at("R", x, y), 0.02f * plain.at("R", x, y) + 1e-3f)
          << x << " " << y;
  // A map that was made for nothing casts no shadow: single scattering of a sun is brighter without.
  RenderOptions once;
  once.octaves.count = 1;
  Lights sun{{lights.suns[0]}, {}};
  const float shaded = renderImage(volume, cloud, sun, camera, once).image.at("R", 12, 10);
  sun.suns[0].deepShadow =
      std::make_shared<const DeepShadowMap>(volume, sun.suns[0], 0.0f, DeepShadowMap::Options{});
  const float bright = renderImage(volume, cloud, sun, camera, once).image.at("R", 12, 10);
  EXPECT_GT(bright, 1.5f * shaded);
  // So it is for paths, with noise: five standard errors of 4000 of them that weigh much the same.
  PathOptions paths;
  paths.samplesPerPixel = 4000;
  paths.maxScatterings = 1;
  EXPECT_NEAR(pathTraceImage(volume, cloud, sun, camera, paths).image.at("R", 12, 10), bright,
              0.04f * bright);
}

TEST(DeepShadow, RefusesLightsThatItWasNotMadeFor) {
  const RenderVolume volume(ball(1, 0.1f));
  DistantLight sun{"sun", {1, 0.7f, 0.4f}, {1, 1, 1}};
  LocalLight lamp;
  lamp.position = {0, 5, 0.5f};
  const DeepShadowMap ofSun(volume, sun, 4, {2e-3f}), ofLamp(volume, lamp, 4, {2e-3f});
  // Rounded, and of another length.
  sun.direction = sun.direction * 3.00001f;
  lamp.position.x += 1e-6f;
  EXPECT_NO_THROW(ofSun.requireMadeFor(sun, "a.exr"));
  EXPECT_NO_THROW(ofLamp.requireMadeFor(lamp, "a.exr"));
  sun.direction.x = 2;
  lamp.position.x = 1;
  EXPECT_THROW(ofSun.requireMadeFor(sun, "a.exr"), Error);
  EXPECT_THROW(ofLamp.requireMadeFor(lamp, "a.exr"), Error);
}

TEST(DeepShadow, RefusesWhatItCannotSee) {
  const RenderVolume volume(ball(1, 0.1f));
  LocalLight inside;
  EXPECT_THROW(DeepShadowMap(volume, inside, 1, {}), Error);
  EXPECT_THROW(DeepShadowMap(volume, DistantLight{}, 1, {0}), Error);
  EXPECT_THROW(DeepShadowMap(volume, DistantLight{}, -1, {}), Error);
  EXPECT_THROW(DeepShadowMap(volume, DistantLight{"sun", {0, 0, 0}, {}}, 1, {}), Error);
  EXPECT_THROW(DeepShadowMap::read("/nowhere/map.exr"), Error);
  const RenderVolume empty(densityGrid(voxels(1), {0, 0, 0}, {3, 3, 3}, [](const Vec3f&) { return 0.0f; }));
  EXPECT_EQ(DeepShadowMap(empty, DistantLight{}, 1, {}).opticalDepth({1, 1, 1}), 0.0f);
}

}  // namespace
}  // namespace nephele

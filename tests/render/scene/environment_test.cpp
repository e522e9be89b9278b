#include "nephele/render/scene/environment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "nephele/modeling/base/error.h"
#include "nephele/render/light/light_volume.h"
#include "nephele/render/march/path_trace.h"
#include "nephele/render/march/raymarch.h"
#include "tests/support/density.h"
#include "tests/support/test_data.h"

namespace nephele {
namespace {

using test::ball;
using test::densityGrid;
using test::voxels;

Environment constantMap(const Vec3f& radiance, int height = 16) {
  return {2 * height, height, std::vector<Vec3f>(std::size_t(2 * height * height), radiance)};
}

// A smooth sky that is brighter above and to one side, with a sun if `sun` is not 0.
Environment daySky(float sun, int height = 64) {
  std::vector<Vec3f> radiance;
  for (int y = 0; y != height; ++y)
    for (int x = 0; x != 2 * height; ++x) {
      const float up = std::cos(kPi * (float(y) + 0.5f) / float(height));
      const float azimuth = 2 * kPi * (0.5f - (float(x) + 0.5f) / float(2 * height));
      const float base = 0.6f + 0.3f * up + 0.2f * std::cos(azimuth) * std::sqrt(1 - up * up);
      const bool inSun = y == height / 4 && x == height / 2;
      radiance.push_back(Vec3f{0.5f, 0.8f, 1.0f} * base + (inSun ? Vec3f{sun, sun, sun} : Vec3f{}));
    }
  return {2 * height, height, std::move(radiance)};
}

Lights skyOf(const Environment& map) {
  Lights lights;
  lights.map = std::make_shared<const Environment>(map);
  return lights;
}

Medium medium(float extinction, float albedo, const Phase& phase = {}) {
  return {extinction, {albedo, albedo, albedo}, phase};
}

std::shared_ptr<BrickGrid> smallCloud() {
  return densityGrid(voxels(0.0625f), {-24, -24, -24}, {24, 24, 24}, [](const Vec3f& p) {
    const float bumps = 0.3f * std::sin(5 * p.x) * std::sin(4 * p.y) * std::sin(6 * p.z);
    return std::fmin(std::fmax((1 + bumps - length(p)) / 0.3f, 0.0f), 1.0f);
  });
}

// Neighbouring pixels of this map differ by up to 1, by the pole as well as across the seam; half a degree is
// a ninetieth of a pixel of 45 degrees, and a B-spline's slope is at most 2/3 per pixel and axis.
TEST(Environment, LookedAtSmoothlyHasNoEdges) {
  constexpr int kWidth = 8, kHeight = 4;
  std::vector<Vec3f> values;
  std::uint32_t state = 1;
  for (int i = 0; i != kWidth * kHeight; ++i) {
    state = state * 1664525u + 1013904223u;
    values.push_back(Vec3f{1, 1, 1} * (float(state >> 8) / float(1 << 24)));
  }
  const Environment sky(kWidth, kHeight, values, {.rotationDegrees = 30});
  const auto at = [&](double azimuth, double polar) {
    const double a = azimuth * M_PI / 180, p = polar * M_PI / 180;
    return double(sky.smoothRadiance(Vec3f{float(std::sin(a) * std::sin(p)), float(std::cos(p)),
                                           float(std::cos(a) * std::sin(p))})
                      .x);
  };
  double mostSmooth = 0;
  for (double azimuth = 0; azimuth < 360; azimuth += 7.3) {
    // Through the upper pole to the other side, and round once.
    for (double polar = 0.25; polar < 60; polar += 0.5)
      mostSmooth = std::max(mostSmooth, std::fabs(at(azimuth, polar) - at(azimuth, polar + 0.5)));
    mostSmooth = std::max(mostSmooth, std::fabs(at(azimuth, 0.25) - at(azimuth + 180, 0.25)));
    for (const double polar : {5.0, 45.0, 90.0, 140.0})
      mostSmooth = std::max(mostSmooth, std::fabs(at(azimuth, polar) - at(azimuth + 0.5, polar)));
  }
  EXPECT_LT(mostSmooth, 0.03);
  const Environment even(kWidth, kHeight, std::vector<Vec3f>(kWidth * kHeight, {0.3f, 0.4f, 0.5f}));
  for (const float y : {-1.0f, -0.2f, 0.9f, 1.0f})
    EXPECT_NEAR(even.smoothRadiance({0.1f, y, 0.2f}).y, 0.4f, 1e-6f);
}

TEST(Environment, LooksUpWhereOpenExrPutsDirections) {
  // Rows from +y down; the middle column is +z, the right quarter -x, the left one +x.
  std::vector<Vec3f> radiance(8 * 4);
  for (int i = 0; i != 32; ++i) radiance[std::size_t(i)] = {float(i % 8), float(i / 8), 0};
  const Environment map(8, 4, radiance);
  EXPECT_EQ(map.radiance({0.01f, 1, 0.01f}).y, 0);
  EXPECT_EQ(map.radiance({0, -1, 0}).y, 3);
  EXPECT_EQ(map.radiance({-0.1f, 0.1f, 1}).x, 4);
  EXPECT_EQ(map.radiance({0.1f, 0.1f, 1}).x, 3);
  EXPECT_EQ(map.radiance({-1, 0.1f, 0.1f}).x, 5);
  EXPECT_EQ(map.radiance({1, 0.1f, 0.1f}).x, 2);
  // Turned by 90 degrees, what was at +z is at +x.
  EXPECT_EQ(map.turned(90).radiance({1, 0.1f, -0.1f}).x, map.radiance({0.1f, 0.1f, 1}).x);
  EXPECT_EQ(map.turned(360), map);
}

TEST(Environment, DrawsDirectionsInProportionToLuminance) {
  // The mean of radiance / density over drawn directions is the integral of radiance, 4 pi times the mean.
  const Environment map = daySky(50);
  Vec3d sum;
  std::uint32_t state = 1;
  const auto next = [&] {
    state = state * 1664525u + 1013904223u;
    return float(state >> 8) * 0x1p-24f;
  };
  constexpr int n = 200000;
  for (int i = 0; i != n; ++i) {
    const float a = next(), b = next(), c = next();
    const Environment::Sample sample = map.sample(a, b, c, next());
    ASSERT_NEAR(length(sample.towards), 1, 1e-5f);
    ASSERT_NEAR(map.density(sample.towards), sample.density, 2e-3f * sample.density + 1e-4f) << i;
    sum += Vec3d(map.radiance(sample.towards)) / double(sample.density) / double(n);
  }
  for (int c = 0; c != 3; ++c) EXPECT_NEAR(sum[c] / (4 * double(kPi)), map.mean()[c], 0.01) << c;
}

TEST(Environment, MeanIsThatOfItsFormula) {
  // Cosines of the azimuth and of the way up cancel over the sphere: 0.6 is left.
  const Environment map = daySky(0);
  EXPECT_NEAR(map.mean().z, 0.6f, 1e-3f);
  EXPECT_NEAR(map.mean().x, 0.3f, 1e-3f);
}

TEST(Environment, LosesNothingAroundItsDirections) {
  std::vector<Vec3f> towards;
  for (int i = 0; i != 24; ++i) {
    const float y = 1 - (2 * float(i) + 1) / 24, r = std::sqrt(1 - y * y), a = 2.39996323f * float(i);
    towards.push_back({r * std::cos(a), y, r * std::sin(a)});
  }
  const Environment map = daySky(80);
  Vec3f sum;
  for (const Vec3f& value : map.around(towards)) sum += value / 24.0f;
  for (int c = 0; c != 3; ++c) EXPECT_NEAR(sum[c], map.mean()[c], 1e-4f);
  for (const Vec3f& value : constantMap({1, 2, 3}).around(towards)) EXPECT_NEAR(value.y, 2, 1e-5f);
}

TEST(Environment, TakesItsSunAwayAndKeepsTheLight) {
  const Environment whole = daySky(2000);
  Environment rest = whole;
  const std::vector<DistantLight> suns = rest.takeSpots(4);
  ASSERT_EQ(suns.size(), 1u);
  EXPECT_GT(dot(normalize(suns[0].direction), whole.sample(0.5f, 0.5f, 0.5f, 0.5f).towards), 0.999f);
  for (int c = 0; c != 3; ++c)
    EXPECT_NEAR(rest.mean()[c] + suns[0].irradiance[c] / (4 * kPi), whole.mean()[c], 1e-3f);
  EXPECT_NEAR(rest.mean().z, 0.6f, 0.01f);
  Environment even = daySky(0);
  EXPECT_TRUE(even.takeSpots(4).empty());
}

TEST(Environment, OfOneColourIsTheConstantSky) {
  const RenderVolume volume(smallCloud());
  const Camera camera = Camera::framing(volume.outline(), 25, 15, {16, 12, 35});
  const Vec3f radiance{0.2f, 0.5f, 1.5f};
  const Medium cloud = medium(6, 0.97f, Phase::henyeyGreenstein(0.3f));
  const Image sky = renderImage(volume, cloud, {{}, radiance}, camera).image;
  const Image map = renderImage(volume, cloud, skyOf(constantMap(radiance)), camera).image;
  for (const char* c : {"R", "G", "B"})
    for (int y = 0; y != 12; ++y)
      for (int x = 0; x != 16; ++x)
        // The iteration for the light ends at 1.5e-3 of it.
        ASSERT_NEAR(map.at(c, x, y), sky.at(c, x, y), 2e-3f * sky.at(c, x, y) + 1e-6f);
}

// A map takes a light volume for each spot that it has, not for each that it might have.
TEST(Environment, SpotsAreWhatMemoryIsEstimatedFor) {
  const RenderVolume volume(smallCloud());
  const Camera camera = Camera::framing(volume.outline(), 30, 20, {16, 12, 35});
  const auto bytesFor = [&](const Environment& map) {
    return estimateRenderBytes(volume, skyOf(map), camera, {});
  };
  std::vector<Vec3f> pixels(64 * 32, Vec3f{1, 1, 1});
  const double even = bytesFor(Environment(64, 32, pixels));
  pixels[10 * 64 + 20] = {5000, 5000, 5000};
  const double oneSpot = bytesFor(Environment(64, 32, pixels)) - even;
  const double light = LightVolume::estimateBytes(volume, {.coded = true});
  EXPECT_GT(oneSpot, light);
  // Beside it, what scatters of it.
  EXPECT_LT(oneSpot, light + 0.5 * even);
}

TEST(Environment, FurnaceIsAsBrightAsItsMapWhereItIsOpaque) {
  // Nothing absorbs: what leaves is alpha times the sky. The two ways to the sky add up to it on average,
  // with a standard error of 0.3 %.
  const RenderVolume volume(smallCloud());
  const Camera camera = Camera::framing(volume.outline(), 30, 20, {16, 12, 35});
  PathOptions paths;
  paths.samplesPerPixel = 1000;
  const Image image = pathTraceImage(volume, medium(8, 1, Phase::henyeyGreenstein(0.5f)),
                                     skyOf(constantMap({0.5f, 1, 2})), camera, paths)
                          .image;
  double light = 0, alpha = 0;
  for (int y = 0; y != 12; ++y)
    for (int x = 0; x != 16; ++x) light += image.at("G", x, y), alpha += image.at("A", x, y);
  EXPECT_NEAR(light / alpha, 1, 0.01);
}

TEST(Environment, MarcherAgreesWithThePathTracerUnderASkyWithASun) {
  const RenderVolume volume(smallCloud());
  const Camera camera = Camera::framing(volume.outline(), 25, 15, {12, 10, 35});
  const Medium cloud = medium(12, 0.98f);
  for (const float sun : {0.0f, 1500.0f}) {
    const Lights lights = skyOf(daySky(sun));
    PathOptions paths;
    paths.samplesPerPixel = 250;
    paths.aovs = {"light"};
    RenderOptions options;
    options.aovs = {"light"};
    const Image marched = renderImage(volume, cloud, lights, camera, options).image;
    const Image traced = pathTraceImage(volume, cloud, lights, camera, paths).image;
    for (const char* name : {"light_sky.R", "light_sky.B"}) {
      double a = 0, b = 0;
      for (int y = 0; y != 10; ++y)
        for (int x = 0; x != 12; ++x) a += marched.at(name, x, y), b += traced.at(name, x, y);
      // As for a constant sky and a sun: mean luminance within 5 %; noise of 1 %.
      EXPECT_NEAR(a, b, 0.06 * b) << name << " " << sun;
    }
  }
}

TEST(Environment, ReadsTheMapsOfCameras) {
  for (const char* name : {"env/kerner_env_latlong.exr", "env/kloppenheim_05_1k.hdr"}) {
    const std::string path = test::sharedData(name);
    NEPHELE_REQUIRE_SHARED_DATA(path);
    const Environment map = Environment::read(path);
    const Vec3f mean = map.mean();
    EXPECT_GT(mean.x, 0.05f) << name;
    EXPECT_LT(mean.x, 10.0f) << name;
    EXPECT_NEAR(Environment::read(path, {0, 2}).mean().y, 2 * mean.y, 1e-4f * mean.y);
  }
}

TEST(Environment, RefusesWhatIsNoMap) {
  EXPECT_THROW(Environment(3, 2, std::vector<Vec3f>(6)), Error);
  EXPECT_THROW(Environment(4, 2, std::vector<Vec3f>(6)), Error);
  EXPECT_THROW(Environment(2, 1, {{NAN, 0, 0}, {}}), Error);
  EXPECT_THROW(Environment(2, 1, {{}, {}}, {0, -1}), Error);
  EXPECT_THROW(Environment(2, 1, {{3e38f, 0, 0}, {}}, {0, 10}), Error);
  EXPECT_TRUE(Environment(2, 1, {{1, 1, 1}, {}}).around({}).empty());
  EXPECT_THROW(Environment(2, 1, {{}, {}}, {INFINITY, 1}), Error);
  EXPECT_THROW(Environment::read("/nowhere/sky.exr"), Error);
  const auto path = std::filesystem::temp_directory_path() / "nephele_environment_test.hdr";
  std::ofstream(path) << "#?RADIANCE\n\n-Y 2 +X 4\nxx";
  try {
    Environment::read(path.string());
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find(path.string()), std::string::npos);
  }
  std::filesystem::remove(path);
}

TEST(Environment, IsBlackWhereItsMapIs) {
  const Environment map = constantMap({});
  EXPECT_EQ(map.mean(), Vec3f{});
  EXPECT_EQ(map.density({0, 1, 0}), 0);
  const RenderVolume volume(ball(1, 0.1f));
  const Camera camera = Camera::framing(volume.outline(), 25, 15, {4, 4, 35});
  EXPECT_EQ(renderImage(volume, medium(2, 1), skyOf(map), camera).image.at("R", 2, 2), 0.0f);
  EXPECT_EQ(pathTraceImage(volume, medium(2, 1), skyOf(map), camera).image.at("R", 2, 2), 0.0f);
}

}  // namespace
}  // namespace nephele

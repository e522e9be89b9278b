#include "nephele/render/march/raymarch.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/render/march/path_trace.h"
#include "tests/support/density.h"
#include "tests/support/each_target.h"

namespace nephele {
namespace {

using test::ball;
using test::densityGrid;
using test::slab;
using test::voxels;

constexpr float kFourPi = 4 * kPi;

// A camera with a single, nearly parallel pixel that looks from `position` at `target`.
Camera needle(const Vec3f& position, const Vec3f& target) {
  return Camera::lookingAt(position, target, std::fabs(position.y) > 4 ? Vec3f{1, 0, 0} : Vec3f{0, 1, 0},
                           {1, 1, 0.001f});
}

Medium medium(float extinction, float albedo = 1.0f) {
  return {extinction, {albedo, albedo, albedo}, Phase()};
}

RenderOptions single(float step = 0) {
  RenderOptions options;
  options.octaves.count = 1;
  options.samples = 1;
  if (step > 0) options.step = step;
  return options;
}

Lights sun(const Vec3f& towards, float irradiance = 1.0f) {
  return {{{"sun", towards, Vec3f{1, 1, 1} * irradiance}}, {}};
}

float alphaOf(const RenderVolume& volume, float extinction, const Camera& camera,
              const RenderOptions& options) {
  return renderImage(volume, medium(extinction), {}, camera, options).image.at("A", 0, 0);
}

TEST(Raymarch, SlabTransmitsByBeersLaw) {
  // 21 voxels, seen straight and at 30 degrees: T = exp(-sigma thickness / cos).
  const RenderVolume volume(slab(2.1f, 6.0f, 0.1f, 0.5f));
  for (const float sigma : {0.1f, 1.0f, 4.0f}) {
    EXPECT_NEAR(alphaOf(volume, sigma, needle({0, 0, 9}, {0, 0, 0}), single()),
                1 - std::exp(-0.5f * sigma * 2.1f), 1e-4f);
    // Slanted steps do not fall in with the voxels: a sharp face, sampled once per voxel, is found within an
    // eighth of one.
    const float slanted = 0.5f * sigma * 2.1f / 0.8660254f;
    EXPECT_NEAR(alphaOf(volume, sigma, needle({5, 0, 8.660254f}, {0, 0, 0}), single()),
                1 - std::exp(-slanted), std::exp(-slanted) * 0.5f * sigma * 0.1f / 8);
  }
}

TEST(Raymarch, SphereHasTheSameOpacityAtEveryVoxelSize) {
  // 1 - exp(-2 r sigma), within 1 %.
  for (const float sigma : {0.3f, 1.0f}) {
    const float exact = 1 - std::exp(-2 * sigma);
    for (const float h : {0.1f, 0.05f, 0.025f}) {
      const RenderVolume volume(ball(1.0f, h));
      EXPECT_NEAR(alphaOf(volume, sigma, needle({0, 0, 9}, {0, 0, 0}), single()) / exact, 1, 0.01) << h;
      EXPECT_NEAR(alphaOf(volume, sigma, needle({4, 3, 7}, {0, 0, 0}), single()) / exact, 1, 0.01) << h;
    }
  }
}

TEST(Raymarch, SphereTransmitsByItsChord) {
  const RenderVolume volume(ball(1.0f, 0.05f));
  for (const float offset : {0.0f, 0.3f, 0.6f, 0.9f}) {
    const float chord = 2 * std::sqrt(1 - offset * offset);
    EXPECT_NEAR(alphaOf(volume, 0.7f, needle({offset, 0, 9}, {offset, 0, 0}), single()),
                1 - std::exp(-0.7f * chord), 0.01f);
  }
}

TEST(Raymarch, OpacityDoesNotDependOnTheStep) {
  const RenderVolume volume(ball(1.0f, 0.05f));
  const Camera camera = needle({3, 2, 8}, {0.1f, 0.2f, 0});
  const float fine = alphaOf(volume, 1.5f, camera, single(0.002f));
  // Up to two voxels, longer than which the ball's edge is not seen.
  for (const float step : {0.1f, 0.05f, 0.01f})
    EXPECT_NEAR(alphaOf(volume, 1.5f, camera, single(step)), fine, 2e-3f) << step;
}

TEST(Raymarch, TakesLongerStepsWhereRaysShareAPixel) {
  // Pixels as wide as voxels in front and not 1.5 of them behind, and no brick of one value: two thirds of
  // the samples that steps of a voxel take, and what does not fill a step, for the same picture.
  const RenderVolume volume(densityGrid(voxels(0.05f), {-20, -20, -20}, {20, 20, 20}, [](const Vec3f& p) {
    return 0.5f + 0.1f * (std::sin(0.5f * p.x) + std::sin(0.6f * p.y) + std::sin(0.7f * p.z));
  }));
  Camera::Frame frame;
  frame.width = frame.height = 100;
  const auto lookFrom = [&] { return Camera::lookingAt({0, 0, 6}, {0, 0, 0}, {0, 1, 0}, frame); };
  frame.width = frame.height = int(100 * lookFrom().pixelWidth(5) / 0.05);
  RenderOptions options;
  options.octaves.count = 1;
  options.samples = 4;
  const auto look = [&] { return renderImage(volume, medium(4), sun({0, 1, 0}), lookFrom(), options); };
  const RenderResult own = look();
  options.step = 0.05f;
  const RenderResult voxels = look();
  EXPECT_LT(double(own.samples), 0.75 * double(voxels.samples));
  EXPECT_GT(double(own.samples), 0.6 * double(voxels.samples));
  double sums[2] = {};
  for (int y = 0; y != frame.height; ++y)
    for (int x = 0; x != frame.width; ++x)
      sums[0] += double(own.image.at("R", x, y)), sums[1] += double(voxels.image.at("R", x, y));
  EXPECT_NEAR(sums[0] / sums[1], 1.0, 0.003);
}

TEST(Raymarch, SlabScattersOnceAsInTheClosedForm) {
  // Sun on the viewer's side at mu0: L = albedo E / (4 pi) (1 - exp(-tau (1 + 1 / mu0))) / (1 + 1 / mu0).
  const RenderVolume volume(slab(2.1f, 8.0f, 0.1f));
  for (const float sigma : {0.2f, 1.0f, 3.0f})
    for (const float mu : {1.0f, 0.6f}) {
      const float tau = 2.1f * sigma, k = 1 + 1 / mu;
      const float exact = 0.9f * 2 / kFourPi * (1 - std::exp(-tau * k)) / k;
      const Lights lights = sun({std::sqrt(1 - mu * mu), 0, mu}, 2);
      const Image image =
          renderImage(volume, medium(sigma, 0.9f), lights, needle({0, 0, 9}, {0, 0, 0}), single()).image;
      EXPECT_NEAR(image.at("R", 0, 0) / exact, 1, 0.01) << sigma << " " << mu;
      EXPECT_EQ(image.at("R", 0, 0), image.at("B", 0, 0));
    }
}

TEST(Raymarch, SlabLetsLightThroughAsInTheClosedForm) {
  // Sun behind at mu: L = E / (4 pi) (exp(-tau) - exp(-tau / mu)) / (1 / mu - 1).
  const RenderVolume volume(slab(2.1f, 8.0f, 0.1f));
  const float mu = 0.6f, tau = 1.5f * 2.1f;
  const float exact = 1 / kFourPi * (std::exp(-tau) - std::exp(-tau / mu)) / (1 / mu - 1);
  const Image image =
      renderImage(volume, medium(1.5f), sun({0.8f, 0, -0.6f}), needle({0, 0, 9}, {0, 0, 0}), single()).image;
  EXPECT_NEAR(image.at("G", 0, 0) / exact, 1, 0.01);
}

TEST(Raymarch, WeighsTheSunByThePhaseFunction) {
  // Thin slab, so that the radiance is E phase(cos) tau; forward scattering is bright against the sun.
  const RenderVolume volume(slab(2.1f, 8.0f, 0.1f));
  Medium thin = medium(1e-3f);
  thin.phase = Phase::henyeyGreenstein(0.5f);
  for (const float angle : {0.0f, 0.8f, 2.0f, 3.0f}) {
    // Towards the sun, at `angle` from the direction in which the camera looks (-z).
    const Lights lights = sun({std::sin(angle), 0, -std::cos(angle)});
    const Image image = renderImage(volume, thin, lights, needle({0, 0, 9}, {0, 0, 0}), single()).image;
    EXPECT_NEAR(image.at("R", 0, 0) / (thin.phase(std::cos(angle)) * 2.1e-3f), 1, 0.01) << angle;
  }
}

TEST(Raymarch, AddsSunsAndColoursTheirLight) {
  const RenderVolume volume(ball(1.0f, 0.1f));
  const Camera camera = needle({0, 0, 9}, {0, 0, 0});
  Medium coloured = medium(2.0f);
  coloured.albedo = {1.0f, 0.5f, 0.25f};
  const Lights left = sun({-1, 0.2f, 1}, 2), right = sun({1, 0.5f, 0.3f});
  Lights both = left;
  both.suns.push_back(right.suns[0]);
  both.suns[1].name = "sun2";
  const auto red = [&](const Lights& lights, const char* channel) {
    return renderImage(volume, coloured, lights, camera, single()).image.at(channel, 0, 0);
  };
  EXPECT_NEAR(red(both, "R"), red(left, "R") + red(right, "R"), 1e-6f);
  // One scattering: proportional to the albedo.
  EXPECT_NEAR(red(both, "G") / red(both, "R"), 0.5f, 1e-5f);
  EXPECT_NEAR(red(both, "B") / red(both, "R"), 0.25f, 1e-5f);
}

TEST(Raymarch, ScattersInAHalfSpaceNearlyAsTheExactSolution) {
  // Isotropic half space, light and view head on: E / (4 pi) albedo / 2 H(1)^2, H(1) from Chandrasekhar's
  // table XI; single scattering is the same without H. The slab lets exp(-14) through.
  const RenderVolume volume(slab(6.3f, 20.0f, 0.3f));
  const struct { float albedo, h; } cases[] = {{0.5f, 1.2586f}, {0.9f, 1.8501f}};
  for (const auto& c : cases) {
    RenderOptions options = single();
    options.octaves = {};
    const Image image = renderImage(volume, medium(2.2f, c.albedo), sun({0, 0, 1}, kFourPi),
                                    needle({0, 0, 90}, {0, 0, 0}), options)
                            .image;
    EXPECT_NEAR(image.at("R", 0, 0) / (c.albedo / 2 * c.h * c.h), 1, 0.06) << c.albedo;
  }
}

TEST(Raymarch, ScattersAsPathsDo) {
  // A small cloud in sun and sky: mean within 5 %, and regions of 8 x 8 pixels within 15 %, of the path
  // tracer, whose noise there is below 2 %.
  const auto grid = densityGrid(voxels(0.0625f), {-24, -24, -24}, {24, 24, 24}, [](const Vec3f& p) {
    const float bumps = 0.3f * std::sin(5 * p.x) * std::sin(4 * p.y) * std::sin(6 * p.z);
    return std::fmin(std::fmax((1 + bumps - length(p)) / 0.3f, 0.0f), 1.0f);
  });
  const RenderVolume volume(grid);
  const Camera camera = Camera::framing(volume.outline(), 25, 15, {32, 24, 35});
  Medium cloud = medium(12.0f, 0.98f);
  cloud.phase = Phase::henyeyGreenstein(0.3f);
  PathOptions paths;
  paths.samplesPerPixel = 100;
  paths.aovs = {};
  for (const Vec3f& towards : {Vec3f{1, 0.7f, 0.4f}, Vec3f{-0.5f, 0.5f, -1}}) {
    Lights lights = sun(towards, 6);
    lights.sky = {0.2f, 0.2f, 0.2f};
    const Image marched = renderImage(volume, cloud, lights, camera).image;
    const Image traced = pathTraceImage(volume, cloud, lights, camera, paths).image;
    double sumMarched = 0, sumTraced = 0;
    for (int by = 0; by != 3; ++by)
      for (int bx = 0; bx != 4; ++bx) {
        double a = 0, b = 0, alpha = 0;
        for (int y = 8 * by; y != 8 * by + 8; ++y)
          for (int x = 8 * bx; x != 8 * bx + 8; ++x) {
            a += double(marched.at("R", x, y));
            b += double(traced.at("R", x, y));
            alpha += double(marched.at("A", x, y));
          }
        sumMarched += a;
        sumTraced += b;
        if (alpha > 20) {
          EXPECT_NEAR(a / b, 1, 0.15) << bx << " " << by;
        }
      }
    EXPECT_NEAR(sumMarched / sumTraced, 1, 0.05);
  }
}

TEST(Raymarch, FurnaceIsAsBrightAsItsSky) {
  // Nothing absorbs and light is the same everywhere: radiance = alpha * sky.
  const RenderVolume volume(ball(1.0f, 0.1f));
  for (const char* phase : {"isotropic", "hg:0.8"})
    for (const float extinction : {1.0f, 50.0f, 1000.0f}) {
      Medium white = medium(extinction);
      white.phase = Phase::parse(phase);
      const Image image = renderImage(volume, white, {{}, {0.5f, 0.5f, 0.5f}},
                                      Camera::framing(volume.outline(), 10, 20, {16, 12, 35}))
                              .image;
      for (int y = 0; y != image.height; ++y)
        for (int x = 0; x != image.width; ++x)
          ASSERT_NEAR(image.at("G", x, y), 0.5f * image.at("A", x, y), 2e-4f) << phase << " " << extinction;
    }
}

TEST(Raymarch, ConvergesWithTheSquareOfTheStep) {
  // A smooth density; the reference is marched 16 times finer. Root mean square over rays, since errors
  // change sign.
  const auto grid = densityGrid(voxels(1.0f), {-24, -24, -24}, {24, 24, 24},
                                [](const Vec3f& p) { return std::exp(-dot(p, p) / 50.0f); });
  const RenderVolume volume(grid);
  double coarse = 0, half = 0, whole = 0;
  for (int i = 0; i != 12; ++i) {
    const Camera camera = needle({10, float(3 * i), 90}, {0.9f * float(i % 4), 0.2f * float(i), 0.1f});
    const auto radiance = [&](float step) {
      return double(
          renderImage(volume, medium(0.3f), sun({1, 1, 1}), camera, single(step)).image.at("R", 0, 0));
    };
    const double exact = radiance(0.25f);
    coarse += std::pow(radiance(8) - exact, 2);
    half += std::pow(radiance(4) - exact, 2);
    whole += exact * exact;
  }
  // A quarter at second order; both are free of the limit on a step's optical depth only up to its first
  // orders.
  EXPECT_LT(std::sqrt(half / coarse), 0.35);
  EXPECT_LT(std::sqrt(half / whole), 0.01);
}

TEST(Raymarch, IsTheSameFromARotatedAndStretchedGrid) {
  Affine map{Mat3f::rotation({1, 2, 3}, 0.7f), {100, -50, 30}};
  for (int row = 0; row != 3; ++row)
    map.linear(row, 0) *= 0.04f, map.linear(row, 1) *= 0.06f, map.linear(row, 2) *= 0.05f;
  const auto density = [](const Vec3f& p, const Vec3f& centre) {
    const float inside = (1 - length(p - centre)) / 0.05f + 0.5f;
    return std::fmin(std::fmax(inside, 0.0f), 1.0f);
  };
  const Vec3f far{100, -50, 30};
  const RenderVolume turned(
      densityGrid(map, {-28, -20, -23}, {28, 20, 23}, [&](const Vec3f& p) { return density(p, far); }));
  const RenderVolume plain(densityGrid(voxels(0.05f), {-23, -23, -23}, {23, 23, 23},
                                       [&](const Vec3f& p) { return density(p, {}); }));
  for (const Vec3f& target : {Vec3f{0, 0, 0}, Vec3f{0.5f, 0.3f, 0}, Vec3f{-0.4f, 0.6f, 0}}) {
    const Vec3f from{3, 2, 8};
    const Image a = renderImage(plain, medium(1.0f), sun({1, 1, 0.2f}), needle(from, target), single()).image;
    const Image b =
        renderImage(turned, medium(1.0f), sun({1, 1, 0.2f}), needle(from + far, target + far), single())
            .image;
    EXPECT_NEAR(a.at("A", 0, 0), b.at("A", 0, 0), 0.01f);
    EXPECT_NEAR(a.at("R", 0, 0), b.at("R", 0, 0), 0.02f * a.at("R", 0, 0) + 1e-4f);
  }
}

TEST(Raymarch, StartsAtACameraInsideTheVolume) {
  const RenderVolume volume(ball(1.0f, 0.05f));
  EXPECT_NEAR(alphaOf(volume, 0.8f, needle({0, 0, 0}, {0, 0, -1}), single()), 1 - std::exp(-0.8f), 0.01f);
  EXPECT_EQ(alphaOf(volume, 0.8f, needle({0, 0, 2}, {0, 0, 3}), single()), 0.0f);
}

TEST(Raymarch, CrossesEmptySpaceBetweenParts) {
  // Two balls of radius 0.5, 200 empty voxels apart, both of which the ray pierces through the middle.
  const auto grid = densityGrid(voxels(0.05f), {-12, -12, -110}, {12, 12, 110}, [](const Vec3f& p) {
    const float inside = (0.5f - length(Vec3f{p.x, p.y, std::fabs(p.z) - 4.8f})) / 0.05f + 0.5f;
    return std::fmin(std::fmax(inside, 0.0f), 1.0f);
  });
  const RenderVolume volume(grid);
  EXPECT_NEAR(alphaOf(volume, 0.5f, needle({0, 0, 20}, {0, 0, 0}), single()), 1 - std::exp(-1.0f), 0.01f);
  // Across, on a slant that only touches one.
  EXPECT_NEAR(alphaOf(volume, 0.5f, needle({0, 6, 4.8f}, {0, 0, 4.8f}), single()), 1 - std::exp(-0.5f),
              0.01f);
}

TEST(Raymarch, MakesAnEmptyPictureOfAnEmptyVolume) {
  const RenderVolume volume(densityGrid(voxels(1), {0, 0, 0}, {5, 5, 5}, [](const Vec3f&) { return 0.0f; }));
  const Camera camera = Camera::framing(volume.outline(), 0, 0, {8, 4, 30});
  const RenderResult result = renderImage(volume, {}, sun({0, 1, 0}), camera);
  for (const char* name : {"R", "G", "B", "A"})
    for (const float value : result.image.channel(name).values) EXPECT_EQ(value, 0.0f);
  for (const float depth : result.image.channel("Z").values)
    EXPECT_EQ(depth, std::numeric_limits<float>::infinity());
  EXPECT_EQ(result.samples, 0u);
}

// A picture with everything in it.
RenderResult portrait(int samples = 4, std::uint64_t seed = 0) {
  const auto grid = densityGrid(voxels(0.1f), {-16, -16, -16}, {16, 16, 16}, [](const Vec3f& p) {
    const float bumps = 0.2f * std::sin(6 * p.x) * std::sin(5 * p.y) * std::sin(7 * p.z);
    return std::fmin(std::fmax((1 + bumps - length(p)) / 0.2f, 0.0f), 1.0f);
  });
  const RenderVolume volume(grid);
  Medium cloud = medium(20.0f, 0.98f);
  cloud.phase = Phase::henyeyGreenstein(0.4f);
  RenderOptions options;
  options.samples = samples;
  options.seed = seed;
  options.aovs = {"Z", "transmittance", "light"};
  const Lights lights{{{"sun", {1, 1, 0.5f}, {3, 2.9f, 2.8f}}}, {0.1f, 0.2f, 0.3f}};
  return renderImage(volume, cloud, lights, Camera::framing(volume.outline(), 20, 10, {48, 40, 30}), options);
}

TEST(Raymarch, IsTheSameAtAnyNumberOfThreads) {
  const RenderResult many = portrait();
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
  const RenderResult one = portrait();
  EXPECT_EQ(many.samples, one.samples);
  for (std::size_t c = 0; c != many.image.channels.size(); ++c)
    EXPECT_EQ(many.image.channels[c].values, one.image.channels[c].values) << many.image.channels[c].name;
}

TEST(Raymarch, SplitsItsLightIntoLayers) {
  const RenderResult result = portrait();
  const Image& image = result.image;
  EXPECT_EQ(result.rays, 48u * 40u * 4u);
  double lit = 0;
  for (int y = 0; y != image.height; ++y)
    for (int x = 0; x != image.width; ++x) {
      for (const std::string channel : {"R", "G", "B"})
        ASSERT_NEAR(image.at(channel, x, y),
                    image.at("light_sun." + channel, x, y) + image.at("light_sky." + channel, x, y), 1e-6f);
      ASSERT_NEAR(image.at("transmittance.G", x, y), 1 - image.at("A", x, y), 1e-6f);
      lit += image.at("light_sky.B", x, y);
    }
  EXPECT_GT(lit, 1.0);
}

TEST(Raymarch, MeasuresDepthAlongTheLineOfSight) {
  // A ball of radius 1 whose front is 8 from the camera: depth 8 in the middle, and opaque within a voxel or
  // two.
  const RenderVolume volume(ball(1.0f, 0.05f));
  const Camera camera = Camera::lookingAt({0, 0, 9}, {0, 0, 0}, {0, 1, 0}, {33, 33, 30});
  const Image image = renderImage(volume, medium(50), {}, camera, single()).image;
  EXPECT_NEAR(image.at("Z", 16, 16), 8.0f, 0.1f);
  EXPECT_EQ(image.at("Z", 0, 0), std::numeric_limits<float>::infinity());
  // Beside the middle the ball's front is a plane-parallel depth, not a distance: 9 - sqrt(1 - r^2).
  const Vec3d hit = camera.ray(23.5, 16.5).direction * 8.3 + Vec3d{0, 0, 9};
  EXPECT_NEAR(image.at("Z", 23, 16), 9 - std::sqrt(1 - hit.x * hit.x), 0.1);
}

TEST(Raymarch, VectorsAgreeWithTheScalarLoop) {
  // The picture of every instruction set against that of the widest; see march_kernels_test for single rays.
  const RenderResult best = portrait();
  test::forEachTarget([&] {
    const RenderResult other = portrait();
    for (const char* name : {"R", "A"}) {
      const auto& a = best.image.channel(name).values;
      const auto& b = other.image.channel(name).values;
      for (std::size_t i = 0; i != a.size(); ++i)
        ASSERT_NEAR(a[i], b[i], 2e-5f * (1 + std::fabs(a[i]))) << name << " " << i;
    }
  });
}

TEST(Raymarch, MoreSamplesApproachTheSamePicture) {
  const Image few = portrait(4).image, more = portrait(16).image, many = portrait(144).image;
  double errorFew = 0, errorMore = 0, meanFew = 0, meanMany = 0;
  for (std::size_t i = 0; i != few.channels[1].values.size(); ++i) {
    const float exact = many.channels[1].values[i];
    errorFew += std::fabs(few.channels[1].values[i] - exact);
    errorMore += std::fabs(more.channels[1].values[i] - exact);
    meanFew += few.channels[1].values[i];
    meanMany += exact;
  }
  // Noise of independent samples would halve.
  EXPECT_LT(errorMore, 0.5 * errorFew);
  EXPECT_NEAR(meanFew / meanMany, 1, 0.005);
}

TEST(Raymarch, TheSeedMovesThePatternAndNothingElse) {
  const Image a = portrait(4, 1).image, b = portrait(4, 1).image, c = portrait(4, 2).image;
  EXPECT_EQ(a.channels[0].values, b.channels[0].values);
  EXPECT_NE(a.channels[0].values, c.channels[0].values);
}

TEST(Raymarch, RefusesBadOptions) {
  const RenderVolume volume(ball(1.0f, 0.25f));
  const Camera camera = needle({0, 0, 9}, {0, 0, 0});
  const auto tryWith = [&](const Medium& m, const Lights& l, const RenderOptions& o) {
    renderImage(volume, m, l, camera, o);
  };
  EXPECT_THROW(tryWith(medium(-1), {}, {}), Error);
  EXPECT_THROW(tryWith(medium(NAN), {}, {}), Error);
  EXPECT_THROW(tryWith(medium(1, 1.5f), {}, {}), Error);
  EXPECT_THROW(tryWith(medium(1), {{}, {-1, 0, 0}}, {}), Error);
  EXPECT_THROW(tryWith(medium(1), sun({0, 0, 0}), {}), Error);
  EXPECT_THROW(tryWith(medium(1), {std::vector<DistantLight>(9), {}}, {}), Error);
  RenderOptions options;
  options.samples = 0;
  EXPECT_THROW(tryWith(medium(1), {}, options), Error);
  options = {};
  options.octaves.count = 0;
  EXPECT_THROW(tryWith(medium(1), {}, options), Error);
  options = {};
  options.step = -1.0f;
  EXPECT_THROW(tryWith(medium(1), {}, options), Error);
  options = {};
  options.aovs = {"depth"};
  EXPECT_THROW(tryWith(medium(1), {}, options), Error);
}

}  // namespace
}  // namespace nephele

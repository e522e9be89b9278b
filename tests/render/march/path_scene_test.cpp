// Path traced pictures with what the marcher has beside a volume: objects, holdouts, depth, shadow maps.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/render/image/deep_image.h"
#include "nephele/render/light/deep_shadow.h"
#include "nephele/render/march/path_trace.h"
#include "nephele/render/march/raymarch.h"
#include "nephele/render/scene/environment.h"
#include "tests/support/path_pictures.h"
#include "tests/support/test_meshes.h"

namespace nephele {
namespace {

using test::ball;
using test::estimate;
using test::Estimate;
using test::lumpyCloud;
using test::slab;
using test::worstBlock;

constexpr Vec3f kWhite{1, 1, 1};

Medium medium(float extinction, float albedo = 1.0f, const Phase& phase = {}) {
  return {extinction, {albedo, albedo, albedo}, phase};
}

Camera needle(int pixels = 1) {
  return Camera::lookingAt({0, 0, 9}, {0, 0, 0}, {0, 1, 0}, {pixels, pixels, 0.001f});
}

// Two balls beside and in a cloud of radius 1, and a plane below.
std::shared_ptr<const Surfaces> objects(const Vec3f& colour, bool isHeldOut = false) {
  std::vector<SurfaceObject> all;
  all.push_back({.mesh = test::icosphere(0.5, 3, {1.2f, 0.3f, 0.4f}), .colour = colour});
  all.push_back(
      {.mesh = test::icosphere(0.4, 2, {-0.5f, 0.5f, 0.7f}), .colour = colour, .isHoldout = isHeldOut});
  all.push_back({.mesh = groundPlane({}, -1.2f, 100), .colour = colour, .castsShadows = false});
  return std::make_shared<const Surfaces>(std::move(all));
}

// A deep picture of a denser cloud in front.
std::shared_ptr<const Holdout> veil(const Camera& camera) {
  const RenderVolume volume(test::densityGrid(test::voxels(0.1f), {-20, -20, 8}, {5, 20, 14},
                                              [](const Vec3f& p) { return p.x < 0.2f ? 1.0f : 0.0f; }));
  RenderOptions options;
  options.deep.emplace();
  return std::make_shared<const Holdout>(*renderImage(volume, medium(2), {}, camera, options).deep);
}

TEST(PathScene, FurnaceWithWhiteObjectsAndHoldoutsIsAsBrightAsItsSky) {
  // Nothing absorbs, and light is the same everywhere: whatever is seen has the sky's radiance. Every path
  // gives just that, but for rounding, unless it meets objects more than 64 times and goes on by chance. The
  // seed is fixed, so five standard errors are met or not for good.
  const RenderVolume volume(lumpyCloud());
  const Camera camera = Camera::framing(volume.outline(), 30, 20, {32, 24, 35});
  for (const char* phase : {"isotropic", "hg:0.8"})
    for (const bool isMap : {false, true}) {
      PathOptions options;
      options.samplesPerPixel = 16;
      options.surfaces = objects(kWhite, true);
      options.holdout = veil(camera);
      Lights lights{{}, kWhite};
      if (isMap) lights.map = std::make_shared<const Environment>(8, 4, std::vector<Vec3f>(32, kWhite));
      Image image = pathTraceImage(volume, medium(20, 1, Phase::parse(phase)), lights, camera, options).image;
      double worst = 0;
      std::vector<float>& red = image.channels[0].values;
      for (std::size_t i = 0; i != red.size(); ++i) {
        red[i] -= image.channel("A").values[i];
        worst = std::max(worst, double(std::fabs(red[i])));
      }
      const Estimate difference = estimate(image, "R");
      EXPECT_NEAR(difference.mean, 0, 5 * difference.standardError + 1e-6) << phase;
      EXPECT_LT(worst, isMap ? 10 : 0.1) << phase;
      EXPECT_GT(estimate(image, "A").mean, 0.3);
    }
}

struct Both {
  RenderResult marched, traced;
};

// The same scene marched and traced; what scatters does so once.
Both singleScattering(RenderOptions how, int paths, const Lights& lights) {
  const RenderVolume volume(lumpyCloud());
  const Camera camera = Camera::framing(volume.outline(), 25, 15, {32, 24, 45});
  const Medium cloud = medium(3, 0.95f, Phase::henyeyGreenstein(0.3f));
  how.octaves.count = 1;
  how.samples = 64;
  if (how.holdout) how.holdout = veil(camera);
  PathOptions options;
  static_cast<FrameOptions&>(options) = how;
  options.samplesPerPixel = paths;
  options.maxScatterings = 1;
  options.objectsScatter = false;
  return {renderImage(volume, cloud, lights, camera, how),
          pathTraceImage(volume, cloud, lights, camera, options)};
}

TEST(PathScene, ObjectsInACloudAreAsMarched) {
  RenderOptions options;
  options.surfaces = objects({0.8f, 0.5f, 0.3f});
  options.aovs = {"Z", "Z_median", "position", "normal", "light", "albedo", "transmittance"};
  Lights lights{{{"sun", {1, 0.7f, 0.4f}, {5, 5, 5}}}, {0.5f, 0.5f, 0.5f}};
  lights.locals.push_back({"point", {-1, 2, 2}, {4, 4, 4}});
  const Both both = singleScattering(options, 400, lights);
  // Shadows of objects have edges of a voxel in marched pictures: 3 % of a block beside them.
  for (const char* name : {"light_sun.R", "light_point.G"})
    EXPECT_LT(worstBlock(both.marched.image, both.traced.image, name, 0.01f), 0.03) << name;
  // 16 directions per ray look for the sky.
  EXPECT_LT(worstBlock(both.marched.image, both.traced.image, "light_objects.B", 0.01f), 0.01);
  for (const char* name : {"A", "albedo.R", "albedo.B"})
    EXPECT_LT(worstBlock(both.marched.image, both.traced.image, name, 0.01f), 0.003) << name;
  // Where things are is found by the same march.
  for (const char* name : {"Z_median", "P.X", "N.Y"})
    EXPECT_EQ(both.marched.image.channel(name).values, both.traced.image.channel(name).values) << name;
}

TEST(PathScene, HoldoutsHideAsMarched) {
  RenderOptions options;
  options.holdout = std::make_shared<const Holdout>(DeepImage{1, 1, {}, {{}}});
  options.aovs = {"transmittance", "light"};
  const Both both = singleScattering(options, 1500, {{{"sun", {1, 0.7f, 0.4f}, {5, 5, 5}}}, {}});
  for (const char* name : {"R", "A", "transmittance.R"})
    EXPECT_LT(worstBlock(both.marched.image, both.traced.image, name, 0.02f), 0.01) << name;
}

TEST(PathScene, DeepPicturesAreFlatOnesWhenFlattened) {
  RenderOptions options;
  options.deep.emplace();
  options.surfaces = objects({0.8f, 0.5f, 0.3f});
  options.holdout = std::make_shared<const Holdout>(DeepImage{1, 1, {}, {{}}});
  const Both both =
      singleScattering(options, 64, {{{"sun", {1, 0.7f, 0.4f}, {5, 5, 5}}}, {0.2f, 0.3f, 0.4f}});
  const Image& image = both.traced.image;
  for (int y = 0; y != image.height; ++y)
    for (int x = 0; x != image.width; ++x) {
      // The last sample's numbers have 11 bits, of what those in front leave.
      const std::vector<DeepSample>& samples = both.traced.deep->at(x, y);
      const FlatPixel flat = flattened(samples);
      ASSERT_NEAR(flat.alpha, image.at("A", x, y), 5e-4f);
      ASSERT_NEAR(flat.colour.x, image.at("R", x, y), 1e-3f * std::max(1.0f, image.at("R", x, y)));
      ASSERT_NEAR(flat.colour.z, image.at("B", x, y), 1e-3f * std::max(1.0f, image.at("B", x, y)));
      for (std::size_t i = 1; i < samples.size(); ++i) ASSERT_GE(samples[i].z, samples[i - 1].zBack);
    }
}

TEST(PathScene, DeepPicturesHoldTheOpacityInFrontOfEveryDepth) {
  // A slab of extinction 1 from depth 7.95 to 10.05, whose faces ramp over a voxel. The largest distance
  // between the law and 40000 paths of it is below 1.63 / 200 in 99 of 100 cases (Kolmogorov), beside the
  // tolerance.
  const RenderVolume volume(slab(2.1f, 3, 0.1f));
  PathOptions options;
  options.samplesPerPixel = 40000;
  options.deep.emplace();
  const RenderResult result = pathTraceImage(volume, medium(1), {{}, kWhite}, needle(), options);
  const Holdout holdout(*result.deep);
  std::size_t cursor = 0;
  for (float z = 7.5f; z < 10.5f; z += 0.1f)
    EXPECT_NEAR(holdout.at(0, 0).transmittance(z, cursor), std::exp(-std::clamp(z - 7.95f, 0.0f, 2.1f)),
                0.0082f + 0.004f)
        << z;
  // Opaque behind, so that the tolerance is what makes them so few.
  EXPECT_LT(result.deep->sampleCount(), 200u);
}

TEST(PathScene, WhatGlowsInColoursBehindAHoldoutIsAsMarched) {
  // A slab that glows and differs in extinction between colours, with a pane that lets half through in its
  // middle. Nothing scatters, so both are means of the same; five standard errors of 256 pixels, and half a
  // percent for the marcher's steps across the pane.
  const auto grid = slab(2.1f, 3, 0.1f);
  const auto glow = std::make_shared<BrickGrid>(*grid);
  glow->multiply(0.5f);
  const RenderVolume volume(grid, {{}, {glow, glow, glow}});
  Medium coloured = medium(1, 0);
  coloured.extinctionColour = {1, 0.5f, 0.25f};
  const Camera camera = needle(16);
  PathOptions tracing;
  tracing.samplesPerPixel = 200;
  tracing.deep.emplace();
  tracing.aovs = {"transmittance", "emission"};
  tracing.holdout = std::make_shared<const Holdout>(
      DeepImage{16, 16, {}, std::vector<std::vector<DeepSample>>(256, {{9, 9, 0.5f, {}}})});
  RenderOptions marching;
  static_cast<FrameOptions&>(marching) = tracing;
  marching.octaves.count = 1;
  marching.step = 0.01f;
  const Image marched = renderImage(volume, coloured, {}, camera, marching).image;
  const RenderResult traced = pathTraceImage(volume, coloured, {}, camera, tracing);
  for (const char* name :
       {"A", "emission.R", "emission.B", "transmittance.R", "transmittance.G", "transmittance.B"}) {
    const Estimate expected = estimate(marched, name), found = estimate(traced.image, name);
    EXPECT_NEAR(found.mean, expected.mean, 5 * found.standardError + 0.005 * expected.mean) << name;
    EXPECT_LT(found.standardError, 0.01 * expected.mean) << name;
  }
  for (int x = 0; x != 16; ++x) {
    const FlatPixel flat = flattened(traced.deep->at(x, 3));
    EXPECT_NEAR(flat.alpha, traced.image.at("A", x, 3), 5e-4f);
    EXPECT_NEAR(flat.colour.y, traced.image.at("G", x, 3), 1e-3f);
  }
}

TEST(PathScene, ShadowMapsAreLookedUpWithoutBias) {
  const RenderVolume volume(lumpyCloud());
  const Camera camera = Camera::framing(volume.outline(), 25, 15, {32, 24, 35});
  Lights lights{{{"sun", {1, 0.7f, 0.4f}, {5, 5, 5}}}, {}};
  PathOptions options;
  options.samplesPerPixel = 1000;
  options.maxScatterings = 1;
  const Image direct = pathTraceImage(volume, medium(10), lights, camera, options).image;
  lights.deepTolerance = 2e-3f;
  const Image mapped = pathTraceImage(volume, medium(10), lights, camera, options).image;
  // Pixels of the map are as wide as voxels: 2 % of a block.
  EXPECT_LT(worstBlock(direct, mapped, "R", 0.02f), 0.02);
}

TEST(PathScene, LightGoesFromObjectsToTheCloudOnlyIfItMay) {
  // A white wall behind a thin slab, the sun behind the camera: light that comes back from the wall scatters
  // in the slab.
  const RenderVolume volume(slab(2, 3, 0.1f));
  Mesh wall = groundPlane({}, 0, 20);
  for (Vec3d& p : wall.positions) p = {p.x, p.z, -1.5};
  PathOptions options;
  options.samplesPerPixel = 400;
  options.aovs = {"light"};
  options.surfaces = std::make_shared<const Surfaces>(std::vector<SurfaceObject>{{wall, kWhite}});
  const Lights sun{{{"sun", {0, 0, 1}, {3, 3, 3}}}, {}};
  const auto lit = [&](bool objectsScatter) {
    options.objectsScatter = objectsScatter;
    return estimate(pathTraceImage(volume, medium(0.5f), sun, needle(8), options).image, "light_sun.R");
  };
  const Estimate with = lit(true), without = lit(false);
  EXPECT_GT(with.mean, 1.3 * without.mean);
}

TEST(PathScene, IsTheSameAtAnyNumberOfThreads) {
  const auto picture = [] {
    RenderOptions options;
    options.deep.emplace();
    options.surfaces = objects({0.8f, 0.5f, 0.3f});
    options.holdout = std::make_shared<const Holdout>(DeepImage{1, 1, {}, {{}}});
    options.aovs = {"Z", "Z_mean", "light", "albedo", "emission"};
    options.shutter = {-0.25, 0.25};
    options.volumeMotion = RigidMotion{{0.5, 0, 0}, {}, {}};
    return singleScattering(options, 8, {{{"sun", {1, 0.7f, 0.4f}, {5, 5, 5}}}, {0.2f, 0.3f, 0.4f}}).traced;
  };
  const RenderResult many = picture();
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
  const RenderResult one = picture();
  EXPECT_EQ(many.samples, one.samples);
  for (std::size_t c = 0; c != many.image.channels.size(); ++c)
    EXPECT_EQ(many.image.channels[c].values, one.image.channels[c].values) << many.image.channels[c].name;
  for (std::size_t i = 0; i != many.deep->pixels.size(); ++i) {
    ASSERT_EQ(many.deep->pixels[i].size(), one.deep->pixels[i].size());
    for (std::size_t k = 0; k != many.deep->pixels[i].size(); ++k)
      ASSERT_EQ(many.deep->pixels[i][k].colour, one.deep->pixels[i][k].colour);
  }
}

TEST(PathScene, OpticalDepthsOfManyOrdersStayRight) {
  // A voxel as dense as 1e6 in a slab of density 1: what is beside it must not change. Alpha of the slab by
  // Beer's law, five standard errors.
  const RenderVolume volume(
      test::densityGrid(test::voxels(0.1f), {-40, -40, -5}, {40, 40, 5}, [](const Vec3f& p) {
        return length(p - Vec3f{0.35f, 0.35f, 0}) < 0.05f ? 1e6f : std::fabs(p.z) < 0.45f ? 1.0f : 0.0f;
      }));
  PathOptions options;
  options.samplesPerPixel = 400;
  const Estimate alpha = estimate(pathTraceImage(volume, medium(1), {}, needle(16), options).image, "A");
  EXPECT_NEAR(alpha.mean, 1 - std::exp(-0.9), 5 * alpha.standardError);
}

// What both integrators make of a volume.
template <class Expect>
void expectOfBoth(const Medium& m, const Lights& lights, const FrameOptions& frame, Expect&& expect) {
  const RenderVolume volume(ball(1, 0.1f));
  const Camera camera = Camera::framing(volume.outline(), 0, 0, {12, 12, 30});
  RenderOptions marching;
  static_cast<FrameOptions&>(marching) = frame;
  PathOptions tracing;
  static_cast<FrameOptions&>(tracing) = frame;
  expect([&] { return renderImage(volume, m, lights, camera, marching).image; });
  expect([&] { return pathTraceImage(volume, m, lights, camera, tracing).image; });
}

TEST(PathScene, NumbersOutsideTheirRangesAreRefused) {
  const auto refuses = [](const auto& picture) { EXPECT_THROW(picture(), Error); };
  const Lights sun{{{"sun", {0, 0, 1}, {3, 3, 3}}}, {}};
  expectOfBoth(medium(1, 1.001f), sun, {}, refuses);
  expectOfBoth(medium(1), {{}, {NAN, 0, 0}}, {}, refuses);
  expectOfBoth(medium(INFINITY), sun, {}, refuses);
  FrameOptions withObjects;
  withObjects.surfaces = objects(kWhite);
  expectOfBoth(medium(0), sun, withObjects, refuses);
  FrameOptions backwards;
  backwards.shutter = {0.5, -0.5};
  expectOfBoth(medium(1), sun, backwards, refuses);
  EXPECT_THROW(Environment(2, 1, {kWhite, {NAN, 0, 0}}), Error);
  for (const float g : {-1.0f, 1.0f, NAN}) EXPECT_THROW(Phase::henyeyGreenstein(g), Error);
}

TEST(PathScene, ExtremesOfTheExtinctionMakeRightPictures) {
  const Lights sky{{}, kWhite};
  expectOfBoth(medium(0), sky, {}, [](const auto& picture) {
    const Image image = picture();
    for (const char* name : {"R", "A"})
      for (const float value : image.channel(name).values) EXPECT_EQ(value, 0.0f);
  });
  // A half space of albedo 0.9 under an even sky of radiance 1, isotropic, seen from in front of it: 1 - H(1)
  // sqrt(1 - albedo) = 0.415, with H(1) = 1.8501 from Chandrasekhar's table XI. The ball is flat at that
  // scale.
  const RenderVolume volume(ball(1, 0.1f));
  const Camera camera = Camera::framing(volume.outline(), 0, 0, {12, 12, 30, {}, {}, PixelBox{5, 5, 7, 7}});
  PathOptions options;
  options.samplesPerPixel = 2000;
  const Image traced = pathTraceImage(volume, medium(1e6f, 0.9f), sky, camera, options).image;
  EXPECT_EQ(estimate(traced, "A").mean, 1.0);
  // 8000 paths whose weights spread by less than 0.4: five standard errors.
  EXPECT_NEAR(estimate(traced, "R").mean, 0.415, 0.022);
  // The marcher's lattice does not resolve the layer below the surface.
  const Image marched = renderImage(volume, medium(1e6f, 0.9f), sky, camera).image;
  EXPECT_EQ(estimate(marched, "A").mean, 1.0);
  EXPECT_TRUE(estimate(marched, "R").mean > 0.2 && estimate(marched, "R").mean < 1);
}

TEST(PathScene, ACameraInsideAnObjectSeesItsDarkInside) {
  // A closed white shell around the camera: no light gets in, and paths end although nothing absorbs.
  FrameOptions frame;
  frame.surfaces = std::make_shared<const Surfaces>(
      std::vector<SurfaceObject>{{test::icosphere(0.5, 2, {0, 0, 4}), kWhite}});
  const RenderVolume volume(ball(1, 0.1f));
  const Camera camera = Camera::lookingAt({0, 0, 4.1f}, {0, 0, 0}, {0, 1, 0}, {8, 8, 60});
  const Lights lights{{{"sun", {0, 0, 1}, {3, 3, 3}}}, kWhite};
  RenderOptions marching;
  static_cast<FrameOptions&>(marching) = frame;
  PathOptions tracing;
  static_cast<FrameOptions&>(tracing) = frame;
  tracing.samplesPerPixel = 4;
  for (const Image& image : {renderImage(volume, medium(5), lights, camera, marching).image,
                             pathTraceImage(volume, medium(5), lights, camera, tracing).image})
    for (int y = 0; y != 8; ++y)
      for (int x = 0; x != 8; ++x) {
        EXPECT_EQ(image.at("A", x, y), 1.0f);
        EXPECT_EQ(image.at("R", x, y), 0.0f);
      }
}

}  // namespace
}  // namespace nephele

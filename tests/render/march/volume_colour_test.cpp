#include <gtest/gtest.h>

#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/render/light/light_volume.h"
#include "nephele/render/march/march_kernels.h"
#include "nephele/render/march/path_trace.h"
#include "nephele/render/march/raymarch.h"
#include "tests/support/density.h"
#include "tests/support/each_target.h"
#include "tests/support/march_scene.h"
#include "tests/support/scalar_march.h"

namespace nephele {
namespace {

using test::densityGrid;
using test::slab;
using test::voxels;

// A camera with a single, nearly parallel pixel that looks down z.
Camera needle() {
  return Camera::lookingAt({0, 0, 9}, {0, 0, 0}, {0, 1, 0}, {1, 1, 0.001f});
}

Medium medium(float extinction, float albedo = 1.0f) {
  return {extinction, {albedo, albedo, albedo}, Phase()};
}

RenderOptions single() {
  RenderOptions options;
  options.octaves.count = 1;
  options.samples = 1;
  options.aovs = {"transmittance", "emission"};
  return options;
}

Vec3f pixel(const Image& image, const std::string& layer = "") {
  return {image.at(layer + "R", 0, 0), image.at(layer + "G", 0, 0), image.at(layer + "B", 0, 0)};
}

std::shared_ptr<BrickGrid> times(const BrickGrid& grid, float factor) {
  auto result = std::make_shared<BrickGrid>(grid);
  result->multiply(factor);
  return result;
}

VolumeColour::Grids coloured(const BrickGrid& grid, const Vec3f& colour) {
  return {times(grid, colour.x), times(grid, colour.y), times(grid, colour.z)};
}

TEST(VolumeColour, EveryColourIsTransmittedByItsOwnExtinction) {
  // Beer's law per colour; alpha is the mean of the three opacities. The 21 voxels of the slab are 2.1 deep.
  const RenderVolume volume(slab(2.1f, 4.0f, 0.1f, 0.5f));
  Medium its = medium(0.8f);
  its.extinctionColour = {0.5f, 1, 2};
  const Image image = renderImage(volume, its, {}, needle(), single()).image;
  const Vec3f through = pixel(image, "transmittance.");
  for (int c = 0; c != 3; ++c)
    EXPECT_NEAR(through[c], std::exp(-0.5f * 2.1f * 0.8f * its.extinctionColour[c]), 1e-4f);
  EXPECT_NEAR(image.at("A", 0, 0), 1 - (through.x + through.y + through.z) / 3, 1e-6f);
}

TEST(VolumeColour, EveryColourScattersAsAVolumeOfItsExtinctionAlone) {
  // Nothing couples the colours: red of a medium of colour (a, b, c) is what a grey one of extinction a
  // gives, in single scattering and with octaves.
  const auto grid = test::ball(1.0f, 0.1f);
  const RenderVolume volume(grid);
  const Lights lights{{{"sun", {0.5f, 0.7f, 0.5f}, {1, 1, 1}}}, {0.2f, 0.2f, 0.2f}};
  for (const int octaves : {1, 3}) {
    RenderOptions options = single();
    options.octaves.count = octaves;
    options.step = 0.01f;
    Medium its = medium(3.0f, 0.9f);
    its.extinctionColour = {1, 0.5f, 0.25f};
    const Vec3f colours = pixel(renderImage(volume, its, lights, needle(), options).image);
    for (int c = 0; c != 3; ++c) {
      const Vec3f alone = pixel(
          renderImage(volume, medium(3.0f * its.extinctionColour[c], 0.9f), lights, needle(), options).image);
      // Octaves look ahead by a mean free path, that of all colours together.
      EXPECT_NEAR(colours[c] / alone[c], 1, octaves == 1 ? 2e-3 : 0.03) << c << " " << octaves;
    }
  }
}

TEST(VolumeColour, ScaleOfTheExtinctionColourIsThatOfTheExtinction) {
  const RenderVolume volume(test::ball(1.0f, 0.1f));
  const Lights lights{{{"sun", {0.5f, 0.7f, 0.5f}, {1, 1, 1}}}, {}};
  Medium its = medium(1.5f, 0.9f);
  its.extinctionColour = {2, 2, 2};
  const Vec3f twice = pixel(renderImage(volume, its, lights, needle(), single()).image);
  const Vec3f expected = pixel(renderImage(volume, medium(3.0f, 0.9f), lights, needle(), single()).image);
  for (int c = 0; c != 3; ++c) EXPECT_FLOAT_EQ(twice[c], expected[c]);
}

TEST(VolumeColour, ConstantColourActsAsAnAlbedo) {
  const auto grid = test::ball(1.0f, 0.1f);
  const Vec3f colour{0.9f, 0.5f, 0.1f};
  const RenderVolume plain(grid), painted(grid, {coloured(*grid, colour), {}});
  const Lights lights{{{"sun", {0.5f, 0.7f, 0.5f}, {1, 1, 1}}}, {0.3f, 0.2f, 0.1f}};
  Medium its = medium(4.0f);
  its.albedo = colour;
  for (const int octaves : {1, 3}) {
    RenderOptions options = single();
    options.octaves.count = octaves;
    const Vec3f expected = pixel(renderImage(plain, its, lights, needle(), options).image);
    const Vec3f found = pixel(renderImage(painted, medium(4.0f), lights, needle(), options).image);
    for (int c = 0; c != 3; ++c) EXPECT_NEAR(found[c] / expected[c], 1, 1e-3) << c << " " << octaves;
  }
  PathOptions paths;
  paths.samplesPerPixel = 64;
  // The same random numbers.
  const Vec3f expected = pixel(pathTraceImage(plain, its, lights, needle(), paths).image);
  const Vec3f found = pixel(pathTraceImage(painted, medium(4.0f), lights, needle(), paths).image);
  for (int c = 0; c != 3; ++c) EXPECT_NEAR(found[c] / expected[c], 1, 1e-3) << c;
}

TEST(VolumeColour, IsInTheLayerOfTheAlbedo) {
  // A slab of one colour, so that the layer is that times the medium's albedo and the opacity of every
  // colour.
  const auto grid = slab(2.1f, 4.0f, 0.1f, 0.5f);
  const Vec3f colour{0.9f, 0.5f, 0.2f};
  const RenderVolume volume(grid, {coloured(*grid, colour), {}});
  for (const Vec3f& extinctionColour : {Vec3f{1, 1, 1}, Vec3f{0.5f, 1, 2}}) {
    Medium its = medium(0.8f, 0.99f);
    its.extinctionColour = extinctionColour;
    RenderOptions options = single();
    options.aovs = {"transmittance", "albedo"};
    PathOptions paths;
    static_cast<FrameOptions&>(paths) = options;
    paths.samplesPerPixel = 4096;
    const Lights sky{{}, {1, 1, 1}};
    const Image marched = renderImage(volume, its, sky, needle(), options).image,
                traced = pathTraceImage(volume, its, sky, needle(), paths).image;
    for (const Image* image : {&marched, &traced}) {
      const Vec3f found = pixel(*image, "albedo."), through = pixel(*image, "transmittance.");
      for (int c = 0; c != 3; ++c) EXPECT_NEAR(found[c], 0.99f * colour[c] * (1 - through[c]), 3e-4f) << c;
    }
  }
}

TEST(VolumeColour, PathsAgreeWithTheMarcherOnceScattered) {
  // Colour changes from red to blue across the volume; single scattering, both ways, within 4 standard
  // errors of 40000 paths (relative 0.01 each, from the spread of ten seeds).
  const auto grid = densityGrid(voxels(0.1f), {-12, -12, -12}, {12, 12, 12},
                                [](const Vec3f& p) { return length(p) < 1 ? 1.0f : 0.0f; });
  VolumeColour colour;
  for (int c = 0; c != 3; ++c)
    colour.scattering[std::size_t(c)] =
        densityGrid(voxels(0.1f), {-12, -12, -12}, {12, 12, 12}, [c](const Vec3f& p) {
          const float t = 0.5f + 0.5f * p.z;
          return length(p) < 1 ? (c == 0 ? t : c == 1 ? 0.5f : 1 - t) : 0.0f;
        });
  const RenderVolume volume(grid, colour);
  EXPECT_NEAR(volume.meanColour().x, 0.5f, 1e-3f);
  const Lights lights{{{"sun", {0.5f, 0.7f, 0.5f}, {1, 1, 1}}}, {}};
  PathOptions paths;
  paths.samplesPerPixel = 40000;
  paths.maxScatterings = 1;
  const Vec3f traced = pixel(pathTraceImage(volume, medium(1.0f), lights, needle(), paths).image);
  const Vec3f marched = pixel(renderImage(volume, medium(1.0f), lights, needle(), single()).image);
  for (int c = 0; c != 3; ++c) EXPECT_NEAR(marched[c] / traced[c], 1, 0.04) << c;
}

TEST(VolumeColour, PathsAgreeWithTheMarcherWhereExtinctionsDiffer) {
  // Single scattering; the standard errors of 40000 paths are some 0.01.
  const RenderVolume volume(test::ball(1.0f, 0.1f));
  const Lights lights{{{"sun", {0.5f, 0.7f, 0.5f}, {1, 1, 1}}}, {}};
  Medium its = medium(1.0f);
  its.extinctionColour = {1, 0.5f, 0.1f};
  PathOptions paths;
  paths.samplesPerPixel = 40000;
  paths.maxScatterings = 1;
  paths.aovs = {"transmittance"};
  const Image traced = pathTraceImage(volume, its, lights, needle(), paths).image;
  const Image marched = renderImage(volume, its, lights, needle(), single()).image;
  for (int c = 0; c != 3; ++c) {
    EXPECT_NEAR(pixel(traced)[c] / pixel(marched)[c], 1, 0.04) << c;
    EXPECT_NEAR(pixel(traced, "transmittance.")[c], pixel(marched, "transmittance.")[c], 0.01) << c;
  }
  EXPECT_NEAR(traced.at("A", 0, 0), marched.at("A", 0, 0), 0.01);
}

TEST(VolumeColour, PathsFindWhatGlows) {
  // Density 1, emission e: L = e_c (1 - exp(-tau_c)) / (extinction colour), nothing being scattered.
  const auto grid = slab(2.1f, 4.0f, 0.1f);
  const Vec3f e{3, 1, 0.25f};
  const RenderVolume volume(grid, {{}, coloured(*grid, e)});
  Medium its = medium(0.6f, 0.0f);
  its.extinctionColour = {1, 0.5f, 0.25f};
  PathOptions paths;
  paths.samplesPerPixel = 40000;
  paths.aovs = {};
  const Vec3f light = pixel(pathTraceImage(volume, its, {}, needle(), paths).image);
  for (int c = 0; c != 3; ++c) {
    const float k = its.extinctionColour[c];
    EXPECT_NEAR(light[c] / (e[c] * (1 - std::exp(-2.1f * 0.6f * k)) / k), 1, 0.03) << c;
  }
  // And without any density: extinction * e * thickness.
  const RenderVolume flame(times(*grid, 0), {{}, coloured(*grid, e)});
  EXPECT_NEAR(pixel(pathTraceImage(flame, medium(0.6f), {}, needle(), paths).image).x / (0.6f * 3 * 2.1f), 1,
              0.03);
}

TEST(VolumeColour, GlowsAsInTheClosedForm) {
  // Density 1, emission e: L = e (1 - exp(-tau)). The ramps of density and emission beside the faces fall
  // together, so a step of the marcher is exact.
  const auto grid = slab(2.1f, 4.0f, 0.1f);
  const Vec3f e{3, 1, 0.25f};
  const RenderVolume volume(grid, {{}, coloured(*grid, e)});
  for (const float sigma : {0.01f, 0.5f, 20.0f}) {
    const Image image = renderImage(volume, medium(sigma), {}, needle(), single()).image;
    const Vec3f light = pixel(image);
    for (int c = 0; c != 3; ++c)
      EXPECT_NEAR(light[c] / (e[c] * (1 - std::exp(-2.1f * sigma))), 1, 2e-3) << sigma;
    EXPECT_NEAR(pixel(image, "emission.").x, light.x, 1e-3f * light.x);
  }
}

TEST(VolumeColour, GlowsWithoutDensity) {
  // L = extinction * e * thickness; nothing is hidden by it.
  const auto grid = slab(2.1f, 4.0f, 0.1f);
  const RenderVolume volume(times(*grid, 0), {{}, coloured(*grid, {3, 1, 0.25f})});
  EXPECT_FALSE(volume.isEmpty());
  EXPECT_FALSE(volume.worldBounds().isEmpty());
  const Image image = renderImage(volume, medium(0.7f), {}, needle(), single()).image;
  EXPECT_NEAR(image.at("R", 0, 0), 3 * 0.7f * 2.1f, 0.01f);
  EXPECT_EQ(image.at("A", 0, 0), 0.0f);
}

TEST(VolumeColour, WhatGlowsLightsTheVolumeAroundIt) {
  // A glowing core within a shell that only scatters, an optical depth of 8 across, against the path tracer;
  // the noise of 20000 paths is some 1 %. Where the eye sees the shell beside the core, all light is
  // scattered.
  const auto shell = test::ball(1.0f, 0.1f);
  const auto core = densityGrid(voxels(0.1f), {-12, -12, -12}, {12, 12, 12}, [](const Vec3f& p) {
    return std::fmin(1.0f, std::fmax(0.0f, (0.4f - length(p)) / 0.1f + 0.5f));
  });
  const RenderVolume volume(shell, {{}, coloured(*core, {2, 1, 0.5f})});
  Medium its = medium(4.0f, 0.95f);
  its.phase = Phase::henyeyGreenstein(0.3f);
  PathOptions paths;
  paths.samplesPerPixel = 20000;
  paths.aovs = {};
  RenderOptions options;
  for (const float x : {0.0f, 0.7f}) {
    const Camera camera = Camera::lookingAt({x, 0, 9}, {x, 0, 0}, {0, 1, 0}, {1, 1, 0.001f});
    const Vec3f traced = pixel(pathTraceImage(volume, its, {}, camera, paths).image);
    const Vec3f marched = pixel(renderImage(volume, its, {}, camera, options).image);
    for (int c = 0; c != 3; ++c) EXPECT_NEAR(marched[c] / traced[c], 1, 0.15) << x << " " << c;
  }
}

TEST(VolumeColour, GlowIsDimmedByWhatLiesBeforeIt) {
  // Two slabs: the far one glows and is thin, the near one is dark: L = e k t exp(-tau of the near one), per
  // colour of the extinction.
  const Vec3i low{-40, -40, -30}, high{40, 40, 30};
  const auto density = densityGrid(voxels(0.1f), low, high,
                                   [](const Vec3f& p) { return p.z > 0.95f && p.z < 2.05f ? 1.0f : 0.0f; });
  const auto glow = densityGrid(voxels(0.1f), low, high,
                                [](const Vec3f& p) { return p.z < -0.95f && p.z > -2.05f ? 1.0f : 0.0f; });
  const RenderVolume volume(density, {{}, {glow, glow, glow}});
  Medium its = medium(1.0f);
  its.extinctionColour = {1, 2, 0.5f};
  const Vec3f light = pixel(renderImage(volume, its, {}, needle(), single()).image);
  for (int c = 0; c != 3; ++c)
    EXPECT_NEAR(light[c], 1.1f * std::exp(-1.1f * its.extinctionColour[c]), 5e-3f) << c;
}

TEST(VolumeColour, KernelsAgreeWithTheScalarLoop) {
  const Vec3i low{-20, -20, -20}, high{20, 20, 20};
  const auto grid = densityGrid(voxels(0.1f), low, high, [](const Vec3f& p) {
    return std::fmax(0.0f, std::sin(3 * p.x) * std::cos(4 * p.y) + std::sin(5 * p.z));
  });
  const auto glow = densityGrid(voxels(0.1f), low, high,
                                [](const Vec3f& p) { return std::fmax(0.0f, std::sin(2 * p.x + p.y)); });
  const RenderVolume volume(grid, {coloured(*grid, {0.9f, 0.5f, 0.2f}), coloured(*glow, {2, 1, 0.5f})});
  const test::SunColumns sun({volume, {0.3f, 0.8f, 0.4f}});
  const LightVolume& light = sun.light;
  MarchScene scene = test::sceneOf(volume, sun);
  const auto set = [](const VolumeColour::Grids& grids, MarchScene::ColourBricks& bricks) {
    for (std::size_t c = 0; c != 3; ++c) bricks.values[c] = grids[c]->values().data();
    bricks.table = grids[0]->table().data();
    bricks.count = grids[0]->brickCount();
  };
  set(volume.colour().scattering, scene.colour);
  set(volume.colour().emission, scene.emission);
  scene.extinctionColour[1] = 0.5f;
  scene.colours = scene.skyParts = 3;
  std::vector<float> glowing(2 * 5 * 4 * 3);
  for (std::size_t i = 0; i != glowing.size(); ++i) glowing[i] = 0.5f + 0.4f * std::sin(float(i));
  const Affine toGlow{Mat3f::scaling(0.9f), {2, 1.5f, 1}};
  constexpr int kGlow = MarchScene::Scattered::kGlow;
  scene.scattered = {{glowing.data(), 2, {{kGlow, 0}, {kGlow, 1}}},
                     {glowing.data(), 1, {{kGlow, 2}, {kGlow, 2}}}};
  scene.scatteredSize = {5, 4, 3};
  scene.step = 0.1f;
  scene.leastStep = 0.0125f;
  std::vector<MarchRay> rays;
  for (int i = 0; i != 200; ++i) {
    const Vec3f direction = normalize(Vec3f{std::sin(i * 1.3f), std::sin(i * 2.1f + 1), std::cos(i * 0.7f)});
    const Vec3f origin =
        Vec3f{std::sin(i * 0.9f), std::cos(i * 1.9f), std::sin(i * 0.4f)} * 0.8f - direction * 1.2f;
    MarchRay ray;
    ray.density = {grid->worldToIndex()(origin) - Vec3f(grid->firstBrick() * 8),
                   grid->worldToIndex().linear * direction};
    ray.suns[0] = {light.worldToLattice()(origin) - Vec3f(light.firstBrick() * 8),
                   light.worldToLattice().linear * direction};
    ray.scattered = {toGlow(origin), toGlow.linear * direction};
    ray.length = 2.5f;
    ray.jitter = 0.3f;
    for (int c = 0; c != 3; ++c) ray.weight[0][c][0] = 0.1f * float(c + 1);
    rays.push_back(ray);
  }
  for (const float extinction : {0.05f, 2.0f, 40.0f}) {
    scene.extinction = extinction;
    std::vector<MarchResult> expected(rays.size());
    test::marchRaysScalar(scene, rays, expected);
    test::forEachTarget([&] {
      std::vector<MarchResult> results(rays.size());
      marchRays(scene, rays, results);
      for (std::size_t i = 0; i != rays.size(); ++i)
        for (int c = 0; c != 3; ++c) {
          ASSERT_NEAR(results[i].suns[0][c], expected[i].suns[0][c], 2e-4f) << i << " " << c;
          ASSERT_NEAR(results[i].emission[c], expected[i].emission[c],
                      5e-4f + 1e-4f * expected[i].emission[c])
              << i << " " << c;
        }
    });
  }
}

TEST(VolumeColour, RefusesWhatDoesNotFit) {
  const auto grid = test::ball(1.0f, 0.1f), other = test::ball(2.0f, 0.1f);
  EXPECT_THROW(RenderVolume(grid, {coloured(*other, {1, 1, 1}), {}}), Error);
  EXPECT_THROW(RenderVolume(grid, {{grid, nullptr, grid}, {}}), Error);
  Medium its = medium(1);
  its.extinctionColour = {1, -1, 1};
  EXPECT_THROW(renderImage(RenderVolume(grid), its, {}, needle(), single()), Error);
  EXPECT_THROW(pathTraceImage(RenderVolume(grid), its, {}, needle()), Error);
}

}  // namespace
}  // namespace nephele

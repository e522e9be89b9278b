// Colours that rays ask a field for.
#include <gtest/gtest.h>

#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"
#include "nephele/modeling/shape/shapes.h"
#include "nephele/render/march/path_trace.h"
#include "nephele/render/march/raymarch.h"
#include "nephele/render/volume/field_volume.h"

namespace nephele {
namespace {

constexpr float kVoxel = 0.05f;
const Box kBox{{-1.2f, -1.2f, -1.2f}, {1.2f, 1.2f, 1.2f}};

// A camera with a single, nearly parallel pixel that looks down z.
Camera needle() {
  return Camera::lookingAt({0, 0, 9}, {0, 0, 0}, {0, 1, 0}, {1, 1, 0.001f});
}

Medium white(float extinction) {
  return {extinction, {1, 1, 1}, Phase()};
}

RenderOptions options(int octaves, int samples = 1) {
  RenderOptions result;
  result.octaves.count = octaves;
  result.samples = samples;
  result.aovs = {};
  return result;
}

Vec3f pixel(const Image& image) {
  return {image.at("R", 0, 0), image.at("G", 0, 0), image.at("B", 0, 0)};
}

ScalarField ball() {
  return mask(sphere({0, 0, 0}, 1), 0.1f);
}

// From one colour at the bottom of the ball to another at its top, with bands much narrower than a voxel.
VectorField bands() {
  const ScalarField z = component(position(), 2), wave = 0.5f + 0.5f * sin(z * 200.0f);
  return vectorField(0.5f + 0.5f * z, ScalarField(0.5f), wave);
}

TEST(FieldColour, IsAsTheIntegralOverTheDepth) {
  // A slab of thickness 1 and extinction s, light from behind the camera, scattered once: at a depth d it
  // sends exp(-2 s d) back. Of a colour that is d,  (1 - (1 + 2 s) exp(-2 s)) / (2 s (1 - exp(-2 s)))  of
  // white is left, of 1 - d the rest.
  const ScalarField z = component(position(), 2), depth = 0.5f - z;
  const FieldParts parts{.density = clamp((0.5f - abs(z)) * 1e4f, 0.0f, 1.0f),
                         .box = kBox,
                         .colour = vectorField(ScalarField(1.0f), depth, 1.0f - depth)};
  const RenderVolume slab = gridlessVolume(parts, kVoxel);
  const Lights lights{{{"sun", {0, 0, 1}, {1, 1, 1}}}, {}};
  for (const float s : {0.2f, 1.5f, 5.0f}) {
    const Vec3f found = pixel(renderImage(slab, white(s), lights, needle(), options(1)).image);
    const float left = std::exp(-2 * s), share = (1 - (1 + 2 * s) * left) / (2 * s * (1 - left));
    EXPECT_NEAR(found.y / found.x, share, 0.015f * share) << s;
    EXPECT_NEAR(found.z / found.x, 1 - share, 0.015f * (1 - share)) << s;
  }
}

TEST(FieldColour, OfOneColourActsAsAnAlbedo) {
  const Vec3f colour{0.9f, 0.5f, 0.1f};
  const RenderVolume plain = gridlessVolume(ball(), kBox, kVoxel),
                     painted = gridlessVolume({.density = ball(), .box = kBox, .colour = VectorField(colour)},
                                              kVoxel);
  const Lights lights{{{"sun", {0.5f, 0.7f, 0.5f}, {1, 1, 1}}}, {0.3f, 0.2f, 0.1f}};
  Medium its = white(4.0f);
  its.albedo = colour;
  for (const int octaves : {1, 3}) {
    const Vec3f expected = pixel(renderImage(plain, its, lights, needle(), options(octaves)).image);
    const Vec3f found = pixel(renderImage(painted, white(4.0f), lights, needle(), options(octaves)).image);
    for (int c = 0; c != 3; ++c) EXPECT_NEAR(found[c] / expected[c], 1, 2e-3) << c << " " << octaves;
  }
  PathOptions paths;
  paths.samplesPerPixel = 64;
  // The same random numbers.
  const Vec3f expected = pixel(pathTraceImage(plain, its, lights, needle(), paths).image);
  const Vec3f found = pixel(pathTraceImage(painted, white(4.0f), lights, needle(), paths).image);
  for (int c = 0; c != 3; ++c) EXPECT_NEAR(found[c] / expected[c], 1, 1e-3) << c;
}

TEST(FieldColour, PathsAgreeWithTheMarcherOnceScattered) {
  // Within 4 standard errors of 40000 paths (relative 0.01 each).
  const VectorField colour = vectorField(0.5f + 0.5f * component(position(), 2), ScalarField(0.5f),
                                         0.5f - 0.5f * component(position(), 2));
  const RenderVolume volume = gridlessVolume({.density = ball(), .box = kBox, .colour = colour}, kVoxel);
  const Lights lights{{{"sun", {0.5f, 0.7f, 0.5f}, {1, 1, 1}}}, {}};
  PathOptions paths;
  paths.samplesPerPixel = 40000;
  paths.maxScatterings = 1;
  const Vec3f traced = pixel(pathTraceImage(volume, white(1.0f), lights, needle(), paths).image);
  const Vec3f marched = pixel(renderImage(volume, white(1.0f), lights, needle(), options(1)).image);
  for (int c = 0; c != 3; ++c) EXPECT_NEAR(marched[c] / traced[c], 1, 0.04) << c;
}

// What is finer than the voxels of the light is seen all the same: bands of 0.03 on the side of the ball, in
// pixels of 0.01, which leave 0.84 of their contrast, beside voxels of 0.05.
TEST(FieldColour, IsAsFineAsThePixels) {
  const RenderVolume volume = gridlessVolume({.density = ball(), .box = kBox, .colour = bands()}, kVoxel);
  const Camera camera = Camera::lookingAt({9, 0, 0}, {0, 0, 0}, {0, 1, 0},
                                          {64, 1, float(2 * std::atan(0.32 / 9) * 180 / M_PI)});
  const Lights lights{{{"sun", {1, 0.2f, 0}, {1, 1, 1}}}, {}};
  const Image image = renderImage(volume, white(60.0f), lights, camera, options(1, 4)).image;
  float least = 1, most = 0;
  for (int x = 8; x != 56; ++x) {
    const float share = image.at("B", x, 0) / (2 * image.at("G", x, 0));
    least = std::min(least, share);
    most = std::max(most, share);
  }
  EXPECT_LT(least, 0.2f);
  EXPECT_GT(most, 0.8f);
}

TEST(FieldColour, LooksAsTheSameSampledFinely) {
  const VectorField colour = vectorField(0.5f + 0.5f * component(position(), 2), ScalarField(0.6f),
                                         0.5f - 0.4f * component(position(), 0));
  const FieldParts parts{.density = ball(), .box = kBox, .colour = colour};
  const RenderVolume field = gridlessVolume(parts, kVoxel), grid = sampledVolume(parts, 0.02f);
  const Camera camera = Camera::lookingAt({2, 3, 5}, {0, 0, 0}, {0, 1, 0}, {40, 40, 24});
  const Lights lights{{{"sun", {0.5f, 0.7f, 0.5f}, {3, 3, 3}}}, {0.3f, 0.4f, 0.5f}};
  const Image a = renderImage(field, white(8.0f), lights, camera, options(4, 4)).image,
              b = renderImage(grid, white(8.0f), lights, camera, options(4, 4)).image;
  for (const char* channel : {"R", "G", "B"}) {
    double difference = 0, total = 0;
    for (int y = 0; y != 40; ++y)
      for (int x = 0; x != 40; ++x) {
        difference += std::abs(double(a.at(channel, x, y) - b.at(channel, x, y)));
        total += double(b.at(channel, x, y));
      }
    EXPECT_LT(difference, 0.03 * total) << channel;
  }
}

TEST(FieldColour, IsKeptWithinWhatItMayBe) {
  // Below 0 and above 1.
  const ScalarField z = component(position(), 2);
  const VectorField wild = vectorField(z - 5.0f, -1.0f + 0.0f * z, 7.0f + 0.0f * z);
  const RenderVolume volume = gridlessVolume({.density = ball(), .box = kBox, .colour = wild}, kVoxel);
  const Lights lights{{{"sun", {0.5f, 0.7f, 0.5f}, {1, 1, 1}}}, {}};
  const Vec3f found = pixel(renderImage(volume, white(1.0f), lights, needle(), options(1)).image);
  const Vec3f all = pixel(
      renderImage(gridlessVolume(ball(), kBox, kVoxel), white(1.0f), lights, needle(), options(1)).image);
  EXPECT_EQ(found.x, 0);
  EXPECT_EQ(found.y, 0);
  EXPECT_NEAR(found.z / all.z, 1, 2e-3);
}

TEST(FieldColour, AShareBelow0IsRefused) {
  EXPECT_THROW(gridlessVolume({.density = ball(), .box = kBox, .share = -1}, kVoxel), Error);
}

TEST(FieldColour, AShareMultipliesTheDensity) {
  const Lights lights{{{"sun", {0.5f, 0.7f, 0.5f}, {1, 1, 1}}}, {}};
  const auto seen = [&](float share, float extinction) {
    const RenderVolume volume = gridlessVolume({.density = ball(), .box = kBox, .share = share}, kVoxel);
    return pixel(renderImage(volume, white(extinction), lights, needle(), options(1)).image).x;
  };
  EXPECT_NEAR(seen(0.5f, 4), seen(1, 2), 1e-3 * double(seen(1, 2)));
}

}  // namespace
}  // namespace nephele

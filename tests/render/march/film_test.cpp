#include "nephele/render/march/film.h"

#include <gtest/gtest.h>

#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/render/march/path_trace.h"
#include "nephele/render/march/pixel_points.h"
#include "nephele/render/march/raymarch.h"
#include "tests/support/density.h"

namespace nephele {
namespace {

using test::ball;
using test::slab;

// Four pixels at distance 9 that see a unit at the middle as 4 / 3 pixels.
Camera front(double fovDegrees = 2 * 18.434949) {
  return Camera::lookingAt({0, 0, 9}, {0, 0, 0}, {0, 1, 0}, {8, 8, float(fovDegrees)});
}

Medium medium(float extinction) {
  return {.extinction = extinction, .albedo = {0.5f, 0.25f, 1.0f}};
}

Image layers(const RenderVolume& volume, float extinction, const Camera& camera, RenderOptions options = {}) {
  options.octaves.count = 1;
  options.aovs = Film::layerNames();
  return renderImage(volume, medium(extinction), {{{"sun", {1, 1, 1}, {1, 1, 1}}}, {0.1f, 0.1f, 0.1f}},
                     camera, options)
      .image;
}

TEST(Film, RefusesLayersThatItDoesNotKnowOrHasAlready) {
  EXPECT_THROW(Film(front(), {"sky"}, {"depth"}), Error);
  EXPECT_THROW(Film(front(), {"sky"}, {"Z", "Z"}), Error);
  EXPECT_THROW(Film(front(), {"sun", "sun"}, {"light"}), Error);
}

TEST(Film, CountsItsChannels) {
  for (const std::string& name : Film::layerNames())
    EXPECT_EQ(Film::channelCount({name}, 3), Film(front(), {"a", "b", "sky"}, {name}).image().channels.size())
        << name;
}

TEST(PixelPoints, FindTheMedianAndMeanOfOpacity) {
  // Behind the face of a slab from z = 1.05 on, opacity grows as 1 - exp(-sigma s) until s = 2.1: the median
  // is where it is half of the whole, the mean by integration of s sigma exp(-sigma s).
  const RenderVolume volume(slab(2.1f, 9.0f, 0.1f));
  for (const float sigma : {0.1f, 1.0f, 3.0f}) {
    const Image image = layers(volume, sigma, front(0.01));
    const double end = 2.1 * sigma, whole = 1 - std::exp(-end);
    EXPECT_NEAR(image.at("Z_median", 4, 4), 9 - 1.05 - std::log(1 - whole / 2) / sigma, 0.03) << sigma;
    EXPECT_NEAR(image.at("Z_mean", 4, 4), 9 - 1.05 + (1 - (1 + end) * std::exp(-end)) / (sigma * whole), 0.03)
        << sigma;
    EXPECT_NEAR(image.at("P.Z", 4, 4), 9 - image.at("Z_median", 4, 4), 1e-4) << sigma;
    // Albedo times opacity.
    EXPECT_NEAR(image.at("albedo.G", 4, 4), 0.25 * whole, 0.01) << sigma;
  }
}

TEST(PixelPoints, LieOnTheBallAndFaceOutwards) {
  const RenderVolume volume(ball(2.0f, 0.05f));
  const Image image = layers(volume, 400.0f, front());
  int seen = 0;
  for (int y = 0; y != 8; ++y)
    for (int x = 0; x != 8; ++x) {
      const Vec3f p{image.at("P.X", x, y), image.at("P.Y", x, y), image.at("P.Z", x, y)},
          n{image.at("N.X", x, y), image.at("N.Y", x, y), image.at("N.Z", x, y)};
      if (std::isinf(image.at("Z_median", x, y))) {
        EXPECT_EQ(p, Vec3f{});
        EXPECT_EQ(n, Vec3f{});
        continue;
      }
      ++seen;
      EXPECT_NEAR(length(p), 2, 0.06);
      EXPECT_GT(dot(n, normalize(p)), 0.985f);
      // The ray of the pixel's centre ends there.
      const Vec3d back = front().project(Vec3d(p));
      EXPECT_NEAR(back.x, x + 0.5, 1e-3);
      EXPECT_NEAR(back.y, y + 0.5, 1e-3);
      EXPECT_NEAR(back.z, image.at("Z_median", x, y), 1e-3);
      EXPECT_EQ(image.at("motion.X", x, y), 0);
    }
  EXPECT_GT(seen, 15);
}

TEST(PixelPoints, MoveWithTheVolumeAndTheCamera) {
  const RenderVolume volume(ball(2.0f, 0.1f));
  RenderOptions options;
  options.samples = 16;
  options.shutter = {-0.25, 0.25};
  options.volumeMotion = RigidMotion{{0.3, -0.6, 0}, {}, {}};
  // At the front of the ball, 7 away, a unit is 8 / (2 * 7 / 3) pixels.
  const Image moved = layers(volume, 400.0f, front(), options);
  const float scale = 8 / (2 * moved.at("Z_median", 4, 4) / 3);
  EXPECT_NEAR(moved.at("motion.X", 4, 4), 0.3f * scale, 0.01f);
  EXPECT_NEAR(moved.at("motion.Y", 4, 4), 0.6f * scale, 0.01f);
  // A camera that goes the other way sees the same; by its shutter, or by where it is a frame later.
  const Vec3f way{-0.3f, 0.6f, 0};
  const auto at = [&](float frames) {
    return Camera::lookingAt(Vec3f{0, 0, 9} + way * frames, way * frames, {0, 1, 0}, {8, 8, 2 * 18.434949f});
  };
  options.volumeMotion.reset();
  const Camera poses[] = {at(-0.25f), at(0.25f)};
  const Image shutter = layers(volume, 400.0f, front().withShutter(poses), options);
  RenderOptions next;
  next.nextCamera = at(1);
  const Image later = layers(volume, 400.0f, front(), next);
  for (const Image* image : {&shutter, &later}) {
    EXPECT_NEAR(image->at("motion.X", 4, 4), 0.3f * scale, 0.01f);
    EXPECT_NEAR(image->at("motion.Y", 4, 4), 0.6f * scale, 0.01f);
  }
}

TEST(PixelPoints, AreThoseOfTheMarchInPathTracedPictures) {
  const RenderVolume volume(ball(2.0f, 0.2f));
  PathOptions options;
  options.samplesPerPixel = 1;
  options.aovs = {"Z_median", "position", "light"};
  const Image image =
      pathTraceImage(volume, medium(20.0f), {{{"sun", {1, 1, 1}, {1, 1, 1}}}, {}}, front(), options).image;
  EXPECT_EQ(image.channel("Z_median").values, layers(volume, 20.0f, front()).channel("Z_median").values);
}

}  // namespace
}  // namespace nephele

// Pictures of which only some pixels are marched.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "nephele/modeling/base/error.h"
#include "nephele/render/march/film.h"
#include "nephele/render/march/raymarch.h"
#include "tests/support/density.h"

namespace nephele {
namespace {

using test::ball;

constexpr int kWidth = 150, kHeight = 110;

RenderResult softBall(float threshold, const std::optional<PixelBox>& crop = {}) {
  static const RenderVolume volume(ball(1.0f, 0.05f));
  RenderOptions options;
  options.octaves.count = 1;
  options.adaptiveThreshold = threshold;
  options.aovs = {"Z", "transmittance", "albedo", "light", "normal"};
  const Medium medium{.extinction = 3, .albedo = {0.9f, 0.8f, 0.7f}};
  const Lights lights{{{"sun", {1, 1, 0.5f}, {9, 8, 7}}}, {0.1f, 0.2f, 0.3f}};
  Camera::Frame frame{kWidth, kHeight, 30};
  frame.crop = crop;
  const Camera camera = Camera::framing(volume.outline(), 20, 10, frame);
  return renderImage(volume, medium, lights, camera, options);
}

TEST(AdaptivePicture, MarchesLessThanHalfOfASmoothPictureAndDiffersByLessThanItsThreshold) {
  const RenderResult full = softBall(0), adaptive = softBall(0.05f);
  EXPECT_EQ(full.rays, std::uint64_t(kWidth) * kHeight * 4);
  // A sixteenth and the tiles' borders are marched in any case.
  EXPECT_LT(adaptive.rays, full.rays / 2);
  EXPECT_GT(adaptive.rays, full.rays / 16);
  for (const char* name : {"R", "G", "B", "A", "transmittance.G", "light_sun.R", "light_sky.B"}) {
    const auto &exact = full.image.channel(name).values, &near = adaptive.image.channel(name).values;
    const float most = *std::max_element(exact.begin(), exact.end());
    for (std::size_t i = 0; i != exact.size(); ++i) ASSERT_NEAR(near[i], exact[i], 0.05f * most) << name;
  }
  // What the rays through the centres meet is never interpolated.
  for (const char* name : {"N.X", "N.Y", "N.Z"})
    EXPECT_EQ(full.image.channel(name).values, adaptive.image.channel(name).values);
}

TEST(AdaptivePicture, MarchedPixelsAreThoseOfTheFullPicture) {
  const RenderResult full = softBall(0), adaptive = softBall(0.01f);
  const auto &exact = full.image.channel("R").values, &near = adaptive.image.channel("R").values;
  std::uint64_t same = 0;
  for (std::size_t i = 0; i != exact.size(); ++i) same += exact[i] == near[i];
  EXPECT_GE(same, adaptive.rays / 4);
  // Pixels of a tile's first corner, every fourth of every fourth row.
  for (int y = 0; y < kHeight; y += 4)
    for (int x = 0; x < kWidth; x += 4)
      ASSERT_EQ(near[std::size_t(y) * kWidth + std::size_t(x)],
                exact[std::size_t(y) * kWidth + std::size_t(x)]);
}

TEST(AdaptivePicture, KeepsLayersTogether) {
  const Image image = softBall(0.1f).image;
  for (int y = 0; y != image.height; ++y)
    for (int x = 0; x != image.width; ++x) {
      for (const std::string channel : {"R", "G", "B"})
        ASSERT_NEAR(image.at(channel, x, y),
                    image.at("light_sun." + channel, x, y) + image.at("light_sky." + channel, x, y), 1e-6f);
      ASSERT_NEAR(image.at("transmittance.G", x, y), 1 - image.at("A", x, y), 1e-6f);
    }
}

TEST(AdaptivePicture, TheSmallestThresholdIsTheFullPictureWithinRounding) {
  const RenderResult full = softBall(0), adaptive = softBall(1e-7f);
  for (std::size_t c = 0; c != full.image.channels.size(); ++c)
    for (std::size_t i = 0; i != full.image.channels[c].values.size(); ++i) {
      const float exact = full.image.channels[c].values[i];
      if (std::isfinite(exact)) {
        ASSERT_NEAR(adaptive.image.channels[c].values[i], exact, 1e-6f) << full.image.channels[c].name;
      }
    }
}

TEST(AdaptivePicture, IsTheSameAtAnyNumberOfThreads) {
  const RenderResult many = softBall(0.03f);
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
  const RenderResult one = softBall(0.03f);
  EXPECT_EQ(many.rays, one.rays);
  for (std::size_t c = 0; c != many.image.channels.size(); ++c)
    EXPECT_EQ(many.image.channels[c].values, one.image.channels[c].values) << many.image.channels[c].name;
}

TEST(AdaptivePicture, PartsAreThoseOfTheWholeAsInOtherPictures) {
  for (const float threshold : {0.0f, 0.05f}) {
    const Image whole = softBall(threshold).image;
    for (const PixelBox& crop : {PixelBox{20, 10, 121, 93}, PixelBox{63, 31, 66, 33},
                                 PixelBox{77, 50, 78, 51}, PixelBox{0, 96, 150, 110}}) {
      const RenderResult part = softBall(threshold, crop);
      ASSERT_EQ(part.image.width, crop.width());
      for (const Image::Channel& channel : part.image.channels)
        for (int y = 0; y != crop.height(); ++y)
          for (int x = 0; x != crop.width(); ++x)
            ASSERT_EQ(channel.values[std::size_t(y * crop.width() + x)],
                      whole.at(channel.name, crop.x0 + x, crop.y0 + y))
                << channel.name << " at " << crop.x0 + x << ", " << crop.y0 + y;
    }
  }
  // What one pixel may depend on is few.
  EXPECT_LE(softBall(0.05f, PixelBox{77, 50, 78, 51}).rays, 4u * 30);
}

TEST(Film, InterpolatesWhereFourPixelsAgree) {
  const Camera camera = Camera::lookingAt({0, 0, 9}, {0, 0, 0}, {0, 1, 0}, {5, 1, 30});
  Film film(camera, {"sun"}, {"Z"});
  const float brightness[] = {1.0f, 0.96f, 0.98f, 0.97f};
  for (std::size_t i = 0; i != 4; ++i) {
    PixelSum pixel;
    pixel.light[0] = Vec3f{1, 0.5f, 0} * brightness[i];
    pixel.alpha = 0.5f;
    pixel.depth = 3 + float(i);
    film.set(i, pixel);
  }
  EXPECT_FALSE(film.interpolate(4, {0, 1, 2, 3}, 0.039f, 0));
  EXPECT_EQ(film.image().at("R", 4, 0), 0.0f);
  // Differences of 4 % of the brightest.
  EXPECT_TRUE(film.interpolate(4, {0, 1, 2, 3}, 0.041f, 0));
  EXPECT_NEAR(film.image().at("R", 4, 0), 0.9775f, 1e-6f);
  EXPECT_NEAR(film.image().at("G", 4, 0), 0.48875f, 1e-6f);
  EXPECT_EQ(film.image().at("Z", 4, 0), 3.0f);
  // Of 0.04 they are 1 % of a brightness of 4.
  EXPECT_TRUE(film.interpolate(4, {0, 1, 2, 3}, 0.011f, 4));
  PixelSum nothing;
  nothing.light[0] = {1, 0.5f, 0};
  nothing.alpha = 0.5f;
  film.set(3, nothing);
  EXPECT_FALSE(film.interpolate(4, {0, 1, 2, 3}, 1, 0)) << "a ray that meets nothing has no depth";
}

TEST(AdaptivePicture, RefusesWhatItCannotDo) {
  EXPECT_THROW(softBall(-0.1f), Error);
  EXPECT_THROW(softBall(1.5f), Error);
  EXPECT_THROW(softBall(NAN), Error);
  const RenderVolume volume(ball(1.0f, 0.25f));
  RenderOptions options;
  options.adaptiveThreshold = 0.1f;
  options.deep.emplace();
  EXPECT_THROW(renderImage(volume, {}, {}, Camera::framing(volume.outline(), 0, 0, {8, 8, 30}), options),
               Error);
}

}  // namespace
}  // namespace nephele

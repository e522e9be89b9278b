// What lenses, shutters and crops of cameras do to pictures.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "nephele/render/march/path_trace.h"
#include "nephele/render/march/raymarch.h"
#include "nephele/render/scene/camera.h"
#include "nephele/render/scene/lights.h"
#include "tests/support/density.h"

namespace nephele {
namespace {

// Alpha of the middle row of a picture.
std::vector<float> profile(const RenderVolume& volume, const Camera& camera, RenderOptions options,
                           float extinction = 200) {
  const Image image = renderImage(volume, {extinction, {1, 1, 1}, Phase()}, {}, camera, options).image;
  std::vector<float> row;
  for (int x = 0; x != image.width; ++x) row.push_back(image.at("A", x, image.height / 2));
  return row;
}

TEST(Lens, BlursAnEdgeByTheThinLensFormula) {
  // The edge of an opaque ball far off its focus, as good as straight: alpha is the share of the lens that
  // sees it, acos(t) - t sqrt(1 - t^2) over pi at t radii beside the edge.
  const RenderVolume volume(test::ball(4.0f, 0.1f));
  const Camera::Frame frame{161, 3, 40.0f, Camera::Projection::orthographic, 3.2f};
  const Camera camera = Camera::lookingAt({4, 0, 20}, {4, 0, 0}, {0, 1, 0}, frame);
  RenderOptions options;
  options.samples = 256;
  // Where the edge is, which the voxels soften, a sharp picture says.
  double edge = -1.6;
  for (const float alpha : profile(volume, camera, options)) edge += alpha * 3.2 / 161;
  // At depth 20 with the focus at 10 it is blurred over 0.5 |1 - 20 / 10| = 0.5 world units.
  const std::vector<float> row = profile(volume, camera.withLens({0.5, 10}), options);
  for (int x = 0; x != 161; ++x) {
    const double t = std::clamp(((x + 0.5) * 3.2 / 161 - 1.6 - edge) / 0.5, -1.0, 1.0);
    EXPECT_NEAR(row[std::size_t(x)], (std::acos(t) - t * std::sqrt(1 - t * t)) / kPi, 0.03) << x;
  }
}

TEST(MotionBlur, IsTheMeanOfStillPictures) {
  const RenderVolume volume(test::ball(1.0f, 0.1f));
  const Camera::Frame frame{64, 3, 30.0f};
  RenderOptions options;
  options.samples = 256;
  const Vec3f from{0, 0, 12}, to{0, 0, 0};
  // The ball moves by 3 to the right in the frame, of which the shutter sees 0.1 to 0.7.
  RenderOptions moving = options;
  moving.shutter = {0.1, 0.7};
  moving.volumeMotion = RigidMotion{{3, 0, 0}, {}, {}};
  const Camera still = Camera::lookingAt(from, to, {0, 1, 0}, frame);
  const std::vector<float> blurred = profile(volume, still, moving, 2);
  // A camera that moves to the left meanwhile sees the same.
  std::vector<Camera> poses;
  for (const float frames : {0.1f, 0.4f, 0.7f}) {
    const Vec3f aside{-3 * frames, 0, 0};
    poses.push_back(Camera::lookingAt(from + aside, to + aside, {0, 1, 0}, frame));
  }
  const std::vector<float> passed = profile(volume, still.withShutter(poses), options, 2);
  std::vector<double> mean(64);
  const int times = 48;
  for (int i = 0; i != times; ++i) {
    const Vec3f aside{-3 * (0.1f + 0.6f * (float(i) + 0.5f) / times), 0, 0};
    const Camera camera = Camera::lookingAt(from + aside, to + aside, {0, 1, 0}, frame);
    RenderOptions few = options;
    few.samples = 16;
    const std::vector<float> row = profile(volume, camera, few, 2);
    for (std::size_t x = 0; x != 64; ++x) mean[x] += row[x] / times;
  }
  for (std::size_t x = 0; x != 64; ++x) {
    EXPECT_NEAR(blurred[x], mean[x], 0.01) << x;
    EXPECT_NEAR(passed[x], mean[x], 0.01) << x;
  }
}

TEST(Crop, MakesTheSamePixelsAsTheWholePicture) {
  const RenderVolume volume(test::ball(1.0f, 0.1f));
  Camera::Frame frame{40, 30, 30.0f};
  RenderOptions options;
  const auto picture = [&](bool blurred) {
    Camera camera = Camera::framing(volume.outline(), 20, 10, frame);
    if (blurred) camera = camera.withLens({0.4, 3});
    return renderImage(volume, {5, {1, 1, 1}, Phase()}, {{{"sun", {1, 1, 1}, {1, 1, 1}}}, {}}, camera,
                       options)
        .image;
  };
  for (const bool blurred : {false, true}) {
    frame.crop.reset();
    const Image whole = picture(blurred);
    EXPECT_FALSE(whole.display);
    frame.crop = PixelBox{13, 5, 30, 21};
    const Image part = picture(blurred);
    ASSERT_EQ(part.width, 17);
    ASSERT_EQ(part.height, 16);
    EXPECT_EQ(part.display, (Image::Display{13, 5, 40, 30}));
    for (int y = 0; y != part.height; ++y)
      for (int x = 0; x != part.width; ++x)
        for (const char* channel : {"R", "A", "Z"})
          ASSERT_EQ(part.at(channel, x, y), whole.at(channel, x + 13, y + 5)) << x << " " << y;
  }
}

TEST(Crop, AndBlurAreThePathTracersToo) {
  const RenderVolume volume(test::ball(1.0f, 0.1f));
  Camera::Frame frame{24, 16, 40.0f};
  const Medium medium{5, {1, 1, 1}, Phase()};
  PathOptions paths;
  paths.samplesPerPixel = 256;
  paths.shutter = {-0.5, 0.5};
  paths.volumeMotion = RigidMotion{{1, 0, 0}, {}, {}};
  RenderOptions marched;
  marched.samples = 256;
  marched.shutter = paths.shutter;
  marched.volumeMotion = paths.volumeMotion;
  const auto camera = [&] {
    return Camera::lookingAt({0, 0, 6}, {0, 0, 0}, {0, 1, 0}, frame).withLens({0.3, 3});
  };
  const Image whole = pathTraceImage(volume, medium, {}, camera(), paths).image;
  const Image truth = renderImage(volume, medium, {}, camera(), marched).image;
  frame.crop = PixelBox{5, 3, 20, 12};
  const Image part = pathTraceImage(volume, medium, {}, camera(), paths).image;
  EXPECT_EQ(part.display, (Image::Display{5, 3, 24, 16}));
  for (int y = 0; y != part.height; ++y)
    for (int x = 0; x != part.width; ++x) {
      ASSERT_EQ(part.at("A", x, y), whole.at("A", x + 5, y + 3));
      // Four standard deviations of a share of 256 paths, at most.
      ASSERT_NEAR(part.at("A", x, y), truth.at("A", x + 5, y + 3), 4 * 0.5 / 16);
    }
}

TEST(Camera, SeesFromInsideTheVolume) {
  // From the middle of a ball of radius 1 every direction crosses the same density, near the image plane too.
  const RenderVolume volume(test::ball(1.0f, 0.05f));
  for (const double lens : {0.0, 0.01}) {
    Camera camera = Camera::lookingAt({0, 0, 0}, {0.3f, 0.2f, -1}, {0, 1, 0}, {9, 7, 100.0f});
    if (lens > 0) camera = camera.withLens({lens, 0.5});
    RenderOptions options;
    options.step = 0.01f;  // finds the edge
    const Image image = renderImage(volume, {0.8f, {1, 1, 1}, Phase()}, {}, camera, options).image;
    for (const float alpha : image.channel("A").values) EXPECT_NEAR(alpha, 1 - std::exp(-0.8f), 0.005f);
    for (const float depth : image.channel("Z").values) EXPECT_LT(depth, 0.06f);
  }
}

}  // namespace
}  // namespace nephele

#include "nephele/render/image/deep_image.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "nephele/modeling/base/error.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/march/raymarch.h"
#include "nephele/render/scene/holdout.h"
#include "nephele/render/volume/volume_parts.h"
#include "tests/support/density.h"
#include "tests/support/run_program.h"

namespace nephele {
namespace {

using test::ball;
using test::TemporaryFolder;

Camera front(int size = 24) {
  return Camera::lookingAt({0, 0, 9}, {0, 0, 0}, {0, 1, 0}, {size, size, 20.0f});
}

RenderOptions deepOptions(float tolerance = 0.004f) {
  RenderOptions options;
  options.octaves.count = 1;
  options.deep = DeepOptions{tolerance};
  return options;
}

const Lights kLights{{{"sun", {0.5f, 0.7f, 0.3f}, {3, 2.5f, 2}}}, {0.1f, 0.2f, 0.4f}};

Medium medium(float extinction) {
  return {.extinction = extinction, .albedo = {0.9f, 0.8f, 0.7f}};
}

void expectTidy(const std::vector<DeepSample>& samples) {
  float last = 0;
  for (const DeepSample& sample : samples) {
    ASSERT_GE(sample.z, last);
    ASSERT_GE(sample.zBack, sample.z);
    ASSERT_GE(sample.alpha, 0);
    ASSERT_LE(sample.alpha, 1);
    last = sample.zBack;
  }
}

TEST(DeepImage, FlattensToThePicture) {
  const RenderVolume volume(ball(1.0f, 0.05f));
  for (const float extinction : {0.3f, 3.0f, 60.0f}) {
    const RenderResult result = renderImage(volume, medium(extinction), kLights, front(), deepOptions());
    ASSERT_TRUE(result.deep);
    EXPECT_GT(result.deep->sampleCount(), 24u * 24u / 4);
    for (int y = 0; y != 24; ++y)
      for (int x = 0; x != 24; ++x) {
        expectTidy(result.deep->at(x, y));
        const FlatPixel flat = flattened(result.deep->at(x, y));
        // Half of the last digit of a 16 bit float below 1, and of the brightest colour here.
        ASSERT_NEAR(flat.alpha, result.image.at("A", x, y), 2.5e-4f);
        ASSERT_NEAR(flat.colour.x, result.image.at("R", x, y), 5e-4f);
        ASSERT_NEAR(flat.colour.z, result.image.at("B", x, y), 5e-4f);
      }
  }
}

TEST(DeepImage, HoldsTheOpacityInFrontOfEveryDepth) {
  // Beer's law from the front of a ball: 1 - exp(-sigma (z - 8)), seen by a needle.
  const RenderVolume volume(ball(1.0f, 0.025f));
  const Camera needle = Camera::lookingAt({0, 0, 9}, {0, 0, 0}, {0, 1, 0}, {1, 1, 0.001f});
  const RenderResult result = renderImage(volume, medium(1.0f), kLights, needle, deepOptions());
  const Holdout holdout(*result.deep);
  std::size_t cursor = 0;
  for (float z = 8.05f; z < 10; z += 0.05f)
    EXPECT_NEAR(holdout.at(0, 0).transmittance(z, cursor), std::exp(-(z - 8)), 0.004f + 0.002f) << z;
  // A homogeneous medium with even colour needs few samples.
  EXPECT_LT(result.deep->at(0, 0).size(), 12u);
}

TEST(DeepImage, TakesFewerSamplesWhereMoreErrorIsAllowed) {
  const RenderVolume volume(ball(1.0f, 0.05f));
  const auto count = [&](float tolerance) {
    return renderImage(volume, medium(5.0f), kLights, front(), deepOptions(tolerance)).deep->sampleCount();
  };
  EXPECT_GT(count(0.001f), count(0.01f));
  EXPECT_GT(count(0.01f), count(0.1f));
}

TEST(DeepImage, IsWrittenAndReadAgain) {
  const TemporaryFolder folder;
  const RenderVolume volume(ball(1.0f, 0.1f));
  Camera::Frame frame{40, 30, 20.0f};
  frame.crop = PixelBox{7, 3, 29, 22};
  const Camera camera = Camera::lookingAt({0, 0, 9}, {0, 0, 0}, {0, 1, 0}, frame);
  const DeepImage image = *renderImage(volume, medium(3.0f), kLights, camera, deepOptions()).deep;
  writeDeepExr(folder.file("a.exr"), image, camera, {{"version", "1.2"}});
  const DeepImage read = readDeepExr(folder.file("a.exr"));
  ASSERT_EQ(read.width, 22);
  ASSERT_EQ(read.height, 19);
  EXPECT_EQ(read.display, image.display);
  for (std::size_t i = 0; i != image.pixels.size(); ++i) {
    ASSERT_EQ(read.pixels[i].size(), image.pixels[i].size());
    for (std::size_t k = 0; k != read.pixels[i].size(); ++k) {
      ASSERT_EQ(read.pixels[i][k].z, image.pixels[i][k].z);
      ASSERT_EQ(read.pixels[i][k].zBack, image.pixels[i][k].zBack);
      ASSERT_EQ(read.pixels[i][k].alpha, image.pixels[i][k].alpha);
      ASSERT_EQ(read.pixels[i][k].colour, image.pixels[i][k].colour);
    }
  }
  EXPECT_THROW(readDeepExr(folder.file("a.exr"), 1000), Error);
  EXPECT_THROW(readDeepExr(folder.file("none.exr")), Error);
  Image flat;
  flat.width = flat.height = 2;
  flat.add("Z");
  writeExr(folder.file("flat.exr"), flat, camera);
  EXPECT_THROW(readDeepExr(folder.file("flat.exr")), Error);
  // Cut short.
  const std::string whole = test::textOf(folder.file("a.exr"));
  std::ofstream(folder.file("cut.exr"), std::ios::binary) << whole.substr(0, whole.size() / 2);
  EXPECT_THROW(readDeepExr(folder.file("cut.exr")), Error);
}

// Under UndefinedBehaviorSanitizer: rows of nothing have no memory.
TEST(DeepImage, MayHoldNothing) {
  const TemporaryFolder folder;
  const DeepImage image{.width = 3, .height = 2, .pixels = std::vector<std::vector<DeepSample>>(6)};
  writeDeepExr(folder.file("a.exr"), image, ImageCamera{});
  const DeepImage read = readDeepExr(folder.file("a.exr"));
  EXPECT_EQ(read.pixels.size(), 6u);
  EXPECT_EQ(read.sampleCount(), 0u);
}

TEST(DeepImage, IsDescribedByItsSamples) {
  DeepImage image{.width = 3, .height = 2, .pixels = std::vector<std::vector<DeepSample>>(6)};
  image.pixels[1] = {{.z = 2, .zBack = 3, .alpha = 0.5f, .colour = {0.25f, 0, 0}}};
  image.pixels[5] = {{.z = 1.5f, .zBack = 2, .alpha = 0.25f, .colour = {0, 0, 0}},
                     {.z = 4, .zBack = 7, .alpha = 1, .colour = {0.5f, 0, 0}}};
  const TemporaryFolder folder;
  writeDeepExr(folder.file("deep.exr"), image, front(), {});
  const std::vector<std::string> lines = describeImage(folder.file("deep.exr"));
  const std::vector<std::string> expected{"deep image 3 x 2, 6 channels, OpenEXR",
                                          "samples: 3, 0.5 per pixel, 2 at most; 4 pixels have none",
                                          "channel A: half, 0.25 to 1",
                                          "channel B: half, 0 to 0",
                                          "channel G: half, 0 to 0",
                                          "channel R: half, 0 to 0.5",
                                          "channel Z: float, 1.5 to 4",
                                          "channel ZBack: float, 2 to 7"};
  ASSERT_GT(lines.size(), expected.size());
  EXPECT_EQ(std::vector(lines.begin(), lines.begin() + std::ptrdiff_t(expected.size())), expected);
}

TEST(Holdout, LetsThroughTheProductOfItsSamples) {
  DeepImage image;
  image.width = image.height = 1;
  image.pixels = {{{4, 4, 0.5f, {}}, {1, 3, 0.75f, {}}, {2, 3, 0.36f, {}}, {5, 6, 1.0f, {}}}};
  const Holdout holdout(image);
  const HoldoutCurve curve = holdout.at(0, 0);
  // (1 - alpha) to the share that is passed, sample by sample.
  const std::pair<float, float> expected[] = {{0.5f, 1},          {2, 0.5f},     {2.5f, 0.35355339f * 0.8f},
                                              {3, 0.25f * 0.64f}, {3.9f, 0.16f}, {4, 0.08f},
                                              {4.5f, 0.08f},      {5.01f, 0},    {9, 0}};
  for (const auto& [z, through] : expected) {
    std::size_t cursor = 0;
    EXPECT_NEAR(curve.transmittance(z, cursor), through, 1e-6f) << z;
  }
  EXPECT_TRUE(holdout.at(1, 0).empty());
}

// One sample for every pixel.
std::shared_ptr<const Holdout> wall(int size, const DeepSample& sample) {
  DeepImage image;
  image.width = image.height = size;
  image.pixels.assign(std::size_t(size * size), {sample});
  return std::make_shared<const Holdout>(image);
}

TEST(Holdout, KeepsWhatIsInFrontOfIt) {
  // Half of the light is lost in the front half of a ball, before a wall through its middle: alpha 0.5, not
  // 0.
  const RenderVolume volume(ball(1.0f, 0.025f));
  const Camera needle = Camera::lookingAt({0, 0, 9}, {0, 0, 0}, {0, 1, 0}, {1, 1, 0.001f});
  RenderOptions options = deepOptions();
  options.samples = 1;
  const float sigma = std::log(2.0f);
  options.holdout = wall(1, {9, 9, 1, {}});
  const RenderResult held = renderImage(volume, medium(sigma), kLights, needle, options);
  EXPECT_NEAR(held.image.at("A", 0, 0), 0.5f, 0.004f);
  EXPECT_NEAR(flattened(held.deep->at(0, 0)).alpha, held.image.at("A", 0, 0), 2.5e-4f);
  EXPECT_NEAR(held.image.at("Z", 0, 0), 8, 0.06f);
  // In front of all, nothing is left.
  options.holdout = wall(1, {2, 2, 1, {}});
  EXPECT_EQ(renderImage(volume, medium(sigma), kLights, needle, options).image.at("A", 0, 0), 0);
  EXPECT_TRUE(std::isinf(renderImage(volume, medium(sigma), kLights, needle, options).image.at("Z", 0, 0)));
  // A grey one in front takes its share of everything.
  const Image whole = renderImage(volume, medium(sigma), kLights, needle, deepOptions()).image;
  options.holdout = wall(1, {2, 3, 0.25f, {}});
  const Image grey = renderImage(volume, medium(sigma), kLights, needle, options).image;
  for (const char* channel : {"R", "B", "A"})
    EXPECT_NEAR(grey.at(channel, 0, 0) / whole.at(channel, 0, 0), 0.75f, 0.005f) << channel;
}

TEST(Holdout, ElementsHeldOutByEachOtherAddUpToTheWhole) {
  // Two balls that overlap in the picture and, in the middle, in space; their lights do not see each other,
  // so only opacity is compared: 1 - (1 - A) (1 - B), for parallel rays through both alike.
  const auto at = [](float x, float z) {
    return RenderVolume(
        test::densityGrid(test::voxels(0.05f), {-30, -30, -30}, {30, 30, 30}, [=](const Vec3f& p) {
          return std::clamp((0.8f - length(p - Vec3f{x, 0, z})) / 0.05f + 0.5f, 0.0f, 1.0f);
        }));
  };
  const RenderVolume a = at(-0.2f, 0.3f), b = at(0.2f, -0.3f);
  RenderOptions options = deepOptions(0.001f);
  // Short steps: compared is what is held out, not where steps end.
  options.step = 0.0125f;
  const RenderResult wholeA = renderImage(a, medium(1.0f), kLights, front(), options),
                     wholeB = renderImage(b, medium(2.0f), kLights, front(), options);
  RenderOptions behind = options;
  behind.holdout = std::make_shared<const Holdout>(*wholeB.deep);
  const Image heldA = renderImage(a, medium(1.0f), kLights, front(), behind).image;
  behind.holdout = std::make_shared<const Holdout>(*wholeA.deep);
  const Image heldB = renderImage(b, medium(2.0f), kLights, front(), behind).image;
  // Behind the rims of the balls, pixels hold means of rays, whose products are not the products of means.
  for (int y = 10; y != 14; ++y)
    for (int x = 10; x != 14; ++x)
      EXPECT_NEAR(heldA.at("A", x, y) + heldB.at("A", x, y),
                  1 - (1 - wholeA.image.at("A", x, y)) * (1 - wholeB.image.at("A", x, y)), 0.002f);
}

TEST(Holdout, ElementsOfOtherVoxelsAddUpToTheirSum) {
  // Two balls with edges of a voxel, of voxels that do not divide each other, side by side and overlapping:
  // the picture of both is marched on the finer voxels.
  const auto at = [](float x, float z, float voxel) {
    VolumePart part;
    const int n = int(1.5f / voxel);
    part.density = test::densityGrid(test::voxels(voxel), {-n, -n, -n}, {n, n, n}, [=](const Vec3f& p) {
      return std::clamp((0.8f - length(p - Vec3f{x, 0, z})) / voxel, 0.0f, 1.0f);
    });
    return part;
  };
  const VolumePart a = at(-0.3f, 0.3f, 0.0643f), b = at(0.3f, -0.3f, 0.1f);
  RenderOptions options = deepOptions(0.001f);
  options.step = 0.0125f;
  options.samples = 16;
  const RenderVolume volumeA = combine({a}), volumeB = combine({b}), volume = combine({a, b});
  const auto heldOutBy = [&](const RenderVolume& seen, const RenderVolume& other) {
    RenderOptions held = options;
    held.holdout =
        std::make_shared<const Holdout>(*renderImage(other, medium(20), kLights, front(), options).deep);
    return renderImage(seen, medium(20), kLights, front(), held).image;
  };
  const Image both = renderImage(volume, medium(20), kLights, front(), options).image,
              heldA = heldOutBy(volumeA, volumeB), heldB = heldOutBy(volumeB, volumeA);
  const std::vector<float>&whole = both.channel("A").values, &ofA = heldA.channel("A").values,
        &ofB = heldB.channel("A").values;
  int off = 0;
  for (std::size_t i = 0; i != whole.size(); ++i) off += std::fabs(ofA[i] + ofB[i] - whole[i]) > 0.05f;
  // At rims, where both are brought to the finer voxels; a picture has 576 pixels.
  EXPECT_LE(off, 14);
}

TEST(Holdout, IsRefusedForPicturesOfAnotherSize) {
  const TemporaryFolder folder;
  DeepImage image;
  image.width = image.height = 3;
  image.pixels.resize(9);
  writeDeepExr(folder.file("a.exr"), image, front(3));
  EXPECT_NO_THROW(readHoldout(folder.file("a.exr"), front(3)));
  try {
    readHoldout(folder.file("a.exr"), front(4));
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("3x3"), std::string::npos);
  }
}

TEST(DeepImage, IsRefusedWithoutAListForEveryPixel) {
  const TemporaryFolder folder;
  DeepImage image;
  image.width = image.height = 2;
  image.pixels.resize(3);
  EXPECT_THROW(writeDeepExr(folder.file("a.exr"), image, front(2)), Error);
  EXPECT_THROW(Holdout{image}, Error);
}

}  // namespace
}  // namespace nephele

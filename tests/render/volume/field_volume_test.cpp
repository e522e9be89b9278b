#include "nephele/render/volume/field_volume.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"
#include "nephele/modeling/shape/combinations.h"
#include "nephele/modeling/shape/shapes.h"
#include "nephele/render/march/raymarch.h"

namespace nephele {
namespace {

Camera looking(const Vec3f& from, int pixels, float fovDegrees) {
  return Camera::lookingAt(from, {0, 0, 0}, {0, 1, 0}, {pixels, pixels, fovDegrees});
}

// Density 1 in a ball of radius 1 with an edge 0.1 wide.
ScalarField cotton() {
  return mask(sphere({0, 0, 0}, 1), 0.1f);
}

FieldVolumeOptions around(float half) {
  FieldVolumeOptions options;
  options.box = {{-half, -half, -half}, {half, half, half}};
  return options;
}

TEST(FieldVolume, VoxelsAreAsWideAsThePixelsNearestToTheCamera) {
  // The ball, edge included, is nearest 9 - 1.05 from the camera, found within a 64th of the box.
  const Camera camera = looking({0, 0, 9}, 100, 20);
  const float voxelSize = fieldVoxelSize(cotton(), camera, around(2));
  EXPECT_LE(voxelSize, camera.pixelWidth(9 - 1.05));
  EXPECT_GE(voxelSize, camera.pixelWidth(9 - 1.05 - 2 * 4.0 / 64));
  FieldVolumeOptions fine = around(2);
  fine.voxelsPerPixel = 2;
  EXPECT_FLOAT_EQ(fieldVoxelSize(cotton(), camera, fine), voxelSize / 2);
}

TEST(FieldVolume, AnOrthographicCameraSeesPixelsOfOneWidth) {
  Camera::Frame frame{50, 50};
  frame.projection = Camera::Projection::orthographic;
  frame.orthographicWidth = 3.0f;
  const Camera camera = Camera::lookingAt({0, 0, 9}, {0, 0, 0}, {0, 1, 0}, frame);
  EXPECT_FLOAT_EQ(fieldVoxelSize(cotton(), camera, around(2)), 0.06f);
}

TEST(FieldVolume, SizesOfAnOctaveAreSharedByCamerasFromAboutAsFarAway) {
  FieldVolumeOptions options = around(2);
  options.sizesPerOctave = 8;
  FieldResolution resolution(cotton(), options);
  std::set<float> sizes;
  for (int i = 0; i != 50; ++i) {
    const Camera camera = looking({0, 0, 6 + 0.12f * float(i)}, 100, 20);
    const float size = resolution.voxelSize(camera), exact = fieldVoxelSize(cotton(), camera, around(2));
    EXPECT_LE(size, exact * 1.0001f);
    EXPECT_GT(size, exact / 1.0906f);
    // As if it had been asked for alone.
    EXPECT_EQ(size, fieldVoxelSize(cotton(), camera, options));
    sizes.insert(size);
  }
  // From 5 to 11 away: 9 eighths of an octave.
  EXPECT_GE(sizes.size(), 9u);
  EXPECT_LE(sizes.size(), 11u);
  for (const float size : sizes)
    EXPECT_NEAR(8 * std::log2(4 / size), std::round(8 * std::log2(4 / size)), 1e-4);
}

TEST(FieldVolume, SizesOfAnOctaveGrowUntilTheyFit) {
  FieldVolumeOptions options = around(2);
  options.sizesPerOctave = 8;
  options.mostBytes = 4e6;
  const Camera camera = looking({0, 0, 9}, 400, 20);
  const float size = fieldVoxelSize(cotton(), camera, options);
  EXPECT_GT(size, 1.5f * fieldVoxelSize(cotton(), camera, around(2)));
}

TEST(FieldVolume, OnlyWhatThePictureShowsCounts) {
  // A second ball just behind the camera does not matter, nor one far to the side.
  const ScalarField near = mask(sphere({0, 0, 9.5f}, 0.3f), 0.1f),
                    aside = mask(sphere({6, 0, 8}, 0.3f), 0.1f);
  const Camera camera = looking({0, 0, 9}, 100, 20);
  const float alone = fieldVoxelSize(cotton(), camera, around(10));
  EXPECT_FLOAT_EQ(fieldVoxelSize(max(cotton(), max(near, aside)), camera, around(10)), alone);
  // If it does not show anything, voxels have the size that suits the box.
  const Camera away = Camera::lookingAt({0, 0, 9}, {0, 0, 20}, {0, 1, 0}, {100, 100, 20});
  EXPECT_FLOAT_EQ(fieldVoxelSize(cotton(), away, around(2)), 4.0f / 64);
  // Parts of a picture, one of them beside the volume, are of the same voxels.
  for (const PixelBox& crop : {PixelBox{40, 40, 60, 60}, PixelBox{0, 0, 5, 5}}) {
    Camera::Frame frame{100, 100, 20};
    frame.crop = crop;
    const Camera part = Camera::lookingAt({0, 0, 9}, {0, 0, 0}, {0, 1, 0}, frame);
    EXPECT_FLOAT_EQ(fieldVoxelSize(cotton(), part, around(10)), alone);
  }
}

TEST(FieldVolume, GivesThePictureOfTheField) {
  // Chords of a ball whose edge is two voxels wide, half of it on either side: 1 - exp(-2 sigma sqrt(1 -
  // r^2)), a pixel at a time.
  const Camera camera = looking({0, 0, 40}, 64, 3.5f);
  const RenderVolume volume = fieldVolume(mask(sphere({0, 0, 0}, 1), 0.08f), camera, around(1.5f));
  Medium medium;
  medium.extinction = 0.7f;
  const Image image = renderImage(volume, medium, {}, camera).image;
  for (int x = 32; x != 56; ++x) {
    const double r = camera.pixelWidth(40) * (x + 0.5 - 32), s = camera.pixelWidth(40) * 0.5;
    const double chord = 2 * std::sqrt(std::max(0.0, 1 - r * r - s * s));
    // Half a pixel where the ball's rim is steep.
    EXPECT_NEAR(image.at("A", x, 32), 1 - std::exp(-0.7 * chord), r < 0.8 ? 5e-3 : 0.03) << x;
  }
}

TEST(FieldVolume, ComeNearerAndThereIsMoreToSee) {
  // Fine stripes, 0.02 wide: a camera that sees the whole ball averages them, one that is near tells them
  // apart. Contrast of a stripe of density 1 + cos through a slab of thickness t = 0.02, optical depths 0 to
  // 2 sigma t.
  const ScalarField x = dot(position(), VectorField(Vec3f{1, 0, 0}));
  const ScalarField stripes = mask(sphere({0, 0, 0}, 1), 0.05f) * (cos(x * (2 * kPi / 0.02f)) + 1) *
                              mask(box({{-2, -2, -0.01f}, {2, 2, 0.01f}}));
  const Camera near = Camera::lookingAt({0, 0, 1}, {0, 0, 0}, {0, 1, 0}, {40, 4, 4.0f});
  FieldVolumeOptions options = around(0.04f);
  const RenderVolume volume = fieldVolume(stripes, near, options);
  Medium medium;
  medium.extinction = 20;
  const Image image = renderImage(volume, medium, {}, near).image;
  float low = 1, high = 0;
  for (int i = 4; i != 36; ++i) {
    low = std::min(low, image.at("A", i, 2));
    high = std::max(high, image.at("A", i, 2));
  }
  EXPECT_LT(low, 0.06f);
  EXPECT_NEAR(high, 1 - std::exp(-2 * 20 * 0.02f), 0.08f);
}

TEST(FieldVolume, VoxelsGrowUntilTheyFitTheMemory) {
  const Camera camera = looking({0, 0, 3}, 2000, 50);
  FieldVolumeOptions options = around(1.2f);
  options.mostBytes = 4e6;
  const RenderVolume volume = fieldVolume(cotton(), camera, options);
  EXPECT_LE(double(volume.density().values().size()) * 4, 4e6 * 1.3);
  EXPECT_GE(double(volume.density().values().size()) * 4, 4e6 * 0.3);
  // A camera inside of the density asks for infinitely small voxels.
  EXPECT_GT(fieldVoxelSize(cotton(), looking({0, 0, 0.5f}, 100, 50), options), 0.01f);
}

TEST(FieldVolume, OfNothingIsEmpty) {
  const Camera camera = looking({0, 0, 9}, 100, 20);
  EXPECT_TRUE(fieldVolume(ScalarField(-1.0f), camera, around(1)).isEmpty());
}

TEST(FieldVolume, RefusesWhatHasNoMeaning) {
  const Camera camera = looking({0, 0, 9}, 100, 20);
  EXPECT_THROW(fieldVolume(cotton(), camera, {}), Error);
  FieldVolumeOptions options = around(1);
  options.voxelsPerPixel = 0;
  EXPECT_THROW(fieldVolume(cotton(), camera, options), Error);
  options = around(1);
  options.mostBytes = 0;
  EXPECT_THROW(fieldVolume(cotton(), camera, options), Error);
}

}  // namespace
}  // namespace nephele

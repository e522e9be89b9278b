// A volume that is lit once and looked at many times.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/render/march/raymarch.h"
#include "tests/support/density.h"

namespace nephele {
namespace {

const Lights kLights{{{"sun", directionTowards(60, 30), {3, 3, 3}}}, {0.1f, 0.2f, 0.3f}};

Camera cameraAt(const RenderVolume& volume, float azimuth) {
  return Camera::framing(volume.outline(), azimuth, 10, {24, 18});
}

void expectSame(const Image& a, const Image& b) {
  ASSERT_EQ(a.channels.size(), b.channels.size());
  for (std::size_t c = 0; c != a.channels.size(); ++c) {
    EXPECT_EQ(a.channels[c].name, b.channels[c].name);
    EXPECT_EQ(a.channels[c].values, b.channels[c].values) << a.channels[c].name;
  }
}

TEST(LitVolume, MakesThePicturesOfRenderImage) {
  const RenderVolume volume(test::ball(1.0f, 0.2f));
  const Medium medium{30.0f};
  RenderOptions options;
  options.aovs = {"Z", "light"};
  const LitVolume lit(volume, medium, kLights, options.octaves);
  for (const float azimuth : {0.0f, 100.0f, 0.0f}) {
    const Camera camera = cameraAt(volume, azimuth);
    expectSame(lit.render(camera, options).image,
               renderImage(volume, medium, kLights, camera, options).image);
  }
}

TEST(LitVolume, MayBeLitAgain) {
  const RenderVolume volume(test::ball(1.0f, 0.2f));
  const Medium medium{30.0f};
  const RenderOptions options;
  const Camera camera = cameraAt(volume, 20);
  Lights moved = kLights;
  moved.suns[0].direction = directionTowards(180, 20);
  Lights other = moved;
  other.sky = {0.5f, 0, 0};
  // One light after another, as frames follow each other.
  LitVolume lit(volume, medium, kLights, options.octaves);
  for (const Lights& lights : {moved, other, Lights{kLights.suns, {}}, moved}) {
    lit.relight(lights);
    expectSame(lit.render(camera, options).image, renderImage(volume, medium, lights, camera, options).image);
  }
}

TEST(LitVolume, IsLitAgainInPlaceAlsoAfterThatWasCancelled) {
  class Never : public Progress {
   public:
    bool cancelled() const override { return true; }
  };
  const RenderVolume volume(test::ball(1.0f, 0.2f));
  const Medium medium{30.0f};
  const RenderOptions options;
  const Camera camera = cameraAt(volume, 20);
  Lights moved = kLights;
  moved.suns[0].direction = directionTowards(180, 20);
  LitVolume lit(volume, medium, kLights, options.octaves);
  const LitVolume copy = lit;
  EXPECT_THROW(lit.relight(moved, Never()), Cancelled);
  EXPECT_THROW(lit.render(camera, options), Error);
  lit.relight(moved);
  expectSame(lit.render(camera, options).image, renderImage(volume, medium, moved, camera, options).image);
  // Of others it takes nothing away.
  expectSame(copy.render(camera, options).image, renderImage(volume, medium, kLights, camera, options).image);
}

TEST(LitVolume, AnEmptyVolumeMakesPicturesOfZeros) {
  const RenderVolume volume(test::ball(1.0f, 0.25f, 0.0f));
  const RenderOptions options;
  const Image image =
      LitVolume(volume, {}, kLights, options.octaves).render(cameraAt(volume, 0), options).image;
  for (const char* name : {"R", "G", "B", "A"})
    for (const float value : image.channel(name).values) EXPECT_EQ(value, 0.0f);
}

TEST(LitVolume, LooksTheSameWhoseSamplesAreGivenBack) {
  // So long that cells are wide; and so short that samples lie between bricks. Codes are half of 1 / 57343 of
  // a brick's largest value off, in every sum of many the less.
  for (const int longest : {160, 40}) {
    const auto grid = test::densityGrid(
        test::voxels(0.1f), {-longest, -10, -10}, {longest, 10, 10},
        [](const Vec3f& p) { return std::fmax(0.0f, 1 + std::sin(3 * p.x) - p.y * p.y - p.z * p.z); });
    const RenderVolume kept(grid);
    RenderVolume given(std::make_shared<BrickGrid>(*grid));
    given.giveUpSamples();
    const Medium medium{6.0f};
    for (const Vec3f& towards :
         {Vec3f{0.2f, 0.9f, 0.4f}, Vec3f{0.9f, 0.2f, -0.3f}, Vec3f{0.1f, -0.4f, 0.8f}}) {
      const Lights lights{{{"sun", towards, {3, 3, 3}}}, {0.1f, 0.2f, 0.3f}};
      const Image all = renderImage(kept, medium, lights, cameraAt(kept, 20), {}).image,
                  same = renderImage(given, medium, lights, cameraAt(given, 20), {}).image;
      EXPECT_FALSE(given.hasSamples());
      for (const char* name : {"R", "G", "B", "A"}) {
        const std::vector<float>&a = all.channel(name).values, &b = same.channel(name).values;
        for (std::size_t i = 0; i != a.size(); ++i)
          ASSERT_NEAR(a[i], b[i], 1e-4f * (a[i] + 0.01f)) << name << " " << i;
      }
      given = RenderVolume(std::make_shared<BrickGrid>(*grid));
      given.giveUpSamples();
    }
  }
}

TEST(LitVolume, RefusesLightThatNeedsSamplesWhichWereGivenBack) {
  RenderVolume volume(test::ball(1.0f, 0.25f));
  volume.giveUpSamples();
  volume.coded();
  LocalLight point;
  point.position = {0, 3, 0};
  const Lights near{{}, {}, {point}};
  EXPECT_THROW(LitVolume(volume, {}, near, {}), Error);
  EXPECT_NO_THROW(LitVolume(volume, {}, kLights, {}));
}

TEST(LitVolume, RefusesOctavesOtherThanItsOwn) {
  const RenderVolume volume(test::ball(1.0f, 0.25f));
  RenderOptions options;
  const LitVolume lit(volume, {}, kLights, options.octaves);
  ++options.octaves.count;
  EXPECT_THROW(lit.render(cameraAt(volume, 0), options), Error);
}

TEST(LitVolume, HoldsTheShadowsOfObjectsFromPictureToPicture) {
  const RenderVolume volume(test::ball(1.0f, 0.2f));
  const Medium medium{10.0f};
  Mesh wall;
  wall.positions = {{2, -3, -3}, {2, 3, -3}, {2, 0, 3}};
  wall.addFace(std::array<std::uint32_t, 3>{0, 1, 2});
  RenderOptions options;
  options.surfaces = std::make_shared<const Surfaces>(std::vector<SurfaceObject>{{wall}});
  LitVolume lit(volume, medium, kLights, options.octaves, silent(), options.surfaces);
  Lights moved = kLights;
  moved.suns[0].direction = directionTowards(100, 0);
  for (const Lights& lights : {kLights, moved}) {
    lit.relight(lights);
    for (const float azimuth : {0.0f, 100.0f})
      expectSame(lit.render(cameraAt(volume, azimuth), options).image,
                 renderImage(volume, medium, lights, cameraAt(volume, azimuth), options).image);
  }
  options.surfaces.reset();
  EXPECT_THROW(lit.render(cameraAt(volume, 0), options), Error);
}

TEST(LitVolume, TakesACoarserLatticeForScatteredLightWhereThatIsAskedFor) {
  const RenderVolume volume(test::ball(1.0f, 0.05f));
  const Medium medium{30.0f};
  const Camera camera = cameraAt(volume, 20);
  RenderOptions fine, coarse;
  fine.octaves.order = coarse.octaves.order = 4;
  coarse.octaves.cells = 48;
  const Image a = renderImage(volume, medium, kLights, camera, fine).image;
  const Image b = renderImage(volume, medium, kLights, camera, coarse).image;
  double sumA = 0, sumB = 0;
  for (const float value : a.channel("G").values) sumA += double(value);
  for (const float value : b.channel("G").values) sumB += double(value);
  EXPECT_NE(a.channel("G").values, b.channel("G").values);
  // 3 % of the mean do not show in a picture for a drag, which such lattices are for.
  EXPECT_NEAR(sumB / sumA, 1, 0.03);
  coarse.octaves.cells = 7;
  EXPECT_THROW(renderImage(volume, medium, kLights, camera, coarse), Error);
}

}  // namespace
}  // namespace nephele

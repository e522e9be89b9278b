// Steps from a shape to a picture: what has not changed is not made again, and pictures are those of one
// call.
#include "nephele/render/session/picture_stages.h"

#include <gtest/gtest.h>

#include <atomic>

#include "nephele/levelset/grid/voxel_grid.h"
#include "nephele/modeling/base/error.h"
#include "tests/support/density.h"

namespace nephele {
namespace {

const Lights kLights{{{"sun", directionTowards(60, 30), {3, 3, 3}}}, {0.1f, 0.2f, 0.3f}};

CloudOptions cloudOptions(float amplitude) {
  CloudOptions options;
  CumuloFractal form;
  form.layers = 2;
  form.amplitude = ScalarField(amplitude);
  form.frequency = ScalarField(4.0f);
  options.layers = cumuloLayers(form);
  options.voxelSize = 1.0f / 24;
  options.edgeThickness = ScalarField(0.05f);
  return options;
}

/// All steps of a small cloud, each with its key.
struct Steps {
  PictureStages stages;
  int shapes = 0, volumes = 0;
  float amplitude = 0.03f;
  std::string edge = "0.05";
  Lights lights = kLights;
  std::string lightsKey = "sun";
  float azimuth = 20;

  std::shared_ptr<const RenderResult> picture(const Progress& progress = silent()) {
    stages.shape("humilis", [&] {
      ++shapes;
      return cloudShapeMesh({});
    });
    CloudOptions options = cloudOptions(amplitude);
    options.edgeThickness = ScalarField(std::stof(edge));
    const auto levels = stages.levels(std::to_string(amplitude), options, progress);
    const auto volume = stages.volume(edge, [&] {
      ++volumes;
      return RenderVolume(toBricks(makeCloud(*levels, options, progress).density));
    });
    stages.light("medium", lightsKey, {Medium{60.0f}, lights}, progress);
    return stages.picture(std::to_string(azimuth), camera(*volume), {}, progress);
  }
  Camera camera(const RenderVolume& volume) const {
    return Camera::framing(volume.outline(), azimuth, 10, {24, 18});
  }
};

void expectSame(const Image& a, const Image& b) {
  ASSERT_EQ(a.channels.size(), b.channels.size());
  for (std::size_t c = 0; c != a.channels.size(); ++c) EXPECT_EQ(a.channels[c].values, b.channels[c].values);
}

TEST(PictureStages, MakeThePictureOfOneCallAfterAnother) {
  Steps steps;
  const auto picture = steps.picture();
  const auto options = cloudOptions(steps.amplitude);
  const RenderVolume volume(toBricks(makeCloud(cloudShapeMesh({}), options).density));
  expectSame(picture->image, renderImage(volume, Medium{60.0f}, kLights, steps.camera(volume)).image);
}

TEST(PictureStages, KeepWhatACameraDoesNotChange) {
  Steps steps;
  const auto first = steps.picture();
  const auto lit = steps.stages.lit();
  EXPECT_EQ(steps.picture(), first);
  steps.azimuth = 50;
  EXPECT_NE(steps.picture(), first);
  EXPECT_EQ(steps.stages.lit(), lit);
  EXPECT_EQ(steps.shapes, 1);
  EXPECT_EQ(steps.volumes, 1);
}

TEST(PictureStages, MakeLightAgainForAnotherSunAndKeepTheVolume) {
  Steps steps;
  steps.picture();
  const auto lit = steps.stages.lit();
  steps.lights.suns[0].direction = directionTowards(200, 20);
  steps.lightsKey = "moved";
  const auto moved = steps.picture();
  EXPECT_NE(steps.stages.lit(), lit);
  EXPECT_EQ(steps.stages.lit()->volume, lit->volume);
  Steps fresh;
  fresh.lights = steps.lights;
  expectSame(moved->image, fresh.picture()->image);
}

TEST(PictureStages, RedoOnlyWhatFollows) {
  Steps steps;
  steps.picture();
  steps.edge = "0.03";
  const auto thinner = steps.picture();
  EXPECT_EQ(steps.shapes, 1);
  EXPECT_EQ(steps.volumes, 2);
  steps.amplitude = 0.05f;
  const auto rougher = steps.picture();
  EXPECT_EQ(steps.shapes, 1);
  EXPECT_EQ(steps.volumes, 3);
  Steps fresh;
  fresh.edge = "0.03";
  expectSame(thinner->image, fresh.picture()->image);
  fresh.amplitude = 0.05f;
  expectSame(rougher->image, fresh.picture()->image);
}

TEST(PictureStages, KnowWhetherThereIsLight) {
  Steps steps;
  const PictureStages::Keys keys{"humilis", std::to_string(steps.amplitude), steps.edge, "medium", "sun"};
  EXPECT_FALSE(steps.stages.isLit(keys));
  steps.picture();
  EXPECT_TRUE(steps.stages.isLit(keys));
  EXPECT_FALSE(steps.stages.isLit({"humilis", keys.levels, keys.volume, "medium", "moved"}));
  EXPECT_FALSE(steps.stages.isLit({"congestus", keys.levels, keys.volume, "medium", "sun"}));
  steps.stages.forget();
  EXPECT_FALSE(steps.stages.isLit(keys));
}

TEST(PictureStages, GoOnAfterTheyWereCancelled) {
  class AfterSome : public Progress {
   public:
    explicit AfterSome(int checks) : left_(checks) {}
    bool cancelled() const override { return left_-- <= 0; }

   private:
    mutable std::atomic<int> left_;
  };
  Steps fresh;
  const auto whole = fresh.picture();
  Steps steps;
  int cancels = 0;
  for (const int checks : {0, 3, 20, 60, 200, 1000}) try {
      steps.picture(AfterSome(checks));
    } catch (const Cancelled&) {
      ++cancels;
    }
  EXPECT_GT(cancels, 1);
  expectSame(steps.picture()->image, whole->image);
  EXPECT_EQ(steps.shapes, 1);
}

TEST(PictureStages, RefuseStepsWithoutTheOnesBefore) {
  PictureStages stages;
  EXPECT_THROW(stages.levels("", cloudOptions(0.1f)), Error);
  EXPECT_THROW(stages.light("", "", {}), Error);
}

}  // namespace
}  // namespace nephele

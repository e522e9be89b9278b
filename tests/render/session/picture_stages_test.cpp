// Steps from a shape to a picture: what has not changed is not made again, and pictures are those of one
// call.
#include "nephele/render/session/picture_stages.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <time.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>

#include "nephele/levelset/grid/voxel_grid.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/field/function_field.h"
#include "nephele/modeling/field/operations.h"
#include "tests/support/density.h"

namespace nephele {
namespace {

const Lights kLights{{{"sun", directionTowards(60, 30), {3, 3, 3}}}, {0.1f, 0.2f, 0.3f}};

CloudOptions cloudOptions(float amplitude, int layers = 2, float roughness = 0.55f) {
  CloudOptions options;
  CumuloFractal form;
  form.layers = layers;
  form.roughness = ScalarField(roughness);
  form.amplitude = ScalarField(amplitude);
  form.frequency = ScalarField(8.0f / float(layers));
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
  float azimuth = 20, voxelSize = 1.0f / 24;

  std::shared_ptr<const RenderResult> picture(const Progress& progress = silent()) {
    stages.shape("humilis", [&] {
      ++shapes;
      return cloudShapeMesh({});
    });
    CloudOptions options = cloudOptions(amplitude);
    options.voxelSize = voxelSize;
    options.edgeThickness = ScalarField(std::stof(edge));
    const auto levels = stages.levels(std::to_string(amplitude), options, {}, progress);
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

std::vector<float> samplesOf(const VoxelGrid<float>& grid) {
  std::vector<float> samples;
  grid.forEachBrick([&](const Vec3i& brick, std::int32_t entry) {
    for (const int i : {brick.x, brick.y, brick.z}) samples.push_back(float(i));
    if (entry < 0) return samples.push_back(grid.constants()[std::size_t(-1 - entry)]);
    samples.insert(samples.end(), grid.samples(entry), grid.samples(entry) + kBrickSamples);
  });
  return samples;
}

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
  EXPECT_EQ(steps.stages.volumeAt(keys), steps.stages.lit()->volume);
  EXPECT_EQ(steps.stages.volumeAt({"humilis", keys.levels, "0.2", "medium", "sun"}), nullptr);
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

/// The longest time of a processor that a thread has worked without a look whether it should stop.
class Looks : public Progress {
 public:
  bool cancelled() const override {
    thread_local const Looks* of = nullptr;
    thread_local double last = 0;
    const double now = processorSeconds(CLOCK_THREAD_CPUTIME_ID);
    const std::lock_guard lock(mutex_);
    if (of == this && now - last > longest_) longest_ = now - last;
    of = this;
    last = now;
    return false;
  }
  static double processorSeconds(clockid_t clock) {
    timespec time;
    clock_gettime(clock, &time);
    return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
  }
  double longest() const { return longest_; }

 private:
  mutable std::mutex mutex_;
  mutable double longest_ = 0;
};

// As a share of the whole, so that it does not depend on the machine.
TEST(PictureStages, LookOftenWhetherTheyShouldStop) {
  Steps steps;
  steps.voxelSize = 1.0f / 128;
  const Looks looks;
  const CancelScope scope(&looks);
  const double start = Looks::processorSeconds(CLOCK_PROCESS_CPUTIME_ID);
  steps.picture(looks);
  const double whole = Looks::processorSeconds(CLOCK_PROCESS_CPUTIME_ID) - start;
  RecordProperty("longest_share", std::to_string(looks.longest() / whole));
  EXPECT_LT(looks.longest(), 0.1 * whole) << whole << " s in all";
}

// What the stages come to does not depend on what they have kept, and of layers they keep the first ones.
TEST(PictureStages, KeepLayersBeforeThatWhichChanges) {
  PictureStages stages;
  const auto levels = [](PictureStages& of, float amplitude, float last, float roughness = 0.55f) {
    of.shape("humilis", [] { return cloudShapeMesh({}); });
    CloudOptions options = cloudOptions(amplitude, 3, roughness);
    options.layers[2].amplitude = ScalarField(last);
    const std::string own = fmt::format("{} {}", amplitude, roughness);
    const std::vector<std::string> layers{fmt::format("{}", amplitude), own, own + fmt::format(" {}", last)};
    return of.levels(layers.back(), options, layers);
  };
  const auto expectAsFresh = [&](const CloudLevels& found, float amplitude, float last, float roughness) {
    PictureStages fresh;
    const auto wanted = levels(fresh, amplitude, last, roughness);
    EXPECT_EQ(fresh.layersTaken(), 0u);
    EXPECT_EQ(samplesOf(found.levels.voxels()), samplesOf(wanted->levels.voxels()));
    EXPECT_EQ(found.layers.size(), 3u);
  };
  levels(stages, 0.03f, 0.0085f);
  EXPECT_EQ(stages.layersTaken(), 0u);
  const auto higher = levels(stages, 0.03f, 0.009f);
  EXPECT_EQ(stages.layersTaken(), 2u);
  expectAsFresh(*higher, 0.03f, 0.009f, 0.55f);
  const auto second = levels(stages, 0.03f, 0.009f, 0.54f);
  EXPECT_EQ(stages.layersTaken(), 1u);
  expectAsFresh(*second, 0.03f, 0.009f, 0.54f);
  levels(stages, 0.031f, 0.009f, 0.54f);
  EXPECT_EQ(stages.layersTaken(), 0u);
  stages.forget();
  levels(stages, 0.031f, 0.009f, 0.54f);
  EXPECT_EQ(stages.layersTaken(), 0u);
}

// Amplitudes that vary keep them, too, as long as they vanish nowhere.
TEST(PictureStages, KeepLayersWhoseAmplitudesVary) {
  // From 0 to 1 along x, over the middle of the shape.
  const ScalarField rising = functionField(
      [](const Vec3f& p) { return std::clamp(2 * p.x + 0.5f, 0.0f, 1.0f); }, {.range = [](const Box& box) {
        return Interval{std::clamp(2 * box.min.x + 0.5f, 0.0f, 1.0f),
                        std::clamp(2 * box.max.x + 0.5f, 0.0f, 1.0f)};
      }});
  const auto taken = [&](float least) {
    PictureStages stages;
    const auto levels = [&](float last) {
      stages.shape("humilis", [] { return cloudShapeMesh({}); });
      CloudOptions options = cloudOptions(0.03f, 3, 0.55f);
      for (std::size_t i = 0; i < 3; ++i)
        options.layers[i].amplitude =
            max(rising, least) * (i == 2 ? last : 0.03f * std::pow(0.55f, float(i)));
      const std::string key = fmt::format("{}", last);
      const auto result = stages.levels(key, options, {"", "", key});
      PictureStages fresh;
      fresh.shape("humilis", [] { return cloudShapeMesh({}); });
      EXPECT_EQ(samplesOf(result->levels.voxels()),
                samplesOf(fresh.levels(key, options, {"", "", key})->levels.voxels()));
    };
    levels(0.0085f);
    levels(0.009f);
    return stages.layersTaken();
  };
  EXPECT_EQ(taken(0.3f), 2u);
  EXPECT_EQ(taken(0.0f), 0u);
}

TEST(PictureStages, RefuseStepsWithoutTheOnesBefore) {
  PictureStages stages;
  EXPECT_THROW(stages.levels("", cloudOptions(0.1f)), Error);
  EXPECT_THROW(stages.light("", "", {}), Error);
}

}  // namespace
}  // namespace nephele

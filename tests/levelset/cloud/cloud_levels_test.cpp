// Levels of clouds that are sampled once, and kept in files.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <thread>

#include "nephele/levelset/cloud/cloud.h"
#include "nephele/levelset/cloud/level_cache.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/cloud/density_profile.h"
#include "nephele/modeling/field/function_field.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/shape/shapes.h"
#include "tests/support/run_program.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

using Bricks = std::map<std::array<int, 3>, std::vector<float>>;

/// The values of all bricks that are not background.
Bricks bricksOf(const VoxelGrid<float>& grid) {
  Bricks result;
  grid.forEachBrick([&](const Vec3i& brick, std::int32_t entry) {
    std::vector<float> values(kBrickSamples, entry < 0 ? grid.constants()[std::size_t(-1 - entry)] : 0.0f);
    if (entry >= 0) values.assign(grid.samples(entry), grid.samples(entry) + kBrickSamples);
    if (std::ranges::any_of(values, [&](float value) { return value != grid.background(); }))
      result[{brick.z, brick.y, brick.x}] = std::move(values);
  });
  return result;
}

constexpr float kVoxel = 0.03f;

CloudOptions optionsOf(float edge) {
  CloudOptions options;
  options.layers = cumuloLayers({.layers = 2, .amplitude = 0.04f, .frequency = 2, .seed = 5});
  options.voxelSize = kVoxel;
  options.edgeThickness = edge;
  return options;
}

TEST(CloudLevels, GiveTheSameDensitiesBitForBit) {
  const Mesh mesh = icosphere(0.5, 2);
  const CloudLevels levels = makeCloudLevels(mesh, optionsOf(0.04f));
  EXPECT_FLOAT_EQ(levels.halfWidth, 3 * kVoxel);
  for (const float edge : {0.01f, 0.04f, 0.13f})
    for (const std::optional<float> exponent : {std::optional<float>(), std::optional(0.5f)}) {
      CloudOptions options = optionsOf(edge);
      options.edgeExponent = exponent;
      options.withSurface = true;
      // Constant in some bricks, not in others, and nowhere below.
      options.densityFactor =
          densityFactor({.low = -0.5f,
                         .high = 0.5f,
                         .interiorNoise = exponent ? 0.5f : 0.0f,
                         .flatBase = DensityProfile::FlatBase{.height = -0.2f, .softness = 0.05f}});
      const Cloud direct = makeCloud(mesh, options), again = makeCloud(levels, options);
      EXPECT_TRUE(bricksOf(direct.density) == bricksOf(again.density)) << edge;
      EXPECT_TRUE(bricksOf(*direct.surface) == bricksOf(*again.surface)) << edge;
      EXPECT_GT(bricksOf(again.density).size(), 50u);
      EXPECT_EQ(direct.layers.size(), again.layers.size());
    }
  CloudOptions varying = optionsOf(0.1f);
  varying.edgeThickness = clamp(plane({}, {0, 1, 0}) * 0.1f + 0.05f, 0.01f, 0.1f);
  EXPECT_TRUE(bricksOf(makeCloud(mesh, varying).density) == bricksOf(makeCloud(levels, varying).density));
}

// The estimate says that the ball is far larger in one place than it is; thin edges believe it.
TEST(CloudLevels, KeepWhereTheEstimateIsMisjudged) {
  GriddedCumulo cumulo;
  cumulo.surface = sphere({}, 0.5f);
  cumulo.estimate = max(sphere({}, 0.5f), sphere({0.5f, 0, 0}, 0.15f));
  cumulo.estimateVoxelSize = kVoxel;
  cumulo.estimateError = 0.01f;
  cumulo.box = {{-0.7f, -0.7f, -0.7f}, {0.7f, 0.7f, 0.7f}};
  const CloudLevels levels = cloudLevels(cumulo, kVoxel, 0.2f);
  EXPECT_GT(levels.estimates.sampledBricks(), 0u);
  for (const float edge : {0.02f, 0.1f, 0.3f}) {
    const CloudDensityOptions options{.voxelSize = kVoxel, .edgeThickness = edge};
    EXPECT_TRUE(bricksOf(cloudDensity(cumulo, options)) == bricksOf(cloudDensity(levels, options))) << edge;
  }
}

TEST(CloudLevels, ReachAsFarAsEdgesNeed) {
  EXPECT_FLOAT_EQ(cloudEdgeReach(0, 1), 2.25f);
  EXPECT_FLOAT_EQ(cloudEdgeReach(4.5f, 1), 2.25f);
  EXPECT_FLOAT_EQ(cloudEdgeReach(4.6f, 1), 4.5f);
  EXPECT_FLOAT_EQ(cloudEdgeReach(40, 1), 36);
  EXPECT_THROW(cloudEdgeReach(1, 0), Error);
  const CloudLevels levels = makeCloudLevels(icosphere(0.5, 1), optionsOf(0.04f));
  EXPECT_THROW(makeCloud(levels, optionsOf(0.5f)), Error);
  CloudOptions finer = optionsOf(0.04f);
  finer.voxelSize = kVoxel / 2;
  EXPECT_THROW(makeCloud(levels, finer), Error);
}

class Notes : public Progress {
 public:
  void note(std::string_view text) const override { all.emplace_back(text); }
  mutable std::vector<std::string> all;
};

class LevelCacheFiles : public testing::Test {
 protected:
  CloudLevels made() const { return makeCloudLevels(icosphere(0.5, 1), optionsOf(0.04f)); }
  LevelCache cache(double mostBytes = 1e9) const { return LevelCache({folder_.file("kept"), mostBytes}); }
  TemporaryFolder folder_;
  const std::string key_ = "0123456789abcdef";
};

TEST_F(LevelCacheFiles, HoldWhatWasKept) {
  const CloudLevels levels = made();
  EXPECT_FALSE(cache().read(key_));
  ASSERT_TRUE(cache().write(key_, levels));
  const auto read = cache().read(key_);
  ASSERT_TRUE(read);
  EXPECT_TRUE(bricksOf(read->levels.voxels()) == bricksOf(levels.levels.voxels()));
  EXPECT_TRUE(bricksOf(read->estimates) == bricksOf(levels.estimates));
  EXPECT_EQ(read->halfWidth, levels.halfWidth);
  EXPECT_EQ(read->estimateError, levels.estimateError);
  EXPECT_EQ(read->box, levels.box);
  ASSERT_EQ(read->layers.size(), 2u);
  EXPECT_EQ(read->layers[1].activeVoxels, levels.layers[1].activeVoxels);
  EXPECT_EQ(read->layers[1].meanDisplacement, levels.layers[1].meanDisplacement);
  EXPECT_FALSE(cache().read("0123456789abcdee"));
}

TEST_F(LevelCacheFiles, ThatAreForeignOrBrokenAreNotTaken) {
  ASSERT_TRUE(cache().write(key_, made()));
  const std::string path = cache().pathOf(key_), whole = textOf(path);
  const auto refused = [&](const std::string& content, const std::string& key) {
    std::ofstream(cache().pathOf(key), std::ios::binary) << content;
    Notes notes;
    EXPECT_FALSE(cache().read(key, notes));
    ASSERT_EQ(notes.all.size(), 1u);
    EXPECT_NE(notes.all[0].find(cache().pathOf(key)), std::string::npos) << notes.all[0];
  };
  refused("", key_);
  refused("no volume at all", key_);
  refused(whole.substr(0, whole.size() / 2), key_);
  refused(whole, "fedcba9876543210");
  // A value here and there, which a file of this kind does not notice by itself.
  for (const double at : {0.5, 0.7, 0.9}) {
    std::string damaged = whole;
    damaged[std::size_t(at * double(whole.size()))] ^= 0x10;
    refused(damaged, key_);
  }
  ASSERT_TRUE(cache().write(key_, made()));
  EXPECT_TRUE(cache().read(key_));
}

TEST_F(LevelCacheFiles, AreNoMoreThanMayBe) {
  namespace fs = std::filesystem;
  const CloudLevels levels = made();
  const std::string keys[] = {"000000000000000a", "000000000000000b", "000000000000000c"};
  ASSERT_TRUE(cache().write(keys[0], levels));
  const double size = double(fs::file_size(cache().pathOf(keys[0])));
  std::ofstream(folder_.file("kept/cloud_layers_mine.vdb")) << "not ours";
  ASSERT_TRUE(cache().write(keys[1], levels));
  const auto now = fs::file_time_type::clock::now();
  fs::last_write_time(cache().pathOf(keys[0]), now - std::chrono::hours(2));
  fs::last_write_time(cache().pathOf(keys[1]), now - std::chrono::hours(1));
  // The first one is of use again.
  EXPECT_TRUE(cache().read(keys[0]));
  ASSERT_TRUE(cache(2.5 * size).write(keys[2], levels));
  EXPECT_TRUE(fs::exists(cache().pathOf(keys[0])));
  EXPECT_FALSE(fs::exists(cache().pathOf(keys[1])));
  EXPECT_TRUE(fs::exists(cache().pathOf(keys[2])));
  EXPECT_TRUE(fs::exists(folder_.file("kept/cloud_layers_mine.vdb")));
  Notes notes;
  EXPECT_FALSE(cache(0.5 * size).write(keys[1], levels, notes));
  EXPECT_EQ(notes.all.size(), 1u);
}

TEST_F(LevelCacheFiles, ThatCannotBeWrittenStopNothing) {
  std::ofstream(folder_.file("kept")) << "a file";
  Notes notes;
  EXPECT_FALSE(cache().write(key_, made(), notes));
  EXPECT_EQ(notes.all.size(), 1u);
  EXPECT_FALSE(cache().read(key_));
}

TEST_F(LevelCacheFiles, MayBeWrittenAndReadAtOnce) {
  const CloudLevels levels = made();
  const Bricks expected = bricksOf(levels.levels.voxels());
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i)
    threads.emplace_back([&] {
      for (int k = 0; k < 4; ++k) {
        Notes notes;
        EXPECT_TRUE(cache().write(key_, levels, notes));
        const auto read = cache().read(key_, notes);
        ASSERT_TRUE(read);
        EXPECT_TRUE(bricksOf(read->levels.voxels()) == expected);
        EXPECT_TRUE(notes.all.empty());
      }
    });
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace nephele::test

// The verb render, through the program.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "levelset/vdb_io.h"
#include "render/exr_io.h"
#include "tests/support/density.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace nephele::test {
namespace {

class RenderVerb : public testing::Test {
 protected:
  // A ball of radius 1 and density 1, as the grid `density` of a file.
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    writeVdbFile(fog(), {toVdb(*ball(1.0f, 0.1f), {"density", VdbGridInfo::Class::fogVolume})}, {});
  }
  static void TearDownTestSuite() { delete folder_; }

  static std::string fog() { return folder_->file("fog.vdb"); }
  static inline TemporaryFolder* folder_ = nullptr;
};

TEST_F(RenderVerb, WritesAPictureAPreviewAndStatistics) {
  const TemporaryFolder folder;
  const ProgramResult result =
      runProgram("render " + fog() + " -o " + folder.file("a.exr") + " --preview " + folder.file("a.png") +
                 " --size 64x48 --view 30,10 --aov Z,light --seed 5 --stats " + folder.file("s.json"));
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  const Image image = readImage(folder.file("a.exr"));
  EXPECT_EQ(image.width, 64);
  EXPECT_EQ(image.height, 48);
  for (const char* name : {"R", "G", "B", "A", "Z", "light_sun.R", "light_sky.B"})
    EXPECT_TRUE(image.find(name)) << name;
  // Framed: opaque in the middle, empty in the corners; premultiplied: no light without opacity.
  EXPECT_GT(image.at("A", 32, 24), 0.999f);
  EXPECT_EQ(image.at("A", 0, 0), 0.0f);
  EXPECT_EQ(image.at("R", 0, 0), 0.0f);
  EXPECT_EQ(readImage(folder.file("a.png")).width, 64);

  const auto stats = nlohmann::json::parse(textOf(folder.file("s.json")));
  EXPECT_EQ(stats["rays"], 64 * 48 * 4);
  EXPECT_GT(stats["samples"], 1000);
  EXPECT_GE(stats["light_seconds"], 0.0);
  EXPECT_GE(stats["march_seconds"], 0.0);
  // 150 / longest side, whose box is the ball's and a voxel around it.
  EXPECT_NEAR(stats["extinction"].get<double>(), 150 / 2.2, 2.5);
  bool seed = false;
  for (const std::string& line : describeImage(folder.file("a.exr"))) seed = seed || line == "seed: 5";
  EXPECT_TRUE(seed);
}

TEST_F(RenderVerb, TakesACameraAndAnExtinction) {
  const TemporaryFolder folder;
  const ProgramResult result = runProgram(
      "render " + fog() + " -o " + folder.file("a.exr") +
      " --size 3x3 --camera-position 0,0,9 --look-at 0,0,0 --fov 0.3 --extinction 0.4 --samples 1");
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  // Beer's law through the middle of the ball.
  EXPECT_NEAR(readImage(folder.file("a.exr")).at("A", 1, 1), 1 - std::exp(-0.8f), 0.006f);
}

TEST_F(RenderVerb, MakesTheSamePictureAtAnyNumberOfThreads) {
  const TemporaryFolder folder;
  const std::string options = "render " + fog() + " --size 40x30 --quiet -o ";
  ASSERT_EQ(runProgram(options + folder.file("one.exr") + " --threads 1").exitCode, 0);
  ASSERT_EQ(runProgram(options + folder.file("all.exr")).exitCode, 0);
  const Image one = readImage(folder.file("one.exr")), all = readImage(folder.file("all.exr"));
  for (std::size_t c = 0; c != one.channels.size(); ++c)
    EXPECT_EQ(one.channels[c].values, all.channels[c].values);
}

TEST_F(RenderVerb, RefusesWrongUseWithTheOptionAndWhatIsAllowed) {
  const TemporaryFolder folder;
  const std::string start = "render " + fog() + " -o " + folder.file("a.exr") + " ";
  const struct {
    const char *arguments, *option;
  } cases[] = {{"--size 64", "--size"},          {"--size 0x10", "--size"},
               {"--size 10x10x10", "--size"},    {"--view 30", "--view"},
               {"--view a,b", "--view"},         {"--sun 10", "--sun"},
               {"--sun 1,2,-3", "--sun"},        {"--sky 1,2", "--sky"},
               {"--sky -1,0,0", "--sky"},        {"--albedo 1,1,2", "--albedo"},
               {"--phase mie:5", "--phase"},     {"--phase hg:2", "--phase"},
               {"--octaves 0", "--octaves"},     {"--samples 0", "--samples"},
               {"--step 0", "--step"},           {"--step -1", "--step"},
               {"--fov 200", "--fov"},           {"--extinction -1", "--extinction"},
               {"--aov depth", "--aov"},         {"--integrator path", "--integrator"},
               {"--point 1,2,3,4", "--point"},   {"--look-at 0,0,0", "--look-at"},
               {"--preview a.jpg", "--preview"}, {"--exposure x", "--exposure"}};
  for (const auto& c : cases) {
    const ProgramResult result = runProgram(start + c.arguments);
    EXPECT_EQ(result.exitCode, 2) << c.arguments << ": " << result.errors;
    EXPECT_NE(result.errors.find(c.option), std::string::npos) << result.errors;
  }
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST_F(RenderVerb, RefusesFilesThatHoldNoDensity) {
  const TemporaryFolder folder;
  const std::string out = " -o " + folder.file("a.exr");
  EXPECT_EQ(runProgram("render " + folder.file("missing.vdb") + out).exitCode, 1);
  EXPECT_EQ(runProgram("render " + fog() + " --grid other" + out).exitCode, 1);
  EXPECT_EQ(runProgram("render " + fog() + " -o " + folder.file("missing/a.exr")).exitCode, 1);
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST(RenderData, RefusesALevelSetAndSaysWhatMakesADensityOfIt) {
  const std::string path = sharedData("volumes/cube_levelset.vdb");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const TemporaryFolder folder;
  const ProgramResult result = runProgram("render " + path + " -o " + folder.file("a.exr"));
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find("level set"), std::string::npos) << result.errors;
  EXPECT_NE(result.errors.find("nephele cloud"), std::string::npos) << result.errors;
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST_F(RenderVerb, RefusesMoreMemoryThanItMayUse) {
  const TemporaryFolder folder;
  const ProgramResult result =
      runProgram("render " + fog() + " -o " + folder.file("a.exr") + " --size 60000x60000");
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find("--size"), std::string::npos) << result.errors;
}

TEST(RenderData, MakesPicturesOfRealVolumes) {
  const TemporaryFolder folder;
  for (const char* name : {"dragon_small_fog.vdb", "bifrost_torus_fog.vdb", "smoke_double_fog.vdb",
                           "blender_fluid_5_grids.vdb"}) {
    const std::string path = sharedData("volumes/" + std::string(name));
    NEPHELE_REQUIRE_SHARED_DATA(path);
    const ProgramResult result =
        runProgram("render " + path + " -o " + folder.file("a.exr") + " --size 48x36 --samples 1");
    ASSERT_EQ(result.exitCode, 0) << name << result.errors;
    const Image image = readImage(folder.file("a.exr"));
    double covered = 0;
    for (std::size_t i = 0; i != image.channel("A").values.size(); ++i) {
      covered += image.channel("A").values[i];
      for (const char* channel : {"R", "G", "B", "A"})
        ASSERT_TRUE(std::isfinite(image.channel(channel).values[i]));
    }
    // The automatic framing fills a fair part of the picture.
    EXPECT_GT(covered, 0.05 * 48 * 36) << name;
  }
}

TEST(RenderData, SaysThatAnEmptyVolumeMakesAnEmptyPicture) {
  const std::string path = sharedData("volumes/empty_grid.vdb");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const TemporaryFolder folder;
  const ProgramResult result = runProgram("render " + path + " -o " + folder.file("a.exr") + " --size 8x6");
  EXPECT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_NE(result.errors.find("empty"), std::string::npos);
  const Image image = readImage(folder.file("a.exr"));
  for (const float alpha : image.channel("A").values) EXPECT_EQ(alpha, 0.0f);
}

}  // namespace
}  // namespace nephele::test

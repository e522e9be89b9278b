// The verb cloud, through the program.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "levelset/grid_field.h"
#include "levelset/vdb_io.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace nephele::test {
namespace {

const std::string kSphere = ownData("data/sphere_uv.obj");

TEST(CloudVerb, WritesFogAndSurfaceWithStatistics) {
  const TemporaryFolder folder;
  const ProgramResult result = runProgram(
      "cloud " + kSphere + " -o " + folder.file("cloud.vdb") + " --surface " + folder.file("surface.vdb") +
      " --resolution 48 --layers 2 --seed 5 --stats " + folder.file("stats.json"));
  ASSERT_EQ(result.exitCode, 0) << result.errors;

  const VdbGridInfo density = describe(readScalarGrid(folder.file("cloud.vdb"), "density"));
  EXPECT_EQ(density.gridClass, VdbGridInfo::Class::fogVolume);
  EXPECT_EQ(density.background, 0);
  EXPECT_GE(density.valueMin, 0);
  EXPECT_EQ(density.valueMax, 1);
  EXPECT_FALSE(density.halfFloat);
  EXPECT_EQ(density.metadata.at("seed"), "5");
  const VdbGridInfo surface = describe(readScalarGrid(folder.file("surface.vdb"), "surface"));
  EXPECT_EQ(surface.gridClass, VdbGridInfo::Class::levelSet);
  EXPECT_LT(surface.valueMin, 0);

  const auto stats = nlohmann::json::parse(textOf(folder.file("stats.json")));
  ASSERT_EQ(stats["layers"].size(), 2u);
  for (const char* key : {"amplitude", "frequency", "voxel_size", "active_voxels", "unconverged_fraction",
                          "mean_displacement", "seconds"})
    EXPECT_TRUE(stats["layers"][1].contains(key)) << key;
  // Fractal form: amplitude falls by --roughness 0.55, frequency rises by --lacunarity 2.1.
  EXPECT_NEAR(double(stats["layers"][1]["amplitude"]) / double(stats["layers"][0]["amplitude"]), 0.55, 1e-4);
  EXPECT_NEAR(double(stats["layers"][1]["frequency"]) / double(stats["layers"][0]["frequency"]), 2.1, 1e-4);
  EXPECT_LE(double(stats["layers"][1]["unconverged_fraction"]), 0.01);
}

TEST(CloudVerb, IsTheSameAtAnyThreadCount) {
  const TemporaryFolder folder;
  const auto grown = [&](const std::string& options) {
    const std::string path = folder.file("cloud.vdb");
    const ProgramResult result =
        runProgram("cloud " + kSphere + " -o " + path + " --resolution 40 --layers 2 " + options);
    EXPECT_EQ(result.exitCode, 0) << result.errors;
    return toBricks(readScalarGrid(path));
  };
  const auto one = grown("--threads 1"), two = grown("--threads 2"), four = grown("--threads 4");
  EXPECT_EQ(one->values, two->values);
  EXPECT_EQ(one->values, four->values);
  EXPECT_EQ(one->table, four->table);
  EXPECT_NE(one->values, grown("--threads 1 --seed 9")->values);
}

TEST(CloudVerb, GrowsOnALevelSetAsOnItsMesh) {
  const TemporaryFolder folder;
  ASSERT_EQ(runProgram("levelset " + kSphere + " -o " + folder.file("in.vdb") + " --resolution 64").exitCode,
            0);
  const auto volumeOf = [&](const std::string& input) {
    // World units, since the box of the level set's surface need not equal that of the mesh.
    const ProgramResult result = runProgram("cloud " + input + " -o " + folder.file("out.vdb") +
                                            " --voxel-size 0.04 --amplitude 0.04 --frequency 3 --layers 2"
                                            " --edge-thickness 0.04");
    EXPECT_EQ(result.exitCode, 0) << result.errors;
    double sum = 0;
    const auto bricks = toBricks(readScalarGrid(folder.file("out.vdb")));
    for (int k = -40; k <= 40; ++k)
      for (int j = -40; j <= 40; ++j)
        for (int i = -40; i <= 40; ++i) sum += bricks->at({i, j, k});
    return sum;
  };
  const double mesh = volumeOf(kSphere), levelSet = volumeOf(folder.file("in.vdb"));
  EXPECT_GT(mesh, 0);
  EXPECT_NEAR(levelSet / mesh, 1.0, 0.01);
}

TEST(CloudVerb, WithoutAmplitudeIsTheMesh) {
  const TemporaryFolder folder;
  const ProgramResult result =
      runProgram("cloud " + kSphere + " -o " + folder.file("out.vdb") +
                 " --resolution 64 --layers 1 --amplitude 0 --stats " + folder.file("stats.json"));
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  const auto stats = nlohmann::json::parse(textOf(folder.file("stats.json")));
  EXPECT_EQ(double(stats["layers"][0]["mean_displacement"]), 0);
}

TEST(CloudVerb, SavesHalfFloatsOnRequest) {
  const TemporaryFolder folder;
  const ProgramResult result =
      runProgram("cloud " + kSphere + " -o " + folder.file("out.vdb") + " --resolution 32 --layers 1 --half");
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_TRUE(describe(readScalarGrid(folder.file("out.vdb"))).halfFloat);
}

TEST(CloudVerb, RefusesFogAsInput) {
  const TemporaryFolder folder;
  ASSERT_EQ(runProgram("cloud " + kSphere + " -o " + folder.file("fog.vdb") + " --resolution 24 --layers 1")
                .exitCode,
            0);
  const ProgramResult result =
      runProgram("cloud " + folder.file("fog.vdb") + " -o " + folder.file("out.vdb"));
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find("not a level set"), std::string::npos) << result.errors;
  EXPECT_NE(result.errors.find("fog.vdb"), std::string::npos) << result.errors;
}

TEST(CloudVerb, RefusesWorkThatDoesNotFitAndNamesTheOption) {
  const TemporaryFolder folder;
  const ProgramResult result =
      runProgram("cloud " + kSphere + " -o " + folder.file("out.vdb") + " --resolution 100000");
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find("--resolution"), std::string::npos) << result.errors;
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST(CloudVerb, WorksAtResolutionOne) {
  const TemporaryFolder folder;
  const ProgramResult result =
      runProgram("cloud " + kSphere + " -o " + folder.file("out.vdb") + " --resolution 1 --layers 1");
  EXPECT_EQ(result.exitCode, 0) << result.errors;
}

TEST(CloudVerb, BadOptionsAreUsageErrorsThatNameThem) {
  for (const std::string bad :
       {"--layers 0", "--layers 99", "--amplitude -1%", "--frequency 0x", "--billow -0.5", "--billow nan",
        "--noise simplex", "--renormalise maybe", "--medial-smoothing 17", "--edge-thickness 0",
        "--voxel-size 0", "--resolution 0", "--advect 1"}) {
    const ProgramResult result = runProgram("cloud " + kSphere + " -o unused.vdb " + bad);
    EXPECT_EQ(result.exitCode, 2) << bad;
    EXPECT_NE(result.errors.find(bad.substr(0, bad.find(' '))), std::string::npos)
        << bad << ": " << result.errors;
  }
}

TEST(CloudVerb, TakesEitherVoxelSizeOrResolution) {
  EXPECT_EQ(runProgram("cloud " + kSphere + " -o unused.vdb --voxel-size 0.1 --resolution 20").exitCode, 2);
}

}  // namespace
}  // namespace nephele::test

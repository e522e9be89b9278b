// Several inputs of levelset and cloud as one, through the program.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "tests/support/mesh_topology.h"
#include "tests/support/run_program.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

class Combine : public testing::Test {
 protected:
  /// A cube of volume 8 and a box of 11.52 that holds half of it.
  void SetUp() override {
    writeMesh(file("a.obj"), boxMesh({-1, -1, -1}, {1, 1, 1}));
    writeMesh(file("b.obj"), boxMesh({0, -1.2, -1.2}, {2, 1.2, 1.2}));
    writeMesh(file("far.obj"), boxMesh({8, -1, -1}, {10, 1, 1}));
  }
  std::string file(const std::string& name) const { return folder_.file(name); }
  ProgramResult run(const std::string& verb, const std::string& names, const std::string& options) const {
    std::string inputs;
    for (std::size_t begin = 0; begin < names.size();) {
      const std::size_t end = std::min(names.find(' ', begin), names.size());
      inputs += file(names.substr(begin, end - begin)) + " ";
      begin = end + 1;
    }
    return runProgram(verb + " " + inputs + "-o " + file("out.vdb") + " --stats " + file("s.json") + " " +
                      options);
  }
  nlohmann::json stats() const { return nlohmann::json::parse(textOf(file("s.json"))); }
  double volume(const std::string& names, const std::string& options) const {
    const ProgramResult result = run("levelset", names, options);
    EXPECT_EQ(result.exitCode, 0) << names << options << result.errors;
    return stats()["grid"]["volume"];
  }
  TemporaryFolder folder_;
};

TEST_F(Combine, OfLevelSetsIsUnionIntersectionOrCutout) {
  // Faces lie between voxels.
  const std::string voxels = "--voxel-size 0.047 ";
  EXPECT_NEAR(volume("a.obj b.obj", voxels), 15.52, 0.02);
  EXPECT_EQ(stats()["inputs"].size(), 2u);
  EXPECT_NEAR(stats()["inputs"][1]["volume"], 11.52, 1e-9);
  EXPECT_NEAR(volume("a.obj b.obj", voxels + "--combine union"), 15.52, 0.02);
  EXPECT_NEAR(volume("a.obj b.obj", voxels + "--combine intersection"), 4, 0.02);
  EXPECT_NEAR(volume("a.obj b.obj", voxels + "--combine cutout"), 4, 0.02);
  EXPECT_NEAR(volume("a.obj b.obj far.obj", voxels), 23.52, 0.03);
  // The longest side is that of all: 3.
  volume("a.obj b.obj", "--resolution 60");
  EXPECT_NEAR(stats()["grid"]["voxel_size"], 0.05, 1e-9);
}

TEST_F(Combine, TakesLevelSetsByTheirValuesWhereTheirVoxelsFit) {
  for (const char* name : {"a", "b"})
    ASSERT_EQ(runProgram("levelset " + file(std::string(name) + ".obj") + " -o " +
                         file(std::string(name) + ".vdb") + " --voxel-size 0.05")
                  .exitCode,
              0);
  const auto valuesOf = [&] { return toBricks(readScalarGrid(file("out.vdb"))); };
  volume("a.obj b.obj", "--voxel-size 0.05 --combine cutout");
  const auto meshes = valuesOf();
  // Without an option the voxels are those of the first.
  EXPECT_NEAR(volume("a.vdb b.vdb", "--combine cutout"), 4, 0.02);
  const auto levels = valuesOf();
  EXPECT_EQ(meshes->brickCount(), levels->brickCount());
  EXPECT_TRUE(std::equal(meshes->values().begin(), meshes->values().end(), levels->values().begin(),
                         levels->values().end()));
  EXPECT_NEAR(volume("a.vdb b.obj", "--combine intersection"), 4, 0.02);
  EXPECT_NEAR(volume("a.vdb b.vdb", "--voxel-size 0.043"), 15.52, 0.05);
  EXPECT_NEAR(volume("a.vdb", "--voxel-size 0.043"), 8, 0.03);
}

TEST_F(Combine, BlendsWhereSurfacesMeet) {
  writeMesh(file("across.obj"), boxMesh({-0.5, -2, -0.5}, {0.5, 2, 0.5}));
  const double sharp = volume("a.obj across.obj", "--voxel-size 0.047");
  EXPECT_NEAR(sharp, 10, 0.02);
  // Where faces meet at a right angle, at the depths x and y outside of them, the surface moves to where
  // (w - |x - y|)^2 / 4 w = min(x, y): an area of w^2 / 6 along eight edges of length 1, whose moment, w^3 /
  // 30, turns by a quarter around each of eight corners.
  const double w = 0.4, pi = 3.14159265358979, filled = 8 * (w * w / 6 + pi / 2 * w * w * w / 30);
  const double blended = volume("a.obj across.obj", "--voxel-size 0.047 --blend 0.4");
  EXPECT_NEAR(blended - sharp, filled, 0.02 * filled);
  EXPECT_NEAR(volume("a.obj across.obj", "--voxel-size 0.047 --blend 10%"), blended, 1e-6);
}

TEST_F(Combine, CloudsGrowOnTheUnion) {
  const std::string options = "--resolution 40 --layers 1 --amplitude 1% --shape-mesh " + file("shape.obj");
  const ProgramResult result = run("cloud", "a.obj b.obj", options);
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  const Mesh shape = readMesh(file("shape.obj"));
  EXPECT_TRUE(topologyOf(shape).isClosedManifold());
  EXPECT_NEAR(signedVolume(shape), 15.52, 0.15);
  EXPECT_NEAR(boundingBox(shape).max.x, 2, 0.01);
  const auto grid = toBricks(readScalarGrid(file("out.vdb")));
  const float voxel = grid->voxelSize();
  EXPECT_EQ(grid->at({int(1.5f / voxel), 0, 0}), 1.0f);
  EXPECT_EQ(grid->at({int(-0.5f / voxel), 0, 0}), 1.0f);
  ASSERT_EQ(run("cloud", "a.obj b.obj", options + " --combine cutout").exitCode, 0);
  EXPECT_NEAR(signedVolume(readMesh(file("shape.obj"))), 4, 0.1);
  ASSERT_EQ(run("cloud", "a.obj b.obj", options + " --blend 5%").exitCode, 0);
  // Voxels follow from what is left, not from what was taken off it far away.
  ASSERT_EQ(run("cloud", "a.obj far.obj",
                "--resolution 30 --layers 1 --amplitude 0 --combine cutout --shape-mesh " + file("shape.obj"))
                .exitCode,
            0);
  EXPECT_NEAR(signedVolume(readMesh(file("shape.obj"))), 8, 0.1);
  // Kept layers know what they grew on.
  const std::string cache = options + " --cache " + file("cache");
  ASSERT_EQ(run("cloud", "a.obj b.obj", cache).exitCode, 0);
  ASSERT_EQ(run("cloud", "b.obj a.obj", cache).exitCode, 0);
  EXPECT_EQ(stats()["cache"]["reused"], true);
  ASSERT_EQ(run("cloud", "a.obj b.obj", cache + " --combine intersection").exitCode, 0);
  EXPECT_EQ(stats()["cache"]["reused"], false);
}

TEST_F(Combine, SaysWhereNothingIsLeftOrTheInputIsAlone) {
  const ProgramResult apart = run("levelset", "a.obj far.obj", "--resolution 60 --combine intersection");
  EXPECT_EQ(apart.exitCode, 1);
  EXPECT_NE(apart.errors.find("have nothing in common"), std::string::npos) << apart.errors;
  const ProgramResult inside = run("cloud", "a.obj a.obj", "--resolution 30 --combine cutout");
  EXPECT_EQ(inside.exitCode, 1);
  EXPECT_NE(inside.errors.find("nothing is left"), std::string::npos) << inside.errors;
  for (const char* option : {"--combine cutout", "--blend 1%"})
    for (const char* verb : {"levelset", "cloud"}) {
      const ProgramResult alone = run(verb, "a.obj", option);
      EXPECT_EQ(alone.exitCode, 2) << verb << option;
      EXPECT_NE(alone.errors.find("several inputs"), std::string::npos) << alone.errors;
    }
  const ProgramResult missing = run("cloud", "a.obj none.obj", "");
  EXPECT_EQ(missing.exitCode, 1);
  EXPECT_NE(missing.errors.find("none.obj"), std::string::npos) << missing.errors;
  EXPECT_EQ(run("levelset", "a.obj b.obj", "--combine sum").exitCode, 2);
  EXPECT_EQ(run("levelset", "a.obj b.obj", "--blend -1").exitCode, 2);
}

}  // namespace
}  // namespace nephele::test

// The verb mesh, through the program.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "nephele/levelset/io/mesh_io.h"
#include "tests/support/mesh_topology.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace nephele::test {
namespace {

class MeshVerb : public testing::Test {
 protected:
  // Two linked tori, a cone grown into one of them: two closed components, each with one handle.
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    const ProgramResult made = runProgram("levelset " + ownData("data/linked_tori_and_cone.obj") +
                                          " --resolution 80 -o " + levelSet());
    ASSERT_EQ(made.exitCode, 0) << made.errors;
  }
  static void TearDownTestSuite() { delete folder_; }

  static std::string levelSet() { return folder_->file("surface.vdb"); }

  static nlohmann::json statsOf(const std::string& arguments) {
    const TemporaryFolder folder;
    const ProgramResult result = runProgram("mesh " + arguments + " --stats " + folder.file("stats.json"));
    EXPECT_EQ(result.exitCode, 0) << result.errors;
    return nlohmann::json::parse(textOf(folder.file("stats.json")))["mesh"];
  }

  static inline TemporaryFolder* folder_ = nullptr;
};

TEST_F(MeshVerb, WritesAClosedMeshInEveryFormat) {
  for (const std::string name : {"out.obj", "out.ply"}) {
    const TemporaryFolder folder;
    const ProgramResult result = runProgram("mesh " + levelSet() + " -o " + folder.file(name));
    ASSERT_EQ(result.exitCode, 0) << result.errors;
    const Topology topology = topologyOf(readMesh(folder.file(name)));
    EXPECT_TRUE(topology.isClosedManifold()) << name << ": " << topology;
    EXPECT_EQ(topology.components, 2u);
    EXPECT_EQ(topology.eulerCharacteristic, 0);
  }
  // STL repeats the vertices of every triangle.
  const TemporaryFolder folder;
  ASSERT_EQ(runProgram("mesh " + levelSet() + " -o " + folder.file("out.stl")).exitCode, 0);
  EXPECT_GT(readMesh(folder.file("out.stl")).faceCount(), 1000u);
}

TEST_F(MeshVerb, CountsTheMeshInItsStatistics) {
  const TemporaryFolder folder;
  const nlohmann::json mesh = statsOf(levelSet() + " -o " + folder.file("out.ply"));
  const Mesh written = readMesh(folder.file("out.ply"));
  EXPECT_EQ(mesh["vertices"], written.positions.size());
  EXPECT_EQ(mesh["triangles"], written.faceCount());
  EXPECT_EQ(mesh["closed"], true);
  EXPECT_EQ(mesh["components"], 2);
  EXPECT_EQ(mesh["euler"], 0);
  // PLY keeps single precision.
  EXPECT_NEAR(mesh["volume"].get<double>(), signedVolume(written), 1e-5);
  EXPECT_NEAR(mesh["area"].get<double>(), surfaceArea(written), 1e-4);
}

TEST_F(MeshVerb, MovesTheSurfaceOfALevelSetInwardsByTheIsovalue) {
  const TemporaryFolder folder;
  const std::string out = " -o " + folder.file("out.ply");
  const nlohmann::json at = statsOf(levelSet() + out);
  const nlohmann::json inside = statsOf(levelSet() + out + " --isovalue 0.02");
  const nlohmann::json dual = statsOf(levelSet() + out + " --isovalue 0.02 --adaptivity 0");
  // A thin layer has the volume area x thickness; the area shrinks with it, by less than a tenth here.
  const double layer = at["volume"].get<double>() - inside["volume"].get<double>();
  EXPECT_LT(layer, 0.02 * at["area"].get<double>());
  EXPECT_GT(layer, 0.02 * inside["area"].get<double>() * 0.95);
  EXPECT_NEAR(dual["volume"].get<double>() / inside["volume"].get<double>(), 1, 0.01);
}

TEST_F(MeshVerb, AdaptivityMakesFewerFaces) {
  const TemporaryFolder folder;
  const std::string out = " -o " + folder.file("out.obj");
  const nlohmann::json fine = statsOf(levelSet() + out + " --adaptivity 0");
  const nlohmann::json coarse = statsOf(levelSet() + out + " --adaptivity 0.05");
  EXPECT_LT(coarse["faces"].get<double>(), 0.5 * fine["faces"].get<double>());
  // Larger faces cut the corners of the tubes, which are 10 voxels wide.
  EXPECT_NEAR(coarse["volume"].get<double>() / fine["volume"].get<double>(), 1, 0.02);
}

TEST_F(MeshVerb, WritesTheSameBytesWithAnyNumberOfThreads) {
  const TemporaryFolder folder;
  ASSERT_EQ(runProgram("mesh " + levelSet() + " --threads 1 -o " + folder.file("one.ply")).exitCode, 0);
  ASSERT_EQ(runProgram("mesh " + levelSet() + " --threads 3 -o " + folder.file("three.ply")).exitCode, 0);
  EXPECT_EQ(textOf(folder.file("one.ply")), textOf(folder.file("three.ply")));
}

TEST_F(MeshVerb, MeshesADensityAtOneHalf) {
  const std::string fog = sharedData("volumes/dragon_small_fog.vdb");
  NEPHELE_REQUIRE_SHARED_DATA(fog);
  const TemporaryFolder folder;
  const nlohmann::json mesh = statsOf(fog + " -o " + folder.file("out.ply"));
  EXPECT_EQ(mesh["isovalue"], 0.5);
  EXPECT_EQ(mesh["closed"], true);
  EXPECT_GT(mesh["volume"].get<double>(), 0);
}

TEST_F(MeshVerb, NamesTheRangeWhereTheIsovalueMissesIt) {
  const TemporaryFolder folder;
  const ProgramResult result =
      runProgram("mesh " + levelSet() + " --isovalue 7 -o " + folder.file("out.obj"));
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find("--isovalue 7"), std::string::npos) << result.errors;
  EXPECT_NE(result.errors.find("surface.vdb"), std::string::npos) << result.errors;
  EXPECT_NE(result.errors.find("go from -"), std::string::npos) << result.errors;
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST_F(MeshVerb, RefusesWrongOptionsAsUsage) {
  const TemporaryFolder folder;
  const std::string to = " -o " + folder.file("out.obj");
  const std::vector<std::pair<std::string, std::string>> wrong = {
      {levelSet() + to + " --adaptivity 2", "--adaptivity"},
      {levelSet() + to + " --isovalue many", "--isovalue"},
      {levelSet() + " -o " + folder.file("out.jpg"), "--output"},
      {levelSet(), "--output"}};
  for (const auto& [arguments, named] : wrong) {
    const ProgramResult result = runProgram("mesh " + arguments);
    EXPECT_EQ(result.exitCode, 2) << arguments;
    EXPECT_NE(result.errors.find(named), std::string::npos) << result.errors;
  }
}

TEST_F(MeshVerb, NamesTheGridsThatAreThereWhereTheNameIsWrong) {
  const TemporaryFolder folder;
  const ProgramResult result = runProgram("mesh " + levelSet() + " --grid heat -o " + folder.file("out.obj"));
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find("heat"), std::string::npos) << result.errors;
  EXPECT_NE(result.errors.find("surface"), std::string::npos) << result.errors;
}

TEST_F(MeshVerb, RefusesAFileThatIsNotAVolume) {
  const TemporaryFolder folder;
  const ProgramResult result =
      runProgram("mesh " + ownData("data/sphere_uv.obj") + " -o " + folder.file("out.obj"));
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find("sphere_uv.obj"), std::string::npos) << result.errors;
  EXPECT_EQ(folder.entryCount(), 0u);
}

}  // namespace
}  // namespace nephele::test

// The verb mesh, through the program.
#include <gtest/gtest.h>

#include <fstream>
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

TEST_F(MeshVerb, RefusesAFileThatIsNoVolumeAndNoMesh) {
  const TemporaryFolder folder;
  std::ofstream(folder.file("shopping.txt")) << "milk\n";
  const ProgramResult result =
      runProgram("mesh " + folder.file("shopping.txt") + " -o " + folder.file("out.obj"));
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find("shopping.txt: unknown mesh format"), std::string::npos) << result.errors;
  EXPECT_EQ(folder.entryCount(), 1u);
}

TEST_F(MeshVerb, DecimatesToANumberOfFacesOrADistance) {
  const TemporaryFolder folder;
  const nlohmann::json few = statsOf(levelSet() + " --faces 1000 -o " + folder.file("few.obj"));
  const Mesh mesh = readMesh(folder.file("few.obj"));
  EXPECT_LE(mesh.faceCount(), 1000u);
  EXPECT_GE(mesh.faceCount(), 998u);
  const Topology topology = topologyOf(mesh);
  EXPECT_TRUE(topology.isClosedManifold()) << topology;
  EXPECT_EQ(topology.components, 2u);
  EXPECT_EQ(topology.eulerCharacteristic, 0);
  EXPECT_EQ(few["faces"], mesh.faceCount());

  // A percentage is of the longest side: the same as the length that it is.
  const double side = boundingBox(mesh).longestSide();
  const nlohmann::json share = statsOf(levelSet() + " --max-error 1% -o " + folder.file("a.ply"));
  const nlohmann::json world =
      statsOf(levelSet() + " --max-error " + std::to_string(0.01 * side) + " -o " + folder.file("b.ply"));
  EXPECT_NEAR(share["faces"].get<double>() / world["faces"].get<double>(), 1, 0.05);
  EXPECT_LT(share["faces"], statsOf(levelSet() + " -o " + folder.file("c.ply"))["faces"]);
}

TEST_F(MeshVerb, ProcessesMeshesToo) {
  const TemporaryFolder folder;
  const std::string ball = ownData("data/sphere_uv.obj");
  const Mesh before = readMesh(ball);
  ASSERT_EQ(runProgram("mesh " + ball + " --subdivide 1 --smooth 3 -o " + folder.file("out.obj")).exitCode,
            0);
  const Mesh after = readMesh(folder.file("out.obj"));
  EXPECT_EQ(after.faceCount(), 4 * triangulated(before).faceCount());
  ASSERT_EQ(after.attributes.size(), 1u);
  EXPECT_EQ(after.attributes[0].name, "uv");
  // With nothing to do it changes the format.
  ASSERT_EQ(runProgram("mesh " + ball + " -o " + folder.file("same.ply")).exitCode, 0);
  EXPECT_EQ(readMesh(folder.file("same.ply")).corners, before.corners);
}

TEST_F(MeshVerb, CagesOfCloudAndTransferAreSubdivided) {
  const TemporaryFolder folder;
  const std::string cage = ownData("data/sphere_uv.obj");
  const std::size_t triangles = triangulated(readMesh(cage)).faceCount();
  const ProgramResult cloud =
      runProgram("cloud " + cage + " --subdivide 1 --resolution 24 --layers 1 -o " +
                 folder.file("cloud.vdb") + " --shape-mesh " + folder.file("shape.ply"));
  ASSERT_EQ(cloud.exitCode, 0) << cloud.errors;
  EXPECT_EQ(readMesh(folder.file("shape.ply")).faceCount(), 4 * triangles);
  const ProgramResult carried =
      runProgram("transfer --from " + cage + " --to " + cage +
                 " --subdivide 1 --method closest --align none -o " + folder.file("carried.obj"));
  ASSERT_EQ(carried.exitCode, 0) << carried.errors;
  EXPECT_EQ(readMesh(folder.file("carried.obj")).faceCount(), 4 * triangles);
}

TEST_F(MeshVerb, SaysWhatCannotBeDecimated) {
  const TemporaryFolder folder;
  const std::string to = " -o " + folder.file("out.obj");
  // Three triangles on one edge.
  std::ofstream(folder.file("edge.obj"))
      << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 0 -1\nf 1 2 3\nf 1 2 4\nf 2 1 5\n";
  const ProgramResult complexEdge = runProgram("mesh " + folder.file("edge.obj") + " --faces 2" + to);
  EXPECT_EQ(complexEdge.exitCode, 1);
  EXPECT_NE(complexEdge.errors.find("1 edge with more than two faces"), std::string::npos)
      << complexEdge.errors;
  const ProgramResult none = runProgram("mesh " + levelSet() + " --faces 0" + to);
  EXPECT_EQ(none.exitCode, 2);
  EXPECT_NE(none.errors.find("--faces"), std::string::npos) << none.errors;
  // Two tori cannot be made of two triangles.
  const ProgramResult tooFew = runProgram("mesh " + levelSet() + " --faces 2" + to);
  EXPECT_EQ(tooFew.exitCode, 1);
  EXPECT_NE(tooFew.errors.find("cannot have 2 faces"), std::string::npos) << tooFew.errors;
  const ProgramResult forVolumes = runProgram("mesh " + folder.file("edge.obj") + " --isovalue 1" + to);
  EXPECT_EQ(forVolumes.exitCode, 2);
  EXPECT_NE(forVolumes.errors.find("--isovalue"), std::string::npos) << forVolumes.errors;
  EXPECT_EQ(folder.entryCount(), 1u);

  // More faces than there are: the mesh as it is, and a word about it.
  const ProgramResult more = runProgram("mesh " + folder.file("edge.obj") + " --faces 4" + to);
  EXPECT_EQ(more.exitCode, 0);
  EXPECT_NE(more.errors.find("has 3 triangles, no more than --faces 4"), std::string::npos) << more.errors;
  EXPECT_EQ(readMesh(folder.file("out.obj")).faceCount(), 3u);
}

}  // namespace
}  // namespace nephele::test

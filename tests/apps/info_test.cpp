#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace nephele::test {
namespace {

// A closed tetrahedron with texture coordinates, and one without its last face.
constexpr const char* kTetrahedron =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\ng all\nf 1/1 3/1 2/1\nf 1/1 2/1 4/1\nf 2/1 3/1 4/1\n";

class Info : public ::testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_.file(name)) << text;
    return folder_.file(name);
  }
  nlohmann::json stats() const { return nlohmann::json::parse(textOf(folder_.file("stats.json"))); }

  TemporaryFolder folder_;
};

TEST_F(Info, DescribesAMeshInWordsAndAsJson) {
  const std::string path = write("tetrahedron.obj", std::string(kTetrahedron) + "f 1/1 4/1 3/1\n");
  const ProgramResult result = runProgram("info " + path + " --stats " + folder_.file("stats.json"));
  EXPECT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_NE(result.output.find(path), std::string::npos);
  EXPECT_NE(result.output.find("closed: yes"), std::string::npos) << result.output;
  EXPECT_NE(result.output.find("problems: none"), std::string::npos) << result.output;

  const nlohmann::json info = stats()["files"][0];
  EXPECT_EQ(info["kind"], "mesh");
  EXPECT_EQ(info["path"], path);
  EXPECT_EQ(info["vertices"], 4);
  EXPECT_EQ(info["triangles"], 4);
  EXPECT_EQ(info["closed"], true);
  EXPECT_EQ(info["genus"], 0);
  EXPECT_EQ(info["euler_characteristic"], 2);
  EXPECT_EQ(info["self_intersections"], 0);
  EXPECT_DOUBLE_EQ(info["volume"].get<double>(), 1.0 / 6);
  EXPECT_DOUBLE_EQ(info["area"].get<double>(), 1.5 + std::sqrt(3.0) / 2);
  EXPECT_EQ(info["attributes"][0]["name"], "uv");
  EXPECT_EQ(info["attributes"][0]["width"], 2);
  EXPECT_EQ(info["attributes"][0]["least"].size(), 2u);
  EXPECT_EQ(info["groups"][0]["faces"], 4);
}

TEST_F(Info, ShowsTheRangesOfAttributes) {
  const std::string path =
      write("painted.ply",
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
            "property float z\nproperty float growth\nelement face 1\n"
            "property list uchar int vertex_indices\nend_header\n"
            "0 0 0 -0.5\n1 0 0 0.25\n0 1 0 2\n3 0 1 2\n");
  const ProgramResult result = runProgram("info " + path + " --stats " + folder_.file("stats.json"));
  EXPECT_EQ(result.exitCode, 0) << result.errors;
  const nlohmann::json growth = stats()["files"][0]["attributes"][0];
  EXPECT_EQ(growth["name"], "growth");
  EXPECT_EQ(growth["least"], nlohmann::json::array({-0.5}));
  EXPECT_EQ(growth["greatest"], nlohmann::json::array({2.0}));
}

TEST_F(Info, ShowsNamesThatAreNotUtf8) {
  const std::string path = write("latin1.obj", std::string("g caf\xe9\n") + kTetrahedron);
  const ProgramResult result = runProgram("info " + path + " --stats " + folder_.file("stats.json"));
  EXPECT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_TRUE(stats()["files"][0].contains("groups"));
}

TEST_F(Info, HasALineForEachFileThatCannotBeRead) {
  const std::string first = write("a\nb.obj", "v 0 0 0\n"), second = write("c.obj", "f 1 2 3\n");
  const ProgramResult result = runProgram("info '" + first + "' '" + second + "'");
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 2) << result.errors;
  EXPECT_NE(result.errors.find("a\\nb.obj: "), std::string::npos) << result.errors;
  EXPECT_NE(result.errors.find("nephele info: error: " + second), std::string::npos) << result.errors;
}

TEST_F(Info, NamesTheProblemsOfAMesh) {
  const std::string path = write("open.obj", kTetrahedron);
  const ProgramResult result = runProgram("info " + path);
  EXPECT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_NE(result.output.find("open: 3 boundary edges in 1 hole"), std::string::npos) << result.output;
}

TEST_F(Info, AFileThatCannotBeReadFailsButTheOthersAreShown) {
  const std::string good = write("good.obj", kTetrahedron), bad = write("bad.obj", "v 0 0 0\nf 1 2 3\n");
  const ProgramResult result = runProgram("info " + folder_.file("none.ply") + " " + good + " " + bad +
                                          " --stats " + folder_.file("stats.json"));
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.output.find("vertices: 4"), std::string::npos) << result.output;
  EXPECT_NE(result.errors.find("none.ply: cannot be read"), std::string::npos) << result.errors;
  EXPECT_NE(result.errors.find("bad.obj: line 2"), std::string::npos) << result.errors;
}

TEST_F(Info, DescribesEveryGridOfAVolume) {
  const std::string path = sharedData("volumes/blender_fluid_5_grids.vdb");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const ProgramResult result = runProgram("info " + path + " --stats " + folder_.file("stats.json"));
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  // From the data's README.
  const nlohmann::json grids = stats()["files"][0]["grids"];
  ASSERT_EQ(grids.size(), 5u);
  for (const nlohmann::json& grid : grids) {
    EXPECT_EQ(grid["active_voxels"], 26912);
    EXPECT_EQ(grid["size"], (nlohmann::json{29, 29, 32}));
    if (grid["name"] == "density") {
      EXPECT_EQ(grid["class"], "fog volume");
      EXPECT_EQ(grid["half"], true);
    }
  }
  EXPECT_NE(result.output.find("velocity"), std::string::npos) << result.output;
}

TEST_F(Info, DescribesAnImage) {
  const std::string path = sharedData("env/kloppenheim_05_1k.hdr");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const ProgramResult result = runProgram("info " + path);
  EXPECT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_NE(result.output.find("1024"), std::string::npos) << result.output;
}

TEST_F(Info, RefusesDamagedVolumesAndImages) {
  std::vector<std::string> paths;
  std::string all;
  for (const char* name : {"git_lfs_pointer.vdb", "truncated.vdb", "truncated_reads_silently.vdb",
                           "old_version_0_28.nvdb", "damaged_1.exr", "damaged_3.exr"}) {
    paths.push_back(sharedData(std::string("malformed/") + name));
    NEPHELE_REQUIRE_SHARED_DATA(paths.back());
    all += " " + paths.back();
  }
  const ProgramResult result = runProgram("info" + all);
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_EQ(result.output, "");
  for (const std::string& path : paths)
    EXPECT_NE(result.errors.find(path + ": "), std::string::npos) << result.errors;
}

TEST_F(Info, NeedsAFile) {
  EXPECT_EQ(runProgram("info").exitCode, 2);
}

}  // namespace
}  // namespace nephele::test

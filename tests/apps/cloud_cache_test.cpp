// cloud --cache, through the program.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "tests/support/run_program.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

namespace fs = std::filesystem;

class CloudCache : public testing::Test {
 protected:
  void SetUp() override { writeMesh(file("ball.obj"), icosphere(1, 2)); }
  std::string file(const std::string& name) const { return folder_.file(name); }
  ProgramResult cloud(const std::string& output, const std::string& options,
                      const std::string& before = {}) const {
    const ProgramResult result =
        runProgram("cloud " + file("ball.obj") + " -o " + file(output) +
                       " --resolution 32 --layers 2 --stats " + file("stats.json") + " " + options,
                   before);
    EXPECT_EQ(result.exitCode, 0) << options << "\n" << result.errors;
    return result;
  }
  bool isReused(const std::string& options) const {
    cloud("a.vdb", "--cache " + file("cache") + " " + options);
    return cacheStats()["reused"];
  }
  nlohmann::json cacheStats() const { return nlohmann::json::parse(textOf(file("stats.json")))["cache"]; }
  std::string cacheFile() const { return cacheStats()["file"]; }
  void expectSame(const std::string& a, const std::string& b) const {
    const auto one = toBricks(readScalarGrid(file(a))), other = toBricks(readScalarGrid(file(b)));
    ASSERT_EQ(one->brickCount(), other->brickCount());
    EXPECT_EQ(one->firstBrick(), other->firstBrick());
    EXPECT_EQ(one->table(), other->table());
    EXPECT_TRUE(std::equal(one->values().begin(), one->values().end(), other->values().begin(),
                           other->values().end()));
  }
  TemporaryFolder folder_;
};

TEST_F(CloudCache, GivesTheSameCloudsFromLayersThatWereMadeOnce) {
  EXPECT_FALSE(isReused(""));
  EXPECT_TRUE(fs::exists(cacheFile()));
  const std::vector<std::string> others{"",
                                        "--edge-thickness 2%",
                                        "--edge-falloff linear --density 3",
                                        "--half",
                                        "--interior-noise 0.5 --flat-base 10%",
                                        "--surface " + file("s.vdb")};
  for (const std::string& options : others) {
    EXPECT_TRUE(isReused(options)) << options;
    cloud("plain.vdb", options);
    EXPECT_TRUE(cacheStats().is_null());
    expectSame("a.vdb", "plain.vdb");
  }
  EXPECT_TRUE(isReused("--advect 1%"));
  // The statistics of the layers are kept, too, but for their time.
  const auto stats = nlohmann::json::parse(textOf(file("stats.json")));
  ASSERT_EQ(stats["layers"].size(), 2u);
  EXPECT_GT(stats["layers"][1]["active_voxels"], 1000);
  EXPECT_EQ(stats["layers"][1]["seconds"], 0);
}

TEST_F(CloudCache, MakesLayersAnewWhereTheyAreOthers) {
  EXPECT_FALSE(isReused(""));
  std::ofstream(file("layers.toml")) << "[[layer]]\namplitude = \"1%\"\n";
  const std::string recipe = "--recipe " + file("layers.toml");
  for (const std::string& options :
       {std::string("--seed 2"), std::string("--amplitude 3%"), std::string("--medial-smoothing 2"),
        std::string("--noise worley"), recipe})
    EXPECT_FALSE(isReused(options)) << options;
  EXPECT_TRUE(isReused(recipe));
  std::ofstream(file("layers.toml")) << "[[layer]]\namplitude = \"2%\"\n";
  EXPECT_FALSE(isReused(recipe));
  // The same name, another shape.
  writeMesh(file("ball.obj"), icosphere(1.01, 2));
  EXPECT_FALSE(isReused(""));
  // An edge that layers do not reach.
  EXPECT_FALSE(isReused("--edge-thickness 30%"));
}

TEST_F(CloudCache, MakesLayersAnewForAnotherTime) {
  const auto isReusedAt = [&](int frame, const std::string& options) {
    const ProgramResult result = runProgram(fmt::format(
        "cloud {} -o {} --resolution 32 --layers 1 --cache {} --stats {} --frames {} {}", file("ball.obj"),
        file("a.####.vdb"), file("cache"), file("s.####.json"), frame, options));
    EXPECT_EQ(result.exitCode, 0) << result.errors;
    const auto stats = nlohmann::json::parse(textOf(file(fmt::format("s.{:04}.json", frame))));
    return bool(stats["frames"][0]["cache"]["reused"]);
  };
  const std::string moving = "--amplitude '=1% * (1 + time)'";
  EXPECT_FALSE(isReusedAt(1, moving));
  EXPECT_FALSE(isReusedAt(2, moving));
  EXPECT_TRUE(isReusedAt(2, moving));
  EXPECT_FALSE(isReusedAt(1, ""));
  EXPECT_TRUE(isReusedAt(2, ""));
}

TEST_F(CloudCache, MakesLayersAnewWhereTheMaskIsAnother) {
  const auto mask = [&](const char* shift) {
    ASSERT_EQ(
        runProgram("cloud " + file("ball.obj") + " -o " + file("m.vdb") + " --resolution 16 --seed " + shift)
            .exitCode,
        0);
  };
  mask("1");
  const std::string options = "--amplitude mask:" + file("m.vdb") + ":1%,4%";
  EXPECT_FALSE(isReused(options));
  EXPECT_TRUE(isReused(options));
  mask("2");
  EXPECT_FALSE(isReused(options));
}

TEST_F(CloudCache, BrokenFilesAreMadeAgain) {
  EXPECT_FALSE(isReused(""));
  const std::string path = cacheFile();
  std::ofstream(path) << "broken";
  const ProgramResult result = cloud("b.vdb", "--cache " + file("cache"));
  EXPECT_NE(result.errors.find(path + ": cannot be used"), std::string::npos) << result.errors;
  expectSame("a.vdb", "b.vdb");
  EXPECT_TRUE(isReused(""));
}

TEST_F(CloudCache, GoesOnWithoutWhereNothingCanBeKept) {
  cloud("plain.vdb", "--half");
  std::ofstream(file("cache")) << "a file";
  const ProgramResult result = cloud("a.vdb", "--half --cache " + file("cache"));
  EXPECT_NE(result.errors.find("the layers are not kept"), std::string::npos) << result.errors;
  EXPECT_EQ(cacheStats()["file"], "");
  expectSame("a.vdb", "plain.vdb");
  fs::remove(file("cache"));
  // A full disk: files as large as the cloud, and no larger.
  cloud("a.vdb", "--half --cache " + file("cache"));
  const auto kept = fs::file_size(cacheFile()), own = fs::file_size(file("a.vdb"));
  ASSERT_GT(kept, own + 2048);
  fs::remove_all(file("cache"));
  const std::string limit = "ulimit -f " + std::to_string(own / 512 + 2) + ";";
  const ProgramResult full = cloud("a.vdb", "--half --cache " + file("cache"), limit);
  EXPECT_NE(full.errors.find("the layers are not kept"), std::string::npos) << full.errors;
  expectSame("a.vdb", "plain.vdb");
  EXPECT_TRUE(fs::is_empty(file("cache")));
  const ProgramResult small = cloud("a.vdb", "--cache-size 0.001M --cache " + file("cache"));
  EXPECT_NE(small.errors.find("more than the cache may hold"), std::string::npos) << small.errors;
  EXPECT_TRUE(fs::is_empty(file("cache")));
}

TEST_F(CloudCache, SizesThatAreNoneAreRefused) {
  for (const char* options : {"--cache-size 20G", "--cache c --cache-size 0G", "--cache c --cache-size 20",
                              "--cache c --cache-size big"}) {
    const ProgramResult result =
        runProgram("cloud " + file("ball.obj") + " -o " + file("a.vdb") + " " + options);
    EXPECT_EQ(result.exitCode, 2) << options;
    EXPECT_NE(result.errors.find("--cache-size"), std::string::npos) << result.errors;
  }
}

}  // namespace
}  // namespace nephele::test

// The verb advect, through the program.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "nephele/levelset/flow/advection_files.h"
#include "nephele/levelset/grid/grid_field.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace nephele::test {
namespace {

std::string volume(const std::string& name) {
  return sharedData("volumes/" + name);
}

/// A small cloud of the project's own mesh.
class AdvectVerb : public testing::Test {
 protected:
  void SetUp() override {
    const ProgramResult result = runProgram("cloud " + ownData("data/sphere_uv.obj") + " -o " + cloud() +
                                            " --resolution 32 --layers 1");
    ASSERT_EQ(result.exitCode, 0) << result.errors;
  }

  std::string cloud() const { return folder_.file("cloud.vdb"); }
  std::string file(const std::string& name) const { return folder_.file(name); }
  ProgramResult advect(const std::string& output, const std::string& options) const {
    return runProgram("advect " + cloud() + " -o " + file(output) + " " + options);
  }
  std::shared_ptr<BrickGrid> density(const std::string& name) const {
    return toBricks(readScalarGrid(file(name), "density"));
  }

  TemporaryFolder folder_;
};

double mass(const BrickGrid& grid) {
  double sum = 0;
  for (const std::int32_t pool : grid.table())
    for (int z = 0; z < 8; ++z)
      for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 8; ++x) sum += grid.brick(pool)[sampleOffset(x, y, z)];
  return sum;
}

TEST_F(AdvectVerb, CarriesACloudByEachMethod) {
  const double before = mass(*density("cloud.vdb"));
  for (const std::string method :
       {"selma", "gridless", "grid", "grid --scheme plain", "grid --scheme bfecc"}) {
    const ProgramResult result =
        advect("out.vdb", "--velocity curl:amplitude=1%,frequency=2x,seed=4 --steps 3 --method " + method +
                              " --stats " + file("stats.json"));
    ASSERT_EQ(result.exitCode, 0) << result.errors;
    EXPECT_NE(result.output.find("grid 'density'"), std::string::npos) << result.output;
    const VdbGrid out = readScalarGrid(file("out.vdb"), "density");
    EXPECT_EQ(describe(out).gridClass, VdbGridInfo::Class::fogVolume);
    EXPECT_GE(valueRange(out).min, 0);
    // Without divergence nothing is gained or lost, but for sampling.
    EXPECT_NEAR(mass(*density("out.vdb")) / before, 1, 0.02) << method;
    const auto stats = nlohmann::json::parse(textOf(file("stats.json")));
    EXPECT_EQ(stats["steps"].size(), method == "gridless" ? 0u : 3u);
    EXPECT_EQ(stats["grids"][0]["name"], "density");
  }
}

TEST_F(AdvectVerb, MovesByTheVelocityOfAFile) {
  NEPHELE_REQUIRE_SHARED_DATA(sharedData("volumes"));
  // The velocity is 0,-15,0 inside a box that the cloud of radius 1 lies in: a step of 0.01 moves it by 0.15.
  const ProgramResult result =
      advect("out.vdb", "--velocity " + volume("velocity_vec3_tiles.vdb") + " --dt 0.01");
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  const auto before = gridField(density("cloud.vdb")), after = gridField(density("out.vdb"));
  EXPECT_GT(before({0, 0.95f, 0}), 0.5f);
  EXPECT_LT(after({0, 0.95f, 0}), 0.5f);
  EXPECT_FLOAT_EQ(after({0, 0, 0}), 1.0f);
}

TEST_F(AdvectVerb, ContinuesFrameByFrameToTheSameResult) {
  const std::string velocity = "--velocity noise:amplitude=1%,frequency=3x,octaves=2,seed=2 --dt 0.5";
  ASSERT_EQ(advect("once.vdb", velocity + " --steps 4 --map " + file("map.vdb")).exitCode, 0);
  ASSERT_EQ(advect("f1.vdb", velocity + " --steps 2 --map " + file("m1.vdb")).exitCode, 0);
  const ProgramResult second = advect(
      "f2.vdb", velocity + " --steps 2 --continue-from " + file("m1.vdb") + " --map " + file("m2.vdb"));
  ASSERT_EQ(second.exitCode, 0) << second.errors;
  EXPECT_EQ(density("f2.vdb")->values(), density("once.vdb")->values());
  const FlowMap once = readFlowMap(file("map.vdb")), frames = readFlowMap(file("m2.vdb"));
  EXPECT_EQ(once.bricks, frames.bricks);
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_EQ(once.displacement[c]->values(), frames.displacement[c]->values());
}

TEST_F(AdvectVerb, IsTheSameAtAnyThreadCount) {
  const std::string options = "--velocity curl:amplitude=2%,frequency=2x --steps 2 --threads ";
  ASSERT_EQ(advect("one.vdb", options + "1").exitCode, 0);
  ASSERT_EQ(advect("four.vdb", options + "4").exitCode, 0);
  EXPECT_EQ(density("one.vdb")->values(), density("four.vdb")->values());
}

TEST_F(AdvectVerb, CarriesEveryGridOfASimulationByItsOwnVelocity) {
  NEPHELE_REQUIRE_SHARED_DATA(sharedData("volumes"));
  const std::string fluid = volume("blender_fluid_5_grids.vdb");
  const ProgramResult result = runProgram("advect " + fluid + " -o " + file("out.vdb") + " --velocity " +
                                          fluid + " --steps 2 --dt 0.2");
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  const auto before = readVdbFile(fluid), after = readVdbFile(file("out.vdb"));
  ASSERT_EQ(after.size(), 5u);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(describe(after[i]).name, describe(before[i]).name);
    EXPECT_EQ(describe(after[i]).type, describe(before[i]).type);
  }
}

TEST_F(AdvectVerb, SaysWhichGridsAreLeftOut) {
  NEPHELE_REQUIRE_SHARED_DATA(sharedData("volumes"));
  const ProgramResult result = runProgram("advect " + volume("half_spot_multi_grid.vdb") + " -o " +
                                          file("out.vdb") + " --velocity noise --steps 1");
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_NE(result.errors.find("indexGrid (int32)"), std::string::npos) << result.errors;
}

TEST_F(AdvectVerb, HasAOneLineFormInCloud) {
  const std::string grow = "cloud " + ownData("data/sphere_uv.obj") + " --resolution 32 --layers 1 -o ";
  ASSERT_EQ(runProgram(grow + file("none.vdb") + " --advect 0").exitCode, 0);
  EXPECT_EQ(density("none.vdb")->values(), density("cloud.vdb")->values());
  const ProgramResult result = runProgram(grow + file("ragged.vdb") + " --advect 5%");
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  const auto whole = density("cloud.vdb"), ragged = density("ragged.vdb");
  EXPECT_NE(ragged->values(), whole->values());
  EXPECT_NEAR(mass(*ragged) / mass(*whole), 1, 0.25);
  // Something lies where nothing was.
  const ScalarField before = gridField(whole);
  int arrived = 0;
  for (int z = -20; z <= 20; ++z)
    for (int y = -20; y <= 20; ++y)
      for (int x = -20; x <= 20; ++x)
        arrived += ragged->at({x, y, z}) > 0.5f && before(ragged->indexToWorld()(Vec3f(Vec3i{x, y, z}))) == 0;
  EXPECT_GT(arrived, 20);
}

TEST_F(AdvectVerb, RefusesFilesThatDoNotFit) {
  NEPHELE_REQUIRE_SHARED_DATA(sharedData("volumes"));
  const std::string out = " -o " + file("out.vdb") + " ", noise = "--velocity noise ";
  const std::vector<std::pair<std::string, std::string>> cases{
      {"advect " + cloud() + out + "--velocity /nowhere/wind.vdb", "/nowhere/wind.vdb: no such file"},
      {"advect " + cloud() + out + "--velocity " + volume("smoke_fog.vdb"), "'density' (float)"},
      {"advect " + cloud() + out + "--velocity " + volume("blender_fluid_5_grids.vdb") +
           " --velocity-grid density",
       "'density' holds float"},
      {"advect " + cloud() + out + noise + "--continue-from " + volume("velocity_vec3_tiles.vdb"),
       "no map of a flow"},
      {"advect " + cloud() + out + noise + "--continue-from /nowhere/map.vdb", "/nowhere/map.vdb"},
      {"advect " + volume("empty_grid.vdb") + out + noise, "holds anything"},
      {"advect " + volume("sphere_points.vdb") + out + noise, "holds anything"},
      {"advect /nowhere/cloud.vdb" + out + noise, "/nowhere/cloud.vdb: no such file"},
      {"advect " + cloud() + out + "--velocity noise:amplitude=1e20",
       cloud() + ": advection: the velocity carries matter"},
      {"advect " + cloud() + out + "--dt 1e6 --velocity " + volume("velocity_vec3_tiles.vdb"),
       volume("velocity_vec3_tiles.vdb") + ": advection: the velocity carries matter"}};
  for (const auto& [command, said] : cases) {
    const ProgramResult result = runProgram(command);
    EXPECT_EQ(result.exitCode, 1) << command;
    EXPECT_NE(result.errors.find(said), std::string::npos) << command << "\n" << result.errors;
  }
  EXPECT_EQ(folder_.entryCount(), 1u);  // the cloud itself
}

TEST_F(AdvectVerb, EndsWhereMatterSpreadsBeyondTheMemoryLimit) {
  const ProgramResult result =
      advect("out.vdb", "--velocity noise:amplitude=30%,frequency=1x --steps 6 --memory-limit 24M");
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(
      result.errors.find(cloud() + ": advection: matter spreads over more bricks than the memory limit"),
      std::string::npos)
      << result.errors;
  EXPECT_EQ(folder_.entryCount(), 1u);  // the cloud itself
}

TEST_F(AdvectVerb, StopsWithinTheStepsOfAWalk) {
  // What has not stopped ten seconds after the signal is killed, with code 137.
  const ProgramResult result = runProgram(
      "advect " + cloud() + " -o " + file("out.vdb") +
          " --velocity curl:amplitude=0.01%,frequency=4x --steps 1000000 --method gridless --memory-limit 8G",
      "timeout --signal=INT --kill-after=10 --preserve-status 2");
  EXPECT_EQ(result.exitCode, 130) << result.errors;
  EXPECT_EQ(folder_.entryCount(), 1u);  // the cloud itself
}

// Percent are of the longest side of what is carried, for each component by itself.
TEST_F(AdvectVerb, TakesVectorsInPercent) {
  const Box box = carriedGrids(readVdbFile(cloud())).box;
  const double side = double(box.longestSide());
  ASSERT_EQ(advect("percent.vdb", "--velocity 10%,0.25,-5% --dt 2").exitCode, 0);
  ASSERT_EQ(
      advect("units.vdb", fmt::format("--velocity {},0.25,{} --dt 2", 0.1 * side, -0.05 * side)).exitCode, 0);
  EXPECT_EQ(density("percent.vdb")->values(), density("units.vdb")->values());
  const Vec3f moved = density("percent.vdb")->worldBox().center() - density("cloud.vdb")->worldBox().center();
  // Boxes end at bricks of 8 voxels, and voxels are a 32nd of the shape.
  EXPECT_NEAR(moved.x, 0.2 * side, 8 * side / 32);
  for (const char* bad : {"--velocity 1%,2%", "--velocity 1%,2%,x", "--velocity 1%,2%,3%%",
                          "--velocity 1%,,3", "--velocity 1e39%,0,0", "--velocity 1%,2%,3%,4%"}) {
    const ProgramResult result = advect("out.vdb", bad);
    EXPECT_EQ(result.exitCode, 2) << bad << ": " << result.errors;
    EXPECT_NE(result.errors.find("percent of the longest side"), std::string::npos) << bad << result.errors;
  }
}

TEST_F(AdvectVerb, BadOptionsAreUsageErrorsThatNameThem) {
  for (const std::string bad : {"--steps -1",
                                "--steps 2.5",
                                "--dt nan",
                                "--dt inf",
                                "--dt 1e300",
                                "--method wind",
                                "--scheme best",
                                "--map map.obj",
                                "--map-coarseness 0",
                                "--rebake 101",
                                "--velocity gale",
                                "--velocity noise:amplitude=-1%",
                                "--velocity noise:amplitude",
                                "--velocity noise:frequency=0x",
                                "--velocity noise:octaves=0",
                                "--velocity curl:kind=worley",
                                "--velocity noise:kind=loud",
                                "--velocity curl:seed=1.5",
                                "--velocity curl:seed=1,seed=2",
                                "--velocity noise --velocity-grid v"}) {
    const std::string velocity = bad.starts_with("--velocity") ? "" : " --velocity noise ";
    const ProgramResult result = advect("out.vdb", velocity + bad);
    EXPECT_EQ(result.exitCode, 2) << bad << ": " << result.errors;
    EXPECT_NE(result.errors.find(bad.substr(0, bad.find(' '))), std::string::npos) << result.errors;
  }
  const ProgramResult typo = advect("out.vdb", "--velocity noise:amplitud=1%");
  EXPECT_EQ(typo.exitCode, 2);
  EXPECT_NE(typo.errors.find("did you mean amplitude"), std::string::npos) << typo.errors;
  EXPECT_EQ(advect("out.vdb", "").exitCode, 2);
  EXPECT_EQ(advect("out.vdb", "--velocity noise --method grid --map " + file("m.vdb")).exitCode, 2);
  EXPECT_EQ(advect("out.vdb", "--velocity noise --method gridless --continue-from m.vdb").exitCode, 2);
  EXPECT_EQ(advect("out.vdb", "--velocity noise --rebake 3 --map " + file("m.vdb")).exitCode, 2);
  for (const std::string other :
       {"--scheme bfecc", "--method grid --rebake 3", "--method gridless --map-coarseness 2"})
    EXPECT_EQ(advect("out.vdb", "--velocity noise " + other).exitCode, 2) << other;
}

}  // namespace
}  // namespace nephele::test

// The verb wisps, through the program.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "nephele/levelset/io/point_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace nephele::test {
namespace {

class WispsVerb : public testing::Test {
 protected:
  std::string file(const std::string& name) const { return folder_.file(name); }
  ProgramResult wisps(const std::string& output, const std::string& options) const {
    return runProgram("wisps -o " + file(output) + " " + options);
  }
  /// A file of points, in text; each of `points` is a line of "x y z ...".
  std::string pointsFile(const std::string& name, const std::vector<std::string>& points,
                         const std::string& moreProperties = {}) const {
    std::ofstream ply(file(name));
    ply << "ply\nformat ascii 1.0\nelement vertex " << points.size()
        << "\nproperty float x\nproperty float y\nproperty float z\n"
        << moreProperties << "end_header\n";
    for (const std::string& p : points) ply << p << '\n';
    return file(name);
  }

  TemporaryFolder folder_;
};

const std::string kSmall = " --dots 2000 --resolution 60 ";

double mass(const std::string& path) {
  const VdbGrid grid = readScalarGrid(path, "density");
  const auto bricks = toBricks(grid);
  double sum = 0;
  for (const std::int32_t pool : bricks->table())
    for (int z = 0; z < 8; ++z)
      for (int y = 0; y < 8; ++y)
        for (int x = 0; x < 8; ++x) sum += double(bricks->brick(pool)[sampleOffset(x, y, z)]);
  return sum * std::pow(double(bricks->voxelSize()), 3);
}

TEST_F(WispsVerb, MakesWispsWithoutAnInput) {
  const ProgramResult result = wisps(
      "w.vdb", kSmall + "--seed 4 --half --density 2 --wisp-size-variation 0 --stats " + file("s.json"));
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_NE(result.output.find("12000 dots of 6 guides"), std::string::npos) << result.output;
  const VdbGridInfo info = describe(readScalarGrid(file("w.vdb"), "density"));
  EXPECT_EQ(info.gridClass, VdbGridInfo::Class::fogVolume);
  EXPECT_TRUE(info.halfFloat);
  EXPECT_EQ(info.metadata.at("seed"), "4");
  const auto stats = nlohmann::json::parse(textOf(file("s.json")));
  EXPECT_EQ(stats["guides"], 6);
  EXPECT_EQ(stats["dots"], 12000);
  EXPECT_EQ(stats["grids"][0]["name"], "density");
  // 6 spheres of radius 0.5, half the shape, and density 2; half floats round by up to 1/2048.
  const double expected = 6 * 2 * 4.0 / 3 * M_PI * std::pow(0.5, 3);
  EXPECT_NEAR(double(stats["mass"]) / expected, 1, 1e-5);
  EXPECT_NEAR(mass(file("w.vdb")) / expected, 1, 1e-3);
}

// A wisp of so large a mean density holds voxels beyond 65504, where half floats end.
TEST_F(WispsVerb, RefusesHalfFloatsThatWouldBeInfinite) {
  const std::string dense = kSmall + "--guides 1 --density 1e6 ";
  EXPECT_EQ(wisps("w.vdb", dense).exitCode, 0);
  const ProgramResult result = wisps("h.vdb", dense + "--half");
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find("h.vdb: the grid 'density' has values up to"), std::string::npos)
      << result.errors;
  EXPECT_FALSE(std::filesystem::exists(file("h.vdb")));
}

TEST_F(WispsVerb, TakesPointsWithWhatTheyCarry) {
  const std::string points =
      pointsFile("p.ply", {"0 0 0 0.5 255 0 0 0 0 0", "3 0 0 0.25 0 255 0 0 4 0"},
                 "property float pscale\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
                 "property float vx\nproperty float vy\nproperty float vz\n");
  const ProgramResult result = wisps("w.vdb", points + kSmall +
                                                  "--shutter -0.5,0.5 --density 1 "
                                                  "--points " +
                                                  file("dots.ply"));
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  // Density 1 in two spheres of the radii that the points bring.
  const double expected = 4.0 / 3 * M_PI * (0.125 + 0.015625);
  EXPECT_NEAR(mass(file("w.vdb")) / expected, 1, 1e-4);
  const std::vector<VdbGrid> grids = readVdbFile(file("w.vdb"));
  ASSERT_EQ(grids.size(), 2u);
  EXPECT_EQ(describe(grids[1]).name, "Cd");
  // Near the guides, red and green.
  const auto red = toBricks(vectorComponents(grids[1])[0]), green = toBricks(vectorComponents(grids[1])[1]);
  const auto at = [](const BrickGrid& grid, const Vec3f& p) {
    const Vec3f q = grid.worldToIndex()(p);
    return grid.at({int(std::lround(q.x)), int(std::lround(q.y)), int(std::lround(q.z))});
  };
  EXPECT_GT(at(*red, {0, 0, 0}), 0.99f);
  EXPECT_GT(at(*green, {3, 1.5f, 0}), 0.99f);
  EXPECT_EQ(at(*red, {3, 1.5f, 0}), 0);
  // The dots can be read again, as many as there were, around their guides.
  const Mesh dots = readPoints(file("dots.ply"));
  ASSERT_EQ(dots.positions.size(), 4000u);
  Vec3d sum{};
  for (std::size_t i = 0; i < 2000; ++i) sum += dots.positions[2000 + i] / 2000.0;
  EXPECT_NEAR(sum.x, 3, 0.25);
}

// --wisp-size is a share of the extent of points, which one has none of, but needs none where it brings a
// size.
TEST_F(WispsVerb, TakesOnePointWithASizeOfItsOwn) {
  const std::string point = pointsFile("p.ply", {"1 2 3 0.5"}, "property float radius\n");
  const ProgramResult result = wisps("w.vdb", point + kSmall + "--density 1");
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_NEAR(mass(file("w.vdb")) / (4.0 / 3 * M_PI * 0.125), 1, 1e-4);
}

TEST_F(WispsVerb, TakesColumnsOfTextAndVerticesAroundAVolume) {
  std::ofstream(file("p.csv")) << "x,y,z,radius\n0,0,0,0.25\n3,0,0,0.25\n";
  const ProgramResult text = wisps("t.vdb", file("p.csv") + kSmall + "--density 1");
  ASSERT_EQ(text.exitCode, 0) << text.errors;
  const double ball = 4.0 / 3 * M_PI * 0.015625;
  EXPECT_NEAR(mass(file("t.vdb")) / (2 * ball), 1, 1e-4);
  // Guides in a tetrahedron whose vertices all have a radius.
  std::ofstream(file("m.ply"))
      << "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
         "property float z\nproperty float radius\nelement face 4\n"
         "property list uchar int vertex_indices\nend_header\n"
         "0 0 0 0.25\n4 0 0 0.25\n0 4 0 0.25\n0 0 4 0.25\n"
         "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n";
  const ProgramResult volume = wisps("v.vdb", file("m.ply") + kSmall + "--density 1 --on volume --guides 3");
  ASSERT_EQ(volume.exitCode, 0) << volume.errors;
  EXPECT_NEAR(mass(file("v.vdb")) / (3 * ball), 1, 1e-4);
}

// The time of an expression is the frame, its seed is --seed.
TEST_F(WispsVerb, ExpressionsOfVelocityKnowTimeAndSeed) {
  const std::string still = " --amplitude 0 --displacement 0.01 --shutter 0.999,1 ";
  const std::string point = pointsFile("p.ply", {"0 0 0 0.25"}, "property float radius\n");
  ASSERT_EQ(wisps("w.####.vdb", point + kSmall + still + "--velocity '=(time,seed,0)' --seed 3 --frames 2-2")
                .exitCode,
            0);
  const VdbGrid grid = readScalarGrid(file("w.0002.vdb"), "density");
  const Box box = contentBox(grid);
  EXPECT_NEAR(box.center().x, 2, 0.1);
  EXPECT_NEAR(box.center().y, 3, 0.1);
}

TEST_F(WispsVerb, PointsThatCannotBeGuidesAreRefusedWithTheirFile) {
  const auto error = [&](const std::string& name, const std::string& text) {
    std::ofstream(file(name)) << text;
    const ProgramResult result = wisps("w.vdb", file(name) + " --on vertices --dots 20 --resolution 8");
    EXPECT_EQ(result.exitCode, 1);
    return result.errors;
  };
  const auto line = [&](const std::string& name, const std::string& fault) {
    return "nephele wisps: error: " + file(name) + ": " + fault + "\n";
  };
  EXPECT_EQ(error("far.obj", "v 0 0 0\nv 1e39 0 0\n"),
            line("far.obj", "its points lie further apart than numbers of 32 bits can hold"));
  EXPECT_EQ(error("wide.obj", "v 3.39e38 0 0\nv 2e38 0 0\n"),
            line("wide.obj", "wisps: they reach further than numbers of 32 bits can hold"));
  EXPECT_EQ(error("sized.ply",
                  "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
                  "property float z\nproperty float radius\nend_header\n0 0 0 1\n1 0 0 -1\n"),
            line("sized.ply", "guides: vertex 1 has the size -1, which must be > 0 and finite"));
  EXPECT_EQ(error("gap.csv", "x,y,z,pscale\n0,0,0,0.1\n1,0,0,0.1\n2,0,0,\n"),
            line("gap.csv", "guides: vertex 2 has the size nan, which must be > 0 and finite"));
  EXPECT_NE(error("away.csv", "x,y,z,pscale\n2000000,0,0,0.5\n")
                .find(file("away.csv") + ": wisps reach as far as 2e+06 from the origin, with voxels of"),
            std::string::npos);
}

// Options that another one decides are not passed over.
TEST_F(WispsVerb, OptionsWithoutWhatTheyAreForAreRefused) {
  const std::string points = pointsFile("p.ply", {"0 0 0 0.5"}, "property float radius\n");
  EXPECT_NE(wisps("w.vdb", points + kSmall + "--guides 9").errors.find("--guides"), std::string::npos);
  EXPECT_EQ(wisps("w.vdb", points + kSmall + "--velocity-grid v").exitCode, 2);
}

// Nothing but colours makes a grid of them.
TEST_F(WispsVerb, WhiteGuidesOnSurfacesHaveNoColours) {
  const ProgramResult result =
      wisps("w.vdb", ownData("data/sphere_uv.obj") + kSmall + "--guides 50 --wisp-size 0.1");
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_EQ(result.output.find("'Cd'"), std::string::npos) << result.output;
}

TEST_F(WispsVerb, ScattersGuidesOnAMeshAndInsideIt) {
  const std::string sphere = ownData("data/sphere_uv.obj");
  const std::string tiny = sphere + " --dots 20 --wisp-size 0.001 --resolution 200 --points ";
  for (const std::string on : {"surface", "volume", "vertices"}) {
    const ProgramResult result =
        wisps("w.vdb", tiny + file("dots.ply") + " --on " + on + (on == "vertices" ? "" : " --guides 300"));
    ASSERT_EQ(result.exitCode, 0) << result.errors;
    // The sphere has radius 1; its triangles lie up to 2 % below, and an eighth of the ball within 1/2.
    int inner = 0;
    const Mesh dots = readPoints(file("dots.ply"));
    for (const Vec3d& p : dots.positions) {
      EXPECT_LT(length(p), 1.01);
      inner += length(p) < 0.9;
    }
    if (on == "volume")
      EXPECT_NEAR(double(inner) / double(dots.positions.size()), 0.729, 0.1);
    else
      EXPECT_EQ(inner, 0) << on;
  }
}

TEST_F(WispsVerb, SmearsAlongTheVelocity) {
  const std::string point = pointsFile("p.ply", {"0 0 0"});
  const std::string options =
      point + " --wisp-size 0.1 --dots 500 --voxel-size 0.02 --dot-radius 0 --density 1 ";
  ASSERT_EQ(wisps("still.vdb", options).exitCode, 0);
  ASSERT_EQ(wisps("smeared.vdb", options + "--velocity 2,0,0 --shutter 0,0.5").exitCode, 0);
  const VdbGridInfo still = describe(readScalarGrid(file("still.vdb"))),
                    smeared = describe(readScalarGrid(file("smeared.vdb")));
  // 2 * 0.5 / 0.02 = 50 voxels longer along x, on one side.
  EXPECT_EQ(smeared.indexMin.x, still.indexMin.x);
  EXPECT_NEAR(smeared.indexMax.x - still.indexMax.x, 50, 1);
  EXPECT_EQ(smeared.indexMax.y, still.indexMax.y);
  EXPECT_NEAR(mass(file("smeared.vdb")) / mass(file("still.vdb")), 1, 1e-4);
  // In percent of the wisps, whose box is as wide as the dots may lie.
  ASSERT_EQ(wisps("percent.vdb", options + "--velocity 100%,0,0 --shutter 0,0.5").exitCode, 0);
  const VdbGridInfo percent = describe(readScalarGrid(file("percent.vdb")));
  const int widest = still.indexMax.x - still.indexMin.x;
  EXPECT_EQ(percent.indexMin.x, still.indexMin.x);
  EXPECT_GE(percent.indexMax.x - still.indexMax.x, widest / 2 - 1);
  const ProgramResult curl = wisps("c.vdb", kSmall + "--velocity curl:amplitude=2% --shutter -1,1");
  EXPECT_EQ(curl.exitCode, 0) << curl.errors;
}

TEST_F(WispsVerb, IsTheSameAtAnyThreadCount) {
  const std::string options = kSmall + "--color 1,0.5,0.2 --velocity 1,0,0 --shutter 0,0.1 --threads ";
  ASSERT_EQ(wisps("one.vdb", options + "1").exitCode, 0);
  ASSERT_EQ(wisps("four.vdb", options + "4").exitCode, 0);
  const auto one = readVdbFile(file("one.vdb")), four = readVdbFile(file("four.vdb"));
  EXPECT_EQ(toBricks(one[0])->values(), toBricks(four[0])->values());
  EXPECT_EQ(toBricks(vectorComponents(one[1])[1])->values(),
            toBricks(vectorComponents(four[1])[1])->values());
}

TEST_F(WispsVerb, RefusesFilesThatHoldNoGuides) {
  const std::string none = pointsFile("none.ply", {}), one = pointsFile("one.ply", {"1 2 3"}),
                    bad = pointsFile("bad.ply", {"0 0 0", "1 nan 0"}),
                    flat = pointsFile("flat.ply", {"0 0 0 1", "1 1 1 0"}, "property float radius\n");
  const std::vector<std::pair<std::string, std::string>> cases{
      {none, "has no points"},
      {one, "give --wisp-size in world units"},
      {bad, "coordinate y is not finite"},
      {flat, "vertex 1 has the size 0"},
      {one + " --wisp-size 1 --on surface", "has no faces"},
      {one + " --wisp-size 1 --on volume", "has no faces"},
      {"/nowhere/p.ply", "/nowhere/p.ply"},
      {"--guides 1000000 --dots 100000 --wisp-size 1000 --memory-limit 1G --voxel-size 0.01",
       "use larger voxels"},
      {kSmall + "--velocity /nowhere/v.vdb --shutter 0,1", "/nowhere/v.vdb"}};
  for (const auto& [options, said] : cases) {
    const ProgramResult result = wisps("w.vdb", options);
    EXPECT_EQ(result.exitCode, 1) << options;
    EXPECT_NE(result.errors.find(said), std::string::npos) << options << "\n" << result.errors;
  }
  const ProgramResult small = wisps("w.vdb", "--voxel-size 1e-6");
  EXPECT_EQ(small.exitCode, 2);
  EXPECT_NE(small.errors.find("--voxel-size: wisps reach as far as 2.2"), std::string::npos) << small.errors;
  EXPECT_EQ(folder_.entryCount(), 4u);  // the files of points
}

TEST_F(WispsVerb, BadOptionsAreUsageErrorsThatNameThem) {
  for (const std::string bad : {"--guides 0",
                                "--dots 0",
                                "--dots -5",
                                "--wisp-size 0",
                                "--wisp-size -1%",
                                "--wisp-size nan",
                                "--wisp-size-variation 1",
                                "--density -1",
                                "--correlation 1.1",
                                "--walk-length 0",
                                "--thickness 2",
                                "--clump -1",
                                "--clump 100",
                                "--amplitude inf",
                                "--frequency 0",
                                "--octaves 0",
                                "--displacement -1",
                                "--resolution 0",
                                "--voxel-size 0",
                                "--dot-radius -1",
                                "--dot-radius 90%",
                                "--color 1,2",
                                "--color 2,0,0",
                                "--velocity 1,2",
                                "--velocity gale",
                                "--shutter 1,0",
                                "--shutter 0,1",
                                "--shape cube",
                                "--points p.obj",
                                "--seed -1"}) {
    const ProgramResult result = wisps("w.vdb", bad);
    EXPECT_EQ(result.exitCode, 2) << bad << ": " << result.errors;
    EXPECT_NE(result.errors.find(bad.substr(0, bad.find(' '))), std::string::npos) << result.errors;
  }
  EXPECT_EQ(wisps("w.vdb", "--on surface").exitCode, 2);
  EXPECT_EQ(wisps("w.vdb", pointsFile("p.ply", {"0 0 0"}) + " --shape disc").exitCode, 2);
  EXPECT_EQ(runProgram("wisps").exitCode, 2);
}

}  // namespace
}  // namespace nephele::test

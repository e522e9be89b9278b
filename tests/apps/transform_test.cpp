#include <gtest/gtest.h>

#include <fstream>

#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/grid/grid_field.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/shape/shapes.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace nephele::test {
namespace {

class TransformVerb : public testing::Test {
 protected:
  void run(const std::string& arguments) {
    const ProgramResult result = runProgram("transform " + arguments + " --quiet");
    EXPECT_EQ(result.exitCode, 0) << arguments << ": " << result.errors;
  }
  std::string file(const std::string& name) { return folder_.file(name); }

  TemporaryFolder folder_;
};

TEST_F(TransformVerb, ChangesUpAxisUnitAndPlaceOfAMesh) {
  std::ofstream(file("a.obj")) << "v 0 0 100\nv 200 0 100\nv 0 100 100\nv 0 0 400\nf 1 2 3 4\n";
  run(file("a.obj") + " -o " + file("b.obj") + " --up-axis z --unit cm --place ground --move 0,0,5");
  const Mesh mesh = readMesh(file("b.obj"));
  // z is up: (x, y, z) becomes (x, z, -y), in metres. The box is 2 x 3 x 1.
  const Box box = boundingBox(mesh);
  EXPECT_NEAR(box.min.x, -1, 1e-6f);
  EXPECT_NEAR(box.min.y, 0, 1e-6f);
  EXPECT_NEAR(box.max.y, 3, 1e-6f);
  EXPECT_NEAR(box.min.z, 4.5f, 1e-6f);
  EXPECT_NEAR(box.max.z, 5.5f, 1e-6f);
  EXPECT_EQ(mesh.faceCount(), 1u);
  // And back again.
  run(file("b.obj") + " -o " + file("c.obj") + " --to-up-axis z --to-unit cm --place centre");
  EXPECT_NEAR(boundingBox(readMesh(file("c.obj"))).size().z, 300, 1e-4f);
}

TEST_F(TransformVerb, MovesWhatLiesFarAwayWithoutRounding) {
  // In float such places are half a metre apart.
  std::ofstream(file("a.obj")) << "v 4500000.25 0 0\nv 4500001.25 0 0\nv 4500000.25 1 0.125\nf 1 2 3\n";
  run(file("a.obj") + " -o " + file("b.obj") + " --move -4500000.25,0,-0.1");
  const Mesh mesh = readMesh(file("b.obj"));
  EXPECT_EQ(mesh.positions[0].x, 0);
  EXPECT_EQ(mesh.positions[1].x, 1);
  EXPECT_EQ(mesh.positions[2].z, 0.125 - 0.1);
}

TEST_F(TransformVerb, MovesLevelSetsAndDensitiesWithoutResampling) {
  const auto shape = bakeGrid(sphere({0.1f, 0, 0}, 0.5f),
                              {.voxelSize = 0.05f, .box = {{-1, -1, -1}, {1, 1, 1}}, .band = {-0.2f, 0.2f}});
  writeVdbFile(file("a.vdb"),
               {toVdb(*shape, {"surface", VdbGridInfo::Class::levelSet}), toVdb(*shape, {"density"})}, {});
  run(file("a.vdb") + " -o " + file("b.vdb") + " --scale 2 --rotate 0,90,0 --move 0,3,0");
  const auto before = toBricks(readScalarGrid(file("a.vdb"), "surface")),
             after = toBricks(readScalarGrid(file("b.vdb"), "surface"));
  const ScalarField from = gridField(before), to = gridField(after);
  // About y by 90 degrees z goes to x, and x to -z. Distances are twice as large.
  for (const Vec3f& p : {Vec3f{0.55f, 0.1f, 0.05f}, Vec3f{0.1f, -0.45f, 0.1f}, Vec3f{-0.2f, 0.2f, 0.3f}})
    EXPECT_NEAR(to(Vec3f{2 * p.z, 2 * p.y + 3, -2 * p.x}), 2 * from(p), 1e-4f);
  // Others keep their values.
  const ScalarField density = gridField(toBricks(readScalarGrid(file("b.vdb"), "density")));
  const Vec3f p{0.3f, 0.2f, 0.1f};
  EXPECT_NEAR(density(Vec3f{2 * p.z, 2 * p.y + 3, -2 * p.x}), from(p), 1e-4f);
}

TEST_F(TransformVerb, PutsOnTheGroundWhatIsDownInTheOutput) {
  std::ofstream(file("a.obj")) << "v 0 0 5\nv 2 0 5\nv 0 4 5\nv 0 0 6\nf 1 2 3\nf 1 2 4\n";
  run(file("a.obj") + " -o " + file("b.obj") + " --up-axis z --to-up-axis z --place ground");
  const Box box = boundingBox(readMesh(file("b.obj")));
  EXPECT_EQ(box.min, (Vec3f{-1, -2, 0}));
  EXPECT_EQ(box.max, (Vec3f{1, 2, 1}));
}

// A ball is as large however its voxels are turned, and ends where its surface is, not the band around it.
TEST_F(TransformVerb, PlacesVolumesByWhatTheyShow) {
  const float radius = 0.5f, voxel = 0.05f;
  const auto level = bakeGrid(sphere({0.1f, 0.3f, 0}, radius),
                              {.voxelSize = voxel, .box = {{-1, -1, -1}, {1, 1, 1}}, .band = {-0.3f, 0.3f}});
  writeVdbFile(file("a.vdb"), {toVdb(*level, {"surface", VdbGridInfo::Class::levelSet})}, {});
  for (const char* turn : {"0,0,0", "30,40,50"}) {
    run(file("a.vdb") + " -o " + file("b.vdb") + " --place ground --rotate " + turn);
    const Box box = contentBox(readScalarGrid(file("b.vdb")));
    EXPECT_NEAR(box.min.y, 0, 1e-5) << turn;
    EXPECT_NEAR(box.max.y, 2 * radius, 0.03 * radius) << turn;
    EXPECT_NEAR(box.center().x, 0, 1e-5) << turn;
  }
}

// Beside 1e16, doubles lie 2 apart.
TEST_F(TransformVerb, RefusesPlacesWhereVoxelsAreNothing) {
  writeVdbFile(file("a.vdb"),
               {toVdb(*bakeGrid(sphere({}, 0.5f), {.voxelSize = 0.1f, .box = {{-1, -1, -1}, {1, 1, 1}}}),
                      {"density"})},
               {});
  for (const char* far : {"1e16,0,0", "0,-1e30,0"}) {
    const ProgramResult result =
        runProgram("transform " + file("a.vdb") + " -o " + file("b.vdb") + " --move " + far);
    EXPECT_EQ(result.exitCode, 1) << far;
    EXPECT_NE(result.errors.find("a.vdb: grid 'density' would be 1e+"), std::string::npos) << result.errors;
  }
  run(file("a.vdb") + " -o " + file("b.vdb") + " --move 1e10,0,0");
  EXPECT_NEAR(describe(readVdbFile(file("b.vdb"))[0]).voxelSize.x, 0.1, 1e-4);
}

TEST_F(TransformVerb, RefusesWhatDoesNotFit) {
  std::ofstream(file("a.obj")) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  const struct {
    std::string arguments;
    int exitCode;
    std::string message;
  } cases[] = {{file("a.obj") + " -o " + file("b.vdb"), 2, "a mesh becomes a mesh"},
               {file("a.obj") + " -o " + file("b.obj") + " --scale 0", 2, "--scale"},
               {file("a.obj") + " -o " + file("b.obj") + " --rotate 0,0,1e308", 2, "--rotate"},
               {file("a.obj") + " -o " + file("b.obj") + " --move 0,1e31,0", 2, "--move"},
               {file("a.obj") + " -o " + file("b.obj") + " --up-axis x", 2, "--up-axis"},
               {file("a.obj") + " -o " + file("b.obj") + " --unit parsec", 2, "--unit"},
               {file("none.obj") + " -o " + file("b.obj"), 1, "none.obj"}};
  for (const auto& c : cases) {
    const ProgramResult result = runProgram("transform " + c.arguments);
    EXPECT_EQ(result.exitCode, c.exitCode) << c.arguments << ": " << result.errors;
    EXPECT_NE(result.errors.find(c.message), std::string::npos) << c.arguments << ": " << result.errors;
  }
  EXPECT_EQ(folder_.entryCount(), 1u);
}

TEST_F(TransformVerb, NamesTheInputWhoseGridsCannotBeWrittenAgain) {
  const std::string points = sharedData("volumes/sphere_points.vdb");
  NEPHELE_REQUIRE_SHARED_DATA(points);
  const ProgramResult result = runProgram("transform " + points + " -o " + file("b.vdb") + " --scale 2");
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find(points + ": the grid '"), std::string::npos) << result.errors;
  EXPECT_NE(result.errors.find("cannot be written"), std::string::npos) << result.errors;
  EXPECT_EQ(folder_.entryCount(), 0u);
}

}  // namespace
}  // namespace nephele::test

// Names in capitals, as other systems write them, name the same formats in every verb.
#include <gtest/gtest.h>

#include <fstream>

#include "nephele/levelset/flow/advection_files.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "tests/support/density.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

class CapitalExtensions : public testing::Test {
 protected:
  void SetUp() override {
    writeMesh(file("ball.obj"), icosphere(1.0, 3));
    expectSuccess("levelset " + file("ball.obj") + " -o " + file("BALL.VDB") + " --resolution 24");
    writeVdbFile(file("FOG.VDB"), {toVdb(*ball(1.0f, 0.1f), {"density", VdbGridInfo::Class::fogVolume})}, {});
  }
  std::string file(const std::string& name) const { return folder_.file(name); }
  static void expectSuccess(const std::string& arguments) {
    const ProgramResult result = runProgram(arguments);
    EXPECT_EQ(result.exitCode, 0) << arguments << "\n" << result.errors;
  }

  TemporaryFolder folder_;
};

TEST_F(CapitalExtensions, NameVolumesInEveryVerb) {
  const std::string surface = file("BALL.VDB"), fog = file("FOG.VDB");
  expectSuccess("info " + surface + " " + fog);
  expectSuccess("mesh " + surface + " -o " + file("BALL.OBJ"));
  expectSuccess("cut " + surface + " -o " + file("halves") + " --plane 0,0,0,1,0,0 --preview " +
                file("c.png"));
  expectSuccess("cut " + file("ball.obj") + " -o " + file("hollow") + " --knife " + surface);
  expectSuccess("cloud " + surface + " -o " + file("CLOUD.VDB") +
                " --resolution 24 --layers 1 --amplitude mask:" + fog + ":1%,3%");
  expectSuccess("advect " + fog + " -o " + file("MOVED.VDB") +
                " --velocity noise:amplitude=1%,frequency=2x --steps 1");
  expectSuccess("render " + fog + " --object " + surface + " --holdout-object " + surface + " -o " +
                file("a.exr") + " --size 16x12");
}

TEST_F(CapitalExtensions, NameVelocitiesAndMasksOfRecipes) {
  const auto x = ball(1.0f, 0.1f);
  writeVdbFile(file("V.VDB"), {toVdb(VectorGrids{x, x, x}, {"v"})}, {});
  expectSuccess("advect " + file("FOG.VDB") + " -o " + file("moved.vdb") + " --velocity " + file("V.VDB") +
                " --steps 1");
  std::ofstream(file("recipe.toml")) << "[[layer]]\namplitude = \"5%\"\nmask = \"" << file("FOG.VDB")
                                     << "\"\n";
  expectSuccess("cloud " + file("ball.obj") + " -o " + file("cloud.vdb") + " --resolution 24 --recipe " +
                file("recipe.toml"));
}

TEST_F(CapitalExtensions, NameNanoVdb) {
  const std::string path = sharedData("volumes/teapot_cloud.nvdb");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  std::filesystem::copy_file(path, file("TEAPOT.NVDB"));
  expectSuccess("info " + file("TEAPOT.NVDB"));
}

}  // namespace
}  // namespace nephele::test

// Layers, deep pictures and holdouts of the verb render, through the program.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/shape/shapes.h"
#include "nephele/render/image/deep_image.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/scene/camera.h"
#include "nephele/render/scene/holdout.h"
#include "tests/support/density.h"
#include "tests/support/run_program.h"

namespace nephele::test {
namespace {

class RenderLayers : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    writeVdbFile(fog(), {toVdb(*ball(1.0f, 0.1f), {"density", VdbGridInfo::Class::fogVolume})}, {});
  }
  static void TearDownTestSuite() { delete folder_; }

  static std::string fog() { return folder_->file("fog.vdb"); }
  static std::string start() { return "render " + fog() + " --size 32x24 --quiet -o "; }
  static inline TemporaryFolder* folder_ = nullptr;
};

TEST_F(RenderLayers, AreWrittenUnderTheirNames) {
  const TemporaryFolder folder;
  const ProgramResult result = runProgram(
      start() + folder.file("a.exr") +
      " --aov Z,Z_median,Z_mean,normal,position,motion,light,transmittance,albedo --view 0,0 --samples 1");
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  const Image image = readImage(folder.file("a.exr"));
  for (const char* name : {"Z", "Z_median", "Z_mean", "N.X", "N.Y", "N.Z", "P.X", "P.Y", "P.Z", "motion.X",
                           "motion.Y", "light_sun.R", "light_sky.B", "transmittance.G", "albedo.G"})
    ASSERT_TRUE(image.find(name)) << name;
  // The front of a dense ball, seen from +z.
  EXPECT_LE(image.at("Z", 16, 12), image.at("Z_median", 16, 12));
  EXPECT_NEAR(image.at("P.Z", 16, 12), 1.0f, 0.15f);
  EXPECT_GT(image.at("N.Z", 16, 12), 0.9f);
  EXPECT_NEAR(image.at("albedo.G", 16, 12), 0.99f * image.at("A", 16, 12), 1e-3f);
  EXPECT_TRUE(std::isinf(image.at("Z_median", 0, 0)));
  EXPECT_EQ(runProgram(start() + folder.file("a.exr") + " --aov none").exitCode, 0);
  EXPECT_EQ(readImage(folder.file("a.exr")).channels.size(), 4u);
}

TEST_F(RenderLayers, SayHowAnAnimatedCameraMovesThePicture) {
  const TemporaryFolder folder;
  std::ofstream(folder.file("a.chan")) << "1 0 0 10 0 0 0 40\n2 2 0 10 0 0 0 40\n3 4 0 10 0 0 0 40\n";
  const std::string options = " --aov motion,Z_median --extinction 50 --camera " + folder.file("a.chan");
  for (const char* frame : {"1", "3"}) {
    ASSERT_EQ(runProgram(start() + folder.file("a.exr") + options + " --frame " + frame).exitCode, 0);
    const Image image = readImage(folder.file("a.exr"));
    const int x = int(std::max_element(image.channel("A").values.begin() + 12 * 32,
                                       image.channel("A").values.begin() + 13 * 32) -
                      image.channel("A").values.begin()) %
                  32;
    // Two units to the left in a frame, by pixels per unit at that depth: the .chan angle is the vertical
    // one.
    const double perUnit = 24 / (2 * std::tan(20 * double(kPi) / 180) * image.at("Z_median", x, 12));
    EXPECT_NEAR(image.at("motion.X", x, 12), -2 * perUnit, 0.01 * perUnit);
    EXPECT_NEAR(image.at("motion.Y", x, 12), 0, 1e-4);
  }
}

TEST_F(RenderLayers, DeepPicturesFlattenToThePictureAtAnyNumberOfThreads) {
  const TemporaryFolder folder;
  const std::string options = " --extinction 4 --deep " + folder.file("d.exr");
  ASSERT_EQ(runProgram(start() + folder.file("a.exr") + options + " --threads 1").exitCode, 0);
  const std::string one = textOf(folder.file("d.exr"));
  ASSERT_EQ(
      runProgram(start() + folder.file("a.exr") + options + " --stats " + folder.file("s.json")).exitCode, 0);
  const Image image = readImage(folder.file("a.exr"));
  const DeepImage deep = readDeepExr(folder.file("d.exr"));
  for (int y = 0; y != 24; ++y)
    for (int x = 0; x != 32; ++x) {
      const FlatPixel flat = flattened(deep.at(x, y));
      ASSERT_NEAR(flat.alpha, image.at("A", x, y), 5e-4f);
      ASSERT_NEAR(flat.colour.x, image.at("R", x, y), 1e-3f * (1 + image.at("R", x, y)));
    }
  EXPECT_EQ(nlohmann::json::parse(textOf(folder.file("s.json")))["deep_samples"], deep.sampleCount());
  // All but the command line, which both files hold.
  const DeepImage again = [&] {
    std::ofstream(folder.file("one.exr"), std::ios::binary) << one;
    return readDeepExr(folder.file("one.exr"));
  }();
  ASSERT_EQ(again.sampleCount(), deep.sampleCount());
  for (std::size_t i = 0; i != deep.pixels.size(); ++i)
    for (std::size_t k = 0; k != deep.pixels[i].size(); ++k) {
      ASSERT_EQ(again.pixels[i][k].z, deep.pixels[i][k].z);
      ASSERT_EQ(again.pixels[i][k].alpha, deep.pixels[i][k].alpha);
      ASSERT_EQ(again.pixels[i][k].colour, deep.pixels[i][k].colour);
    }
}

TEST_F(RenderLayers, AHoldoutInTheMiddleLeavesTheFrontHalf) {
  // A wall through the middle of the ball, in the plane of the picture, at the camera's distance of 9.
  const TemporaryFolder folder;
  const Camera camera = Camera::lookingAt({0, 0, 9}, {0, 0, 0}, {0, 1, 0}, {32, 24, 20.0f});
  DeepImage wall;
  wall.width = 32;
  wall.height = 24;
  wall.pixels.assign(32 * 24, {{9, 9, 1, {}}});
  writeDeepExr(folder.file("wall.exr"), wall, camera);
  const std::string options = " --camera-position 0,0,9 --look-at 0,0,0 --fov 20 --extinction 0.6931472 ";
  ASSERT_EQ(
      runProgram(start() + folder.file("a.exr") + options + "--holdout " + folder.file("wall.exr")).exitCode,
      0);
  const ProgramResult coloured =
      runProgram("render " + fog() + " --size 32x24 -o " + folder.file("c.exr") + options + "--holdout " +
                 folder.file("wall.exr") + " --extinction-color 1,1,0.5");
  EXPECT_NE(coloured.errors.find("one opacity for all colours"), std::string::npos) << coloured.errors;
  // exp(-ln 2) of the light gets through a radius of the ball; an element behind the wall would find alpha 0.
  EXPECT_NEAR(readImage(folder.file("a.exr")).at("A", 16, 12), 0.5f, 0.01f);
}

TEST_F(RenderLayers, TwoInOnePlaceAddUpToBothHoweverDense) {
  // A ball held out by its own deep picture: of the two in one place each is half of what both are,
  // (1 - (1 - a)^2) / 2. At extinction 60 a step of a voxel is 6 free paths long. Pixels at the rim, whose
  // rays differ, are not compared.
  const TemporaryFolder folder;
  for (const char* extinction : {"1", "8", "60"}) {
    const std::string options = std::string(" --view 0,0 --light-quality draft --extinction ") + extinction;
    ASSERT_EQ(
        runProgram(start() + folder.file("a.exr") + options + " --deep " + folder.file("d.exr")).exitCode, 0);
    ASSERT_EQ(
        runProgram(start() + folder.file("b.exr") + options + " --holdout " + folder.file("d.exr")).exitCode,
        0);
    const Image whole = readImage(folder.file("a.exr")), held = readImage(folder.file("b.exr"));
    for (int y = 9; y != 15; ++y)
      for (int x = 13; x != 19; ++x) {
        const float left = 1 - whole.at("A", x, y);
        EXPECT_NEAR(held.at("A", x, y), (1 - left * left) / 2, 0.05f) << extinction << ": " << x << ", " << y;
      }
  }
}

TEST_F(RenderLayers, AHoldoutOfAnotherCameraIsRefused) {
  const TemporaryFolder folder;
  const std::string deep = folder.file("d.exr"), made = " --extinction 1 --light-quality draft --view 20,5 ";
  ASSERT_EQ(runProgram(start() + folder.file("a.exr") + made + "--deep " + deep).exitCode, 0);
  const auto hold = [&](const std::string& options) {
    return runProgram(start() + folder.file("b.exr") + " --extinction 1 --light-quality draft --holdout " +
                      deep + " " + options);
  };
  EXPECT_EQ(hold("--view 20,5").exitCode, 0);
  // Turned by a tenth of a degree is 0.08 pixels at this size, and more than rounding makes of it.
  for (const std::string other : {"--view 20.1,5", "--view 120,5", "--view 20,5 --fov 40"}) {
    const ProgramResult result = hold(other);
    EXPECT_EQ(result.exitCode, 1) << other;
    EXPECT_NE(result.errors.find(deep + ": was made by another camera: at ("), std::string::npos)
        << result.errors;
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
  }
  // The same place, another width of view.
  const std::string place = "--camera-position 0,0,9 --look-at 0,0,0 --extinction 1 --light-quality draft ";
  ASSERT_EQ(runProgram(start() + folder.file("a.exr") + " " + place + "--fov 30 --deep " + deep).exitCode, 0);
  const ProgramResult wider =
      runProgram(start() + folder.file("b.exr") + " " + place + "--fov 31 --holdout " + deep);
  EXPECT_EQ(wider.exitCode, 1);
  // 2 tan(15 degrees) and 2 tan(15.5 degrees).
  EXPECT_NE(wider.errors.find("its picture is 0.5359 wide at distance 1, this one 0.5546"), std::string::npos)
      << wider.errors;
}

TEST_F(RenderLayers, ACameraThatLooksAlongItsOwnMinusZIsTheSame) {
  // As other programs write it: the third column of worldToCamera has the other sign, and there is no width.
  const TemporaryFolder folder;
  const Camera camera = Camera::lookingAt({0, 0, 9}, {0, 0, 0}, {0, 1, 0}, {32, 24, 20.0f});
  ImageCamera other = camera;
  for (const std::size_t i : {2, 6, 10, 14}) other.worldToCamera[i] *= -1;
  other.screenWidth = 1;
  DeepImage wall;
  wall.width = 32;
  wall.height = 24;
  wall.pixels.assign(32 * 24, {{9, 9, 1, {}}});
  writeDeepExr(folder.file("wall.exr"), wall, other);
  EXPECT_TRUE(readHoldout(folder.file("wall.exr"), camera));
}

// A square of edge 6 in the plane z, facing +z, with texture coordinates.
std::string writeSquare(const TemporaryFolder& folder, const std::string& name, float z) {
  std::ofstream file(folder.file(name));
  for (const char* corner : {"-3 -3 ", "3 -3 ", "3 3 ", "-3 3 "}) file << "v " << corner << z << "\n";
  file << "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
  return folder.file(name);
}

TEST_F(RenderLayers, ObjectsAreSeenWhereTheDensityIsScaledToNothing) {
  // The square at z = 0 across the line of sight, full in the light of a sun of irradiance pi: its colour.
  const TemporaryFolder folder;
  const std::string square = writeSquare(folder, "wall.obj", 0);
  const ProgramResult result =
      runProgram(start() + folder.file("a.exr") + " --density-scale 0 --ground --object " + square +
                 " --camera-position 0,0,9 --look-at 0,0,0 --fov 20 --sun 0,0,3.1415927 --sky 0,0,0");
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  const Image image = readImage(folder.file("a.exr"));
  for (const int x : {2, 16, 30}) EXPECT_NEAR(image.at("R", x, 12), 0.5f, 2e-3f) << x;
  // Without objects it is as empty as before.
  ASSERT_EQ(runProgram(start() + folder.file("a.exr") + " --density-scale 0").exitCode, 0);
  const Image empty = readImage(folder.file("a.exr"));
  for (const float alpha : empty.channel("A").values) ASSERT_EQ(alpha, 0.0f);
}

// The horizon of a plane is at the height of the camera: level, whatever the azimuth.
TEST_F(RenderLayers, TheGroundReachesToALevelHorizon) {
  const TemporaryFolder folder;
  const std::string options =
      " --camera-position 20,3,22 --look-at 0,3,0 --fov 20 --density-scale 0 --ground --ground-height -2 "
      "--size 200x100 --light-quality draft";
  ASSERT_EQ(runProgram("render " + fog() + " -o " + folder.file("a.exr") + options).exitCode, 0);
  const Image image = readImage(folder.file("a.exr"));
  for (int x = 0; x < 200; ++x) {
    ASSERT_EQ(image.at("A", x, 48), 0.0f) << x;
    ASSERT_EQ(image.at("A", x, 51), 1.0f) << x;
  }
}

TEST_F(RenderLayers, ObjectsStandBesideTheVolume) {
  const TemporaryFolder folder;
  const std::string options =
      " --camera-position 0,0,9 --look-at 0,0,0 --fov 20 --sun 0,0,3.1415927 --sky 0,0,0 ";
  const std::string wall = writeSquare(folder, "wall.obj", -2), middle = writeSquare(folder, "middle.obj", 0);
  const auto make = [&](const std::string& more) {
    const std::string extinction =
        more.find("--extinction") == std::string::npos ? "--extinction 0.6931472 " : "";
    const ProgramResult result = runProgram(start() + folder.file("a.exr") + options + extinction + more);
    EXPECT_EQ(result.exitCode, 0) << result.errors;
    return readImage(folder.file("a.exr"));
  };
  // Irradiance pi makes the radiance of a surface its colour; beside the ball nothing else is there.
  const Image image = make("--aov light --object " + wall + " --object-color 0.6,0.4,0.2");
  EXPECT_NEAR(image.at("R", 2, 12), 0.6f, 2e-3f);
  EXPECT_NEAR(image.at("B", 2, 12), 0.2f, 2e-3f);
  EXPECT_EQ(image.at("A", 2, 12), 1.0f);
  EXPECT_EQ(image.at("A", 16, 12), 1.0f);
  // In the shadow of the ball, and behind it: a quarter twice.
  EXPECT_NEAR(image.at("light_objects.R", 16, 12), 0.6f / 16, 6e-3f);
  EXPECT_EQ(
      make("--aov light --threads 1 --object " + wall + " --object-color 0.6,0.4,0.2").channel("R").values,
      image.channel("R").values);
  // Fields of 3 units: the lower left and upper right ones are bright.
  const Image checked = make("--checker 2 --object " + wall);
  EXPECT_NEAR(checked.at("R", 2, 20), 0.5f, 2e-3f);
  EXPECT_NEAR(checked.at("R", 2, 3), 0.125f, 2e-3f);
  // A holdout through the middle of the ball leaves half, and nothing beside it.
  const Image held = make("--holdout-object " + middle);
  EXPECT_NEAR(held.at("A", 16, 12), 0.5f, 0.02f);
  EXPECT_EQ(held.at("A", 2, 12), 0.0f);
  // The ground reaches to the horizon, in the middle of the picture.
  const Image ground = make("--ground --backdrop --preview " + folder.file("a.png"));
  EXPECT_EQ(ground.at("A", 2, 23), 1.0f);
  EXPECT_EQ(ground.at("A", 2, 1), 0.0f);
  ASSERT_TRUE(ground.find("backdrop.B"));
  // Level sets are objects, too.
  const std::string levelSet = folder.file("ball.vdb");
  const auto shape = bakeGrid(
      sphere({0, 0, 0.5f}, 0.5f),
      {.voxelSize = 0.1f, .box = {{-1.4f, -1.4f, -1.4f}, {1.4f, 1.4f, 1.4f}}, .band = {-0.3f, 0.3f}});
  writeVdbFile(levelSet, {toVdb(*shape, {"surface", VdbGridInfo::Class::levelSet})}, {});
  EXPECT_NEAR(make("--aov position --samples 1 --extinction 0.001 --object " + levelSet).at("P.Z", 16, 12),
              1.0f, 0.02f);
}

TEST_F(RenderLayers, MeshesAndLevelSetsAloneAreShadedQuickly) {
  const TemporaryFolder folder;
  const std::string ball = folder.file("ball.obj"), levelSet = folder.file("ball.vdb");
  const auto shape = bakeGrid(
      sphere({0, 0, 0}, 0.5f),
      {.voxelSize = 0.05f, .box = {{-0.8f, -0.8f, -0.8f}, {0.8f, 0.8f, 0.8f}}, .band = {-0.2f, 0.2f}});
  writeVdbFile(levelSet, {toVdb(*shape, {"surface", VdbGridInfo::Class::levelSet})}, {});
  ASSERT_EQ(runProgram("mesh " + levelSet + " -o " + ball + " --quiet").exitCode, 0);
  const auto make = [&](const std::string& input, const std::string& more = {}) {
    const ProgramResult result =
        runProgram("render " + input + " -o " + folder.file("a.exr") + " --preview " + folder.file("a.png") +
                   " --size 48x36 --quiet " + more);
    EXPECT_EQ(result.exitCode, 0) << result.errors;
    return readImage(folder.file("a.exr"));
  };
  // The same surface, by marching cubes.
  const Image mesh = make(ball), field = make(levelSet), red = make(ball, "--object-color 0.5,0,0");
  for (const char* channel : {"R", "G", "B"}) {
    EXPECT_NEAR(mesh.at(channel, 24, 18), field.at(channel, 24, 18), 0.01f);
    EXPECT_GT(mesh.at(channel, 24, 18), 0.1f);
  }
  EXPECT_EQ(mesh.at("A", 0, 0), 1.0f);
  EXPECT_EQ(red.at("G", 24, 18), 0.0f);
  EXPECT_GT(red.at("R", 24, 18), 0.1f);
  EXPECT_EQ(make(ball, "--threads 1").channel("R").values, mesh.channel("R").values);
  const struct {
    std::string arguments;
    int exitCode;
    std::string message;
  } cases[] = {{ball + " --checker 8", 1, "has no texture coordinates"},
               {ball + " --f-stop 2", 1, "without --f-stop"},
               {ball + " --velocity-grid v --shutter 0,0.5", 2, "--velocity-grid"},
               {ball + " --aerial-perspective", 2, "--aerial-perspective"},
               {folder.file("none.obj"), 1, "none.obj"},
               {fog() + " " + ball, 1, "is a mesh, not a density"}};
  for (const auto& c : cases) {
    const ProgramResult result =
        runProgram("render " + c.arguments + " -o " + folder.file("b.exr") + " --quiet --size 8x6");
    EXPECT_EQ(result.exitCode, c.exitCode) << c.arguments << ": " << result.errors;
    EXPECT_NE(result.errors.find(c.message), std::string::npos) << c.arguments << ": " << result.errors;
  }
}

// Whichever grid comes first in the file.
TEST_F(RenderLayers, TheGridThatIsAskedForIsTheOneThatIsShown) {
  const TemporaryFolder folder;
  const auto shape = bakeGrid(
      sphere({0, 0, 0}, 0.5f),
      {.voxelSize = 0.05f, .box = {{-0.8f, -0.8f, -0.8f}, {0.8f, 0.8f, 0.8f}}, .band = {-0.2f, 0.2f}});
  const auto small = bakeGrid(
      sphere({0, 0, 0}, 0.25f),
      {.voxelSize = 0.05f, .box = {{-0.8f, -0.8f, -0.8f}, {0.8f, 0.8f, 0.8f}}, .band = {-0.2f, 0.2f}});
  using Class = VdbGridInfo::Class;
  writeVdbFile(folder.file("a.vdb"),
               {toVdb(*shape, {"surface", Class::levelSet}), toVdb(*small, {"small", Class::levelSet}),
                toVdb(*ball(0.5f, 0.05f), {"density", Class::fogVolume})},
               {});
  writeVdbFile(folder.file("b.vdb"), {toVdb(*ball(0.5f, 0.05f), {"density", Class::fogVolume})}, {});
  const auto opaque = [&](const std::string& arguments) {
    const ProgramResult result = runProgram("render " + arguments + " -o " + folder.file("a.exr") +
                                            " --size 48x36 --camera-position 0,0,3 --quality draft --quiet");
    EXPECT_EQ(result.exitCode, 0) << result.errors;
    return readImage(folder.file("a.exr")).channel("R").values;
  };
  EXPECT_EQ(opaque(folder.file("a.vdb") + " --grid density"), opaque(folder.file("b.vdb")));
  EXPECT_EQ(opaque(folder.file("a.vdb") + " --grid surface"), opaque(folder.file("a.vdb")));
  EXPECT_NE(opaque(folder.file("a.vdb") + " --grid small"), opaque(folder.file("a.vdb")));
  const ProgramResult none = runProgram("render " + folder.file("a.vdb") + " --grid none.at.all -o " +
                                        folder.file("c.exr") + " --size 8x6 --quiet");
  EXPECT_EQ(none.exitCode, 1);
  EXPECT_NE(none.errors.find("none.at.all"), std::string::npos) << none.errors;
}

TEST_F(RenderLayers, ObjectsThatCannotBeAreRefused) {
  const TemporaryFolder folder, files;
  std::ofstream(files.file("bare.obj")) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  const std::string bare = files.file("bare.obj"), wall = writeSquare(files, "wall.obj", 0);
  const struct {
    std::string arguments;
    int exitCode;
    std::string message;
  } cases[] = {{"--object " + files.file("none.obj"), 1, "none.obj"},
               {"--object " + fog(), 1, "not a level set"},
               {"--object " + bare + " --checker 8", 1, "bare.obj"},
               {"--object " + bare + " --checker -1", 2, "--checker"},
               {"--object " + wall + " --texture " + files.file("none.png"), 1, "none.png"},
               {"--object " + wall + " --object-color 2,0,0", 2, "--object-color"},
               {"--checker 4", 2, "--object"},
               {"--ground-height 3", 2, "--ground"}};
  for (const auto& c : cases) {
    const ProgramResult result = runProgram(start() + folder.file("a.exr") + " " + c.arguments);
    EXPECT_EQ(result.exitCode, c.exitCode) << c.arguments << ": " << result.errors;
    EXPECT_NE(result.errors.find(c.message), std::string::npos) << c.arguments << ": " << result.errors;
  }
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST_F(RenderLayers, RefuseWhatCannotBe) {
  const TemporaryFolder folder, files;
  ASSERT_EQ(runProgram(start() + files.file("a.exr") + " --deep " + files.file("d.exr")).exitCode, 0);
  const struct {
    std::string arguments;
    int exitCode;
    std::string message;
  } cases[] = {{"--aov depth", 2, "--aov"},
               {"--aov Z,Z", 1, "named twice"},
               {"--deep " + folder.file("d.tif"), 2, "--deep"},
               {"--holdout " + files.file("none.exr"), 1, "none.exr"},
               {"--holdout " + files.file("a.exr"), 1, "not a deep image"},
               {"--holdout " + fog(), 1, "fog.vdb"},
               {"--deep " + folder.file("missing/d.exr"), 1, "missing/d.exr"}};
  for (const auto& c : cases) {
    const ProgramResult result = runProgram(start() + folder.file("a.exr") + " " + c.arguments);
    EXPECT_EQ(result.exitCode, c.exitCode) << c.arguments << ": " << result.errors;
    EXPECT_NE(result.errors.find(c.message), std::string::npos) << c.arguments << ": " << result.errors;
    std::filesystem::remove(folder.file("a.exr"));
  }
  const ProgramResult other = runProgram("render " + fog() + " -o " + folder.file("a.exr") +
                                         " --size 16x16 --holdout " + files.file("d.exr"));
  EXPECT_EQ(other.exitCode, 1);
  EXPECT_NE(other.errors.find("32x24"), std::string::npos) << other.errors;
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST_F(RenderLayers, PathsTakeObjectsHoldoutsAndDepth) {
  // The marcher's picture of the same, within the noise of 64 paths per pixel: the opacity of a pixel is off
  // by 1/16 at most (one standard error), its mean over the picture by a thousandth.
  const TemporaryFolder folder, files;
  ASSERT_EQ(
      runProgram(start() + files.file("a.exr") + " --view 40,10 --extinction 1 --deep " + files.file("d.exr"))
          .exitCode,
      0);
  const std::string scene = " --view 40,10 --ground --shadows deep --extinction 2 --aov Z,light --holdout " +
                            files.file("d.exr") + " --object " + writeSquare(files, "wall.obj", -1.2f);
  const auto make = [&](const std::string& name, const std::string& arguments) {
    const ProgramResult result = runProgram(start() + folder.file(name + ".exr") + scene + " --deep " +
                                            folder.file(name + "_deep.exr") + arguments);
    EXPECT_EQ(result.exitCode, 0) << result.errors;
    return readImage(folder.file(name + ".exr"));
  };
  const Image marched = make("march", ""), traced = make("path", " --integrator path --spp 64");
  double before = 0, after = 0;
  for (int y = 0; y != 24; ++y)
    for (int x = 0; x != 32; ++x) {
      before += double(marched.at("A", x, y));
      after += double(traced.at("A", x, y));
    }
  EXPECT_NEAR(after / before, 1, 0.01);
  EXPECT_GT(before, 24 * 32 * 0.1);
  EXPECT_EQ(traced.channel("Z").values, marched.channel("Z").values);
  EXPECT_TRUE(traced.find("light_objects.R"));
  const DeepImage deep = readDeepExr(folder.file("path_deep.exr"));
  for (int y = 0; y != 24; ++y)
    for (int x = 0; x != 32; ++x) ASSERT_NEAR(flattened(deep.at(x, y)).alpha, traced.at("A", x, y), 1e-3f);
}

TEST_F(RenderLayers, DeepPicturesFlattenToThePictureInAnotherProgram) {
  if (std::system("command -v oiiotool >/dev/null 2>&1") != 0)
    GTEST_SKIP() << "the program oiiotool is not installed (package openimageio-tools)";
  const TemporaryFolder folder;
  ASSERT_EQ(
      runProgram(start() + folder.file("a.exr") + " --extinction 4 --aov none --deep " + folder.file("d.exr"))
          .exitCode,
      0);
  const std::string command = "oiiotool '" + folder.file("d.exr") + "' --flatten --ch R,G,B,A -d half -o '" +
                              folder.file("flat.exr") + "' >/dev/null 2>&1";
  ASSERT_EQ(std::system(command.c_str()), 0);
  const Image image = readImage(folder.file("a.exr")), flat = readImage(folder.file("flat.exr"));
  ASSERT_EQ(flat.width, 32);
  // Samples of 16 bit, whose roundings are made up for by the next one.
  for (const char* name : {"R", "G", "B", "A"})
    for (int y = 0; y != 24; ++y)
      for (int x = 0; x != 32; ++x) {
        ASSERT_NEAR(flat.at(name, x, y), image.at(name, x, y), 1e-3f * (1 + image.at(name, x, y)));
      }
}

TEST_F(RenderLayers, NeitherPictureIsThereWhereTheDeepOneCannotBeWritten) {
  const TemporaryFolder folder;
  const std::string arguments =
      start() + folder.file("a.exr") + " --aov none --extinction 4" + " --deep " + folder.file("d.exr");
  ASSERT_EQ(runProgram(arguments).exitCode, 0);
  const auto flat = std::filesystem::file_size(folder.file("a.exr")),
             deep = std::filesystem::file_size(folder.file("d.exr"));
  // In units of 512 bytes: room for the flat one only.
  const std::uintmax_t limit = flat / 512 + 1;
  ASSERT_GT(deep, limit * 512);
  std::filesystem::remove(folder.file("a.exr"));
  std::filesystem::remove(folder.file("d.exr"));
  const ProgramResult result = runProgram(arguments, "ulimit -f " + std::to_string(limit) + ";");
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find("d.exr"), std::string::npos) << result.errors;
  EXPECT_EQ(folder.entryCount(), 0u);
  EXPECT_EQ(runProgram(start() + folder.file("a.exr") + " --deep " + folder.file("a.exr")).exitCode, 2);
}

}  // namespace
}  // namespace nephele::test

// The verb render on volumes of others, good and bad ones, through the program.
#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>

#include "nephele/levelset/grid/openvdb_instances.h"
#include "nephele/render/image/exr_io.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace nephele::test {
namespace {

TEST(RenderData, RefusesALevelSetAndSaysWhatMakesADensityOfIt) {
  // Beside a density; alone it is shaded as a surface.
  const std::string path = sharedData("volumes/cube_levelset.vdb"),
                    fog = sharedData("volumes/dragon_small_fog.vdb");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  NEPHELE_REQUIRE_SHARED_DATA(fog);
  const TemporaryFolder folder;
  const ProgramResult result = runProgram("render " + fog + " " + path + " -o " + folder.file("a.exr"));
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find("level set"), std::string::npos) << result.errors;
  EXPECT_NE(result.errors.find("nephele cloud"), std::string::npos) << result.errors;
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST(RenderData, MakesPicturesOfRealVolumes) {
  const TemporaryFolder folder;
  for (const char* name : {"dragon_small_fog.vdb", "bifrost_torus_fog.vdb", "smoke_double_fog.vdb",
                           "blender_fluid_5_grids.vdb"}) {
    const std::string path = sharedData("volumes/" + std::string(name));
    NEPHELE_REQUIRE_SHARED_DATA(path);
    const ProgramResult result =
        runProgram("render " + path + " -o " + folder.file("a.exr") + " --size 48x36 --samples 1");
    ASSERT_EQ(result.exitCode, 0) << name << result.errors;
    const Image image = readImage(folder.file("a.exr"));
    double covered = 0;
    for (std::size_t i = 0; i != image.channel("A").values.size(); ++i) {
      covered += image.channel("A").values[i];
      for (const char* channel : {"R", "G", "B", "A"})
        ASSERT_TRUE(std::isfinite(image.channel(channel).values[i]));
    }
    // The automatic framing fills a fair part of the picture.
    EXPECT_GT(covered, 0.05 * 48 * 36) << name;
  }
}

TEST(RenderData, SaysThatAnEmptyVolumeMakesAnEmptyPicture) {
  const std::string path = sharedData("volumes/empty_grid.vdb");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const TemporaryFolder folder;
  const ProgramResult result = runProgram("render " + path + " -o " + folder.file("a.exr") + " --size 8x6");
  EXPECT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_NE(result.errors.find("empty"), std::string::npos);
  const Image image = readImage(folder.file("a.exr"));
  for (const float alpha : image.channel("A").values) EXPECT_EQ(alpha, 0.0f);
}

// A ball of voxels of 0.1 with something wrong in it.
std::string writeBall(const TemporaryFolder& folder, float background,
                      const std::function<void(openvdb::FloatGrid&)>& change) {
  openvdb::initialize();
  auto grid = openvdb::FloatGrid::create(background);
  auto accessor = grid->getAccessor();
  for (int z = -6; z <= 6; ++z)
    for (int y = -6; y <= 6; ++y)
      for (int x = -6; x <= 6; ++x)
        if (x * x + y * y + z * z < 36) accessor.setValue({x, y, z}, 1.0f);
  grid->setName("density");
  grid->setTransform(openvdb::math::Transform::createLinearTransform(0.1));
  change(*grid);
  openvdb::io::File file(folder.file("ball.vdb"));
  file.write({grid});
  file.close();
  return folder.file("ball.vdb");
}

TEST(RenderBadInput, IsRefusedByNameAndReason) {
  using openvdb::FloatGrid;
  const auto set = [](float value) {
    return [value](FloatGrid& grid) { grid.getAccessor().setValue({0, 0, 0}, value); };
  };
  const struct {
    float background;
    std::function<void(FloatGrid&)> change;
    std::string says;
  } cases[] = {{0, set(NAN), "holds values that are not finite"},
               {0, set(INFINITY), "holds values that are not finite"},
               {0, set(1e30f), "expected values up to 1e+18"},
               {0,
                [](FloatGrid& grid) {
                  grid.getAccessor().setValue({4000, 4000, 4000}, 1.0f);
                },
                "in a box of 4032 x 4032 x 4032 voxels, which are too few for one so large"},
               {0.5f, [](FloatGrid&) {}, "expected 0 outside of the volume, but its background is 0.5"},
               {-1, [](FloatGrid&) {}, "its background is -1"},
               {0, [](FloatGrid& grid) { grid.setGridClass(openvdb::GRID_LEVEL_SET); }, "has no surface"},
               {0,
                [](FloatGrid& grid) {
                  grid.transform().postTranslate({1e9, 0, 0});
                },
                "from the origin"},
               {0,
                [](FloatGrid& grid) {
                  grid.setTransform(openvdb::math::Transform::createFrustumTransform(
                      openvdb::BBoxd({-12, -12, -12}, {12, 12, 12}), 0.5, 2.0, 0.1));
                },
                "frustum"}};
  for (const auto& c : cases) {
    const TemporaryFolder files, folder;
    const ProgramResult result = runProgram("render " + writeBall(files, c.background, c.change) + " -o " +
                                            folder.file("a.exr") + " --size 8x6");
    EXPECT_EQ(result.exitCode, 1) << c.says;
    EXPECT_NE(result.errors.find("ball.vdb"), std::string::npos) << result.errors;
    EXPECT_NE(result.errors.find(c.says), std::string::npos) << c.says << ": " << result.errors;
    EXPECT_EQ(folder.entryCount(), 0u);
  }
}

TEST(RenderBadInput, NumbersThatGlowAreToBeFinite) {
  const TemporaryFolder folder;
  const std::string path = writeBall(folder, 0, [](openvdb::FloatGrid&) {});
  openvdb::io::File file(path);
  file.open();
  const auto grids = file.getGrids();
  file.close();
  auto heat = openvdb::FloatGrid::create(0);
  heat->setName("heat");
  heat->setTransform(openvdb::math::Transform::createLinearTransform(0.1));
  heat->tree().setValue({0, 0, 0}, INFINITY);
  grids->push_back(heat);
  file.write(*grids);
  file.close();
  const ProgramResult result =
      runProgram("render " + path + " --emission-grid heat --size 8x6 -o " + folder.file("a.exr"));
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find("holds values that are not finite"), std::string::npos) << result.errors;
}

TEST(RenderColor, FindsTheFrameAndTheSeed) {
  const TemporaryFolder folder;
  const std::string path = writeBall(folder, 0, [](openvdb::FloatGrid&) {});
  std::ofstream(folder.file("a.chan")) << "1 0 0 9 0 0 0 20\n3 0 0 9 0 0 0 20\n";
  std::ofstream(folder.file("a.felt")) << "scalarfield density = mask(sphere((0, 0, 0), 0.5), 0.1);\n"
                                          "vectorfield color = (time / 4, seed / 8.0, 1);\n";
  const std::string common = " --size 8x6 --samples 1 --extinction 40 --aov albedo --seed 4 --camera " +
                             folder.file("a.chan") + " --frame 1 -o " + folder.file("a.exr");
  for (const std::string& input : {path + " --color '=(time / 4, seed / 8.0, 1)'", folder.file("a.felt"),
                                   folder.file("a.felt --detail exact")}) {
    const ProgramResult result = runProgram("render " + input + common);
    ASSERT_EQ(result.exitCode, 0) << result.errors;
    const Image image = readImage(folder.file("a.exr"));
    const float whole = 0.99f * image.at("A", 4, 3);
    EXPECT_GT(whole, 0.5f);
    EXPECT_NEAR(image.at("albedo.R", 4, 3), 0.25f * whole, 1e-2f);
    EXPECT_NEAR(image.at("albedo.G", 4, 3), 0.5f * whole, 1e-2f);
    EXPECT_NEAR(image.at("albedo.B", 4, 3), whole, 1e-2f);
  }
  // A script declares all of this itself.
  for (const std::string option : {"--color '=(1, 1, 1)'", "--color-grid Cd", "--grid density"}) {
    const ProgramResult result = runProgram("render " + folder.file("a.felt") + " " + option + common);
    EXPECT_EQ(result.exitCode, 2) << option;
    EXPECT_NE(result.errors.find(option.substr(0, option.find(' ')) + ": is for files of volumes"),
              std::string::npos)
        << result.errors;
  }
}

TEST(RenderShapes, RefusesWhatShowsBesideAVolumeOnly) {
  const TemporaryFolder folder;
  const std::string mesh = ownData("data/sphere_uv.obj"),
                    start = "render " + mesh + " --size 8x6 --preview " + folder.file("a.png") + " ";
  const std::string file = folder.file("b.exr");
  for (const std::string& option :
       {"--holdout " + file, "--holdout-object " + mesh, "--object " + mesh, std::string("--aov Z"),
        "--write-deep-shadow " + file, std::string("--volume-motion 1,0,0 --shutter -0.25,0.25"),
        "--deep " + file}) {
    const ProgramResult result = runProgram(start + option);
    EXPECT_EQ(result.exitCode, 2) << option;
    EXPECT_NE(result.errors.find(option.substr(0, option.find(' ')) + ": needs a volume"), std::string::npos)
        << result.errors;
  }
  EXPECT_EQ(runProgram(start + "--aov none").exitCode, 0);
  EXPECT_EQ(runProgram(start + "--set x=1").exitCode, 2);
}

TEST(RenderBadInput, IsNamedBesideOtherVolumes) {
  const TemporaryFolder good, bad;
  const std::string other = writeBall(good, 0, [](openvdb::FloatGrid&) {}),
                    path = writeBall(bad, 0, [](openvdb::FloatGrid&grid) {
                      grid.getAccessor().setValue({0, 0, 0}, 1e30f);
                    });
  const ProgramResult result =
      runProgram("render " + other + " " + path + " --size 8x6 -o " + good.file("a.exr"));
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find(path + ": density: expected values up to 1e+18"), std::string::npos)
      << result.errors;
}

TEST(RenderBadInput, NothingFarAwayTakesNoMemory) {
  const TemporaryFolder folder;
  const std::string options = " --size 8x6 --samples 1 -o " + folder.file("a.exr");
  const auto rendered = [&](const std::function<void(openvdb::FloatGrid&)>& change) {
    // A table of the bricks in between would have 4 GB.
    const ProgramResult result =
        runProgram("render " + writeBall(folder, 0, change) + options, "ulimit -v 3000000;");
    EXPECT_EQ(result.exitCode, 0) << result.errors;
    return readImage(folder.file("a.exr")).channel("A").values;
  };
  const auto alone = rendered([](openvdb::FloatGrid&) {});
  EXPECT_EQ(rendered([](openvdb::FloatGrid& grid) { grid.tree().touchLeaf({8000, 8000, 8000}); }), alone);
}

TEST(RenderBadInput, TransformsAreWhatTheySay) {
  // An ellipsoid with the half axes 0.6, 1.2, 0.6, turned by 90 degrees about z: wide and low.
  const TemporaryFolder folder;
  const std::string path = writeBall(folder, 0, [](openvdb::FloatGrid& grid) {
    auto map = openvdb::math::Mat4d::identity();
    map.setToScale(openvdb::Vec3d(0.1, 0.2, 0.1));
    grid.setTransform(openvdb::math::Transform::createLinearTransform(map));
    grid.transform().postRotate(1.5707963267948966, openvdb::math::Z_AXIS);
  });
  ASSERT_EQ(runProgram("render " + path + " -o " + folder.file("a.exr") +
                       " --size 40x40 --samples 1 --view 0,0 --projection orthographic "
                       "--orthographic-width 4 --extinction 100")
                .exitCode,
            0);
  const Image image = readImage(folder.file("a.exr"));
  int across = 0, down = 0;
  for (int i = 0; i != 40; ++i) {
    across += image.at("A", i, 20) > 0.5f;
    down += image.at("A", 20, i) > 0.5f;
  }
  // 2.4 and 1.2 of 4 units in 40 pixels.
  EXPECT_NEAR(across, 24, 3);
  EXPECT_NEAR(down, 12, 2);
}

TEST(RenderBadInput, ACameraInTheCloudSeesCloud) {
  const TemporaryFolder folder;
  const std::string path = writeBall(folder, 0, [](openvdb::FloatGrid&) {});
  ASSERT_EQ(runProgram("render " + path + " -o " + folder.file("a.exr") +
                       " --size 8x6 --camera-position 0,0,0 --look-at 0,0,1 --extinction 30")
                .exitCode,
            0);
  const Image image = readImage(folder.file("a.exr"));
  for (const float alpha : image.channel("A").values) EXPECT_GT(alpha, 0.99f);
  for (const float red : image.channel("R").values) EXPECT_TRUE(std::isfinite(red) && red >= 0);
}

// A million voxels away: a table of all between would not be held.
TEST(RenderBadInput, InactiveTilesOfFogAreNothing) {
  const TemporaryFolder folder;
  const std::string path = writeBall(folder, 0, [](openvdb::FloatGrid& grid) {
    grid.setGridClass(openvdb::GRID_FOG_VOLUME);
    grid.tree().root().addTile({1 << 20, 1 << 20, 1 << 20}, 1.0f, false);
  });
  ASSERT_EQ(
      runProgram("render " + path + " -o " + folder.file("far.exr") + " --size 16x12 --samples 1").exitCode,
      0);
  writeBall(folder, 0, [](openvdb::FloatGrid&) {});
  ASSERT_EQ(
      runProgram("render " + path + " -o " + folder.file("ball.exr") + " --size 16x12 --samples 1").exitCode,
      0);
  EXPECT_EQ(readImage(folder.file("far.exr")).channel("R").values,
            readImage(folder.file("ball.exr")).channel("R").values);
}

TEST(RenderBadInput, CamerasFarAwaySeeNothing) {
  const TemporaryFolder folder;
  const std::string path = writeBall(folder, 0, [](openvdb::FloatGrid&) {});
  for (const char* camera : {"0,3e9,9 --look-at 0,3e9,0", "0,3e30,9 --look-at 0,3e30,0",
                             "0,3e38,0 --look-at 0,0,0 --up 1,0,0", "0,0,9 --look-at 3e38,0,9"}) {
    const ProgramResult result = runProgram("render " + path + " -o " + folder.file("a.exr") +
                                            " --overwrite --size 16x12 --camera-position " + camera);
    ASSERT_EQ(result.exitCode, 0) << result.errors;
    const Image image = readImage(folder.file("a.exr"));
    for (const float alpha : image.channel("A").values) EXPECT_EQ(alpha, 0.0f) << camera;
  }
}

void writeMovingBall(const std::string& path, float speed, bool hasTile) {
  openvdb::initialize();
  auto density = openvdb::FloatGrid::create(0);
  density->setName("density");
  density->fill(openvdb::CoordBBox({-6, -6, -6}, {6, 6, 6}), 1.0f);
  auto velocity = openvdb::Vec3SGrid::create(openvdb::Vec3s(0));
  velocity->setName("v");
  velocity->fill(openvdb::CoordBBox({-6, -6, -6}, {6, 6, 6}), openvdb::Vec3s(speed, 0, 0));
  if (hasTile) velocity->tree().root().addTile({1 << 20, 0, 0}, openvdb::Vec3s(speed, 0, 0), true);
  for (const openvdb::GridBase::Ptr& grid :
       {openvdb::GridBase::Ptr(density), openvdb::GridBase::Ptr(velocity)})
    grid->setTransform(openvdb::math::Transform::createLinearTransform(0.1));
  openvdb::io::File file(path);
  file.write({density, velocity});
  file.close();
}

// All of a ball goes one way, so that a bound with the wrong sign would leave out all of its trail.
TEST(RenderMotion, ANegativeScaleOfVelocitiesIsTheOtherWay) {
  const TemporaryFolder folder;
  const std::string options =
      " --velocity-grid v --shutter 0,1 --camera-position 0,0,9 --look-at 0,0,0 "
      "--size 48x16 --samples 4 --velocity-scale ";
  writeMovingBall(folder.file("there.vdb"), 2, false);
  writeMovingBall(folder.file("back.vdb"), -2, false);
  for (const auto& [name, scale] : {std::pair{"there", " -1"}, {"back", " 1"}}) {
    const ProgramResult result = runProgram("render " + folder.file(name + std::string(".vdb")) + " -o " +
                                            folder.file(name + std::string(".exr")) + options + scale);
    ASSERT_EQ(result.exitCode, 0) << result.errors;
  }
  const Image there = readImage(folder.file("there.exr")), back = readImage(folder.file("back.exr"));
  EXPECT_EQ(there.channel("A").values, back.channel("A").values);
  EXPECT_GT(*std::ranges::max_element(there.channel("A").values), 0.5f);
}

TEST(RenderMotion, VelocityTilesThatCannotBeHeldAreRefused) {
  const TemporaryFolder folder;
  writeMovingBall(folder.file("tile.vdb"), 2, true);
  const ProgramResult result =
      runProgram("advect " + folder.file("tile.vdb") + " -o " + folder.file("a.vdb") + " --velocity " +
                 folder.file("tile.vdb") + " --velocity-grid v");
  EXPECT_EQ(result.exitCode, 1) << result.errors;
  EXPECT_NE(result.errors.find("tile.vdb"), std::string::npos) << result.errors;
  EXPECT_NE(result.errors.find("more than can be held"), std::string::npos) << result.errors;
}

}  // namespace
}  // namespace nephele::test

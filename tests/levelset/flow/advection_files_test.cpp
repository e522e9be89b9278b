// Files of advection: maps, vectors, velocities.
#include "nephele/levelset/flow/advection_files.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "nephele/levelset/flow/advection.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/function_field.h"
#include "tests/support/density.h"
#include "tests/support/message_of.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace nephele::test {
namespace {

std::string volumeFile(const std::string& name) {
  return sharedData("volumes/" + name);
}

/// A slow whirl about y.
VectorField whirl() {
  return functionField([](const Vec3f& p) { return Vec3f{0.05f * p.z, 0.1f, -0.05f * p.x}; });
}

FlowMap whirledMap(const std::shared_ptr<const BrickGrid>& grid) {
  return *advectGrids({grid}, whirl(), {.steps = 4, .rebakeShare = {}}).map;
}

TEST(AdvectionFiles, KeepAMapBitForBit) {
  const TemporaryFolder folder;
  // On voxels of a size that is no power of two, turned or not.
  for (const Affine& map :
       {voxels(0.3f), Affine{Mat3f::rotation({1, 1, 0}, 0.4f) * Mat3f::scaling(0.7f), {1, 2, 3}}}) {
    const auto grid = densityGrid(map, {-5, -5, -5}, {6, 6, 6}, [](const Vec3f&) { return 1.0f; });
    const FlowMap kept = whirledMap(grid);
    writeVdbFile(folder.file("map.vdb"), toVdb(kept), {});
    const FlowMap read = readFlowMap(folder.file("map.vdb"));
    EXPECT_EQ(read.bricks, kept.bricks);
    EXPECT_EQ(read.lattice.indexToWorld.linear, kept.lattice.indexToWorld.linear);
    for (std::size_t c = 0; c < 3; ++c)
      EXPECT_EQ(read.displacement[c]->values(), kept.displacement[c]->values());
  }
}

TEST(AdvectionFiles, WriteTheRestPositionBesideTheDisplacement) {
  const auto grid = densityGrid(voxels(0.5f), {-5, -5, -5}, {6, 6, 6}, [](const Vec3f&) { return 1.0f; });
  const FlowMap map = whirledMap(grid);
  const std::vector<VdbGrid> grids = toVdb(map);
  ASSERT_EQ(grids.size(), 2u);
  EXPECT_EQ(describe(grids[0]).name, "displacement");
  EXPECT_EQ(describe(grids[1]).name, "rest");
  const auto rest = toBricks(vectorComponents(grids[1])[1]);
  const auto moved = toBricks(vectorComponents(grids[0])[1]);
  // y of voxel (2, 3, 1): its place plus the way back, 4 steps of 0.1 down.
  EXPECT_NEAR(rest->at({2, 3, 1}), 1.5f - 0.4f, 1e-4);
  EXPECT_NEAR(moved->at({2, 3, 1}), -0.4f, 1e-4);
}

TEST(AdvectionFiles, ReadAMapThatMovesNothing) {
  const TemporaryFolder folder;
  const auto grid = densityGrid(voxels(0.5f), {0, 0, 0}, {6, 6, 6}, [](const Vec3f&) { return 1.0f; });
  writeVdbFile(folder.file("map.vdb"), toVdb(*advectGrids({grid}, whirl(), {.steps = 0}).map), {});
  const FlowMap map = readFlowMap(folder.file("map.vdb"));
  EXPECT_TRUE(map.isIdentity());
  EXPECT_FLOAT_EQ(map.lattice.voxelSize, 0.5f);
}

TEST(AdvectionFiles, WriteVectorsThatReadBackAsTheyWere) {
  const auto component = [](float scale) {
    return densityGrid(voxels(0.25f), {-3, -3, -3}, {9, 9, 9},
                       [=](const Vec3f& p) { return scale * (p.x + 2 * p.y + 3 * p.z); });
  };
  const VectorGrids grids{component(1), component(-1), component(2)};
  for (const auto gridClass : {VdbGridInfo::Class::unknown, VdbGridInfo::Class::fogVolume}) {
    const VdbGrid vdb = toVdb(grids, VdbGridLabel{"Cd", gridClass, false});
    EXPECT_EQ(describe(vdb).type, "vec3s");
    const auto parts = vectorComponents(vdb);
    for (std::size_t c = 0; c < 3; ++c) {
      const auto back = toBricks(parts[c]);
      for (int z = -3; z <= 9; ++z)
        for (int y = -3; y <= 9; ++y)
          for (int x = -3; x <= 9; ++x) ASSERT_EQ(back->at({x, y, z}), grids[c]->at({x, y, z}));
    }
  }
}

TEST(AdvectionFiles, CarryAllGridsOfASimulation) {
  NEPHELE_REQUIRE_SHARED_DATA(sharedData("volumes"));
  const auto read = readVdbFile(volumeFile("blender_fluid_5_grids.vdb"));
  const CarriedGrids grids = carriedGrids(read);
  EXPECT_EQ(grids.originals.size(), 5u);
  EXPECT_EQ(grids.bricks.size(), 7u);  // four scalars, one vector
  const std::vector<VdbGrid> back = toVdb(grids, grids.bricks);
  for (std::size_t i = 0; i < back.size(); ++i) {
    const VdbGridInfo before = describe(read[i]), after = describe(back[i]);
    EXPECT_EQ(after.name, before.name);
    EXPECT_EQ(after.type, before.type);
    EXPECT_EQ(after.gridClass, before.gridClass);
    EXPECT_EQ(after.halfFloat, before.halfFloat);
    EXPECT_FLOAT_EQ(after.voxelSize.x, before.voxelSize.x);
  }
  const auto velocityOf = [](const std::vector<VdbGrid>& all) {
    return vectorComponents(*std::find_if(all.begin(), all.end(),
                                          [](const VdbGrid& g) { return describe(g).name == "velocity"; }));
  };
  const auto a = velocityOf(read), b = velocityOf(back);
  for (std::size_t c = 0; c < 3; ++c) {
    const auto before = toBricks(a[c]), after = toBricks(b[c]);
    EXPECT_LT(length(before->indexToWorld().translation - after->indexToWorld().translation), 1e-5f);
    for (int i = 0; i < 29; ++i) ASSERT_EQ(before->at({i, 14, i}), after->at({i, 14, i}));
  }
}

TEST(AdvectionFiles, LeaveOutWhatCannotBeCarriedAndSayIt) {
  NEPHELE_REQUIRE_SHARED_DATA(sharedData("volumes"));
  CarriedGrids grids = carriedGrids(readVdbFile(volumeFile("half_spot_multi_grid.vdb")));
  EXPECT_EQ(grids.originals.size(), 4u);  // colorGrid, distanceField, normalGrid, uvGrid
  std::sort(grids.leftOut.begin(), grids.leftOut.end());
  EXPECT_EQ(grids.leftOut, (std::vector<std::string>{"indexGrid (int32)", "nearestSurfacePoints0 (vec3i)",
                                                     "surfaceGrid (bool)"}));
}

TEST(AdvectionFiles, FindTheVelocity) {
  NEPHELE_REQUIRE_SHARED_DATA(sharedData("volumes"));
  // The values that the catalogue of the test data gives: 0, -15, 0 everywhere.
  const VectorField tiles = readVelocity(volumeFile("velocity_vec3_tiles.vdb"));
  const auto grid = gridsOf(tiles)[1];
  const Vec3f inside = grid->worldBox().center();
  EXPECT_EQ(tiles(inside), (Vec3f{0, -15, 0}));
  // Outside it stands still.
  EXPECT_EQ(tiles(inside + Vec3f{1000, 0, 0}), (Vec3f{0, 0, 0}));
  const VectorField fluid = readVelocity(volumeFile("blender_fluid_5_grids.vdb"));
  EXPECT_GT(length(fluid(gridsOf(fluid)[0]->worldBox().center())), 0);
}

TEST(AdvectionFiles, SayWhatIsThereInsteadOfAVelocityOrAMap) {
  NEPHELE_REQUIRE_SHARED_DATA(sharedData("volumes"));
  const std::string fog = volumeFile("smoke_fog.vdb"), fluid = volumeFile("blender_fluid_5_grids.vdb");
  std::string message = messageOf([&] { readVelocity(fog); });
  EXPECT_NE(message.find("smoke_fog.vdb: no velocity"), std::string::npos) << message;
  EXPECT_NE(message.find("'density' (float)"), std::string::npos) << message;
  message = messageOf([&] { readVelocity(fluid, "density"); });
  EXPECT_NE(message.find("'density' holds float"), std::string::npos) << message;
  message = messageOf([&] { readVelocity(fluid, "wind"); });
  EXPECT_NE(message.find("'wind'"), std::string::npos) << message;
  EXPECT_NE(message.find("'velocity' (vec3s)"), std::string::npos) << message;
  // Three grids of vectors, none of the usual names.
  message = messageOf([&] { readVelocity(volumeFile("half_spot_multi_grid.vdb")); });
  EXPECT_NE(message.find("several grids of vectors"), std::string::npos) << message;
  message = messageOf([&] { readFlowMap(fluid); });
  EXPECT_NE(message.find("no map of a flow"), std::string::npos) << message;
  EXPECT_NE(message.find("'velocity' (vec3s)"), std::string::npos) << message;
  message = messageOf([&] { readVelocity("/nowhere/wind.vdb"); });
  EXPECT_NE(message.find("/nowhere/wind.vdb: no such file"), std::string::npos) << message;
}

}  // namespace
}  // namespace nephele::test

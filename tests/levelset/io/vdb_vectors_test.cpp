#include <gtest/gtest.h>

#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/error.h"
#include "tests/support/test_data.h"

namespace nephele::test {
namespace {

TEST(VdbVectors, AreReadAsThreeGrids) {
  const std::string path = sharedData("volumes/sphere_colour_vec3.vdb");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  // Every active voxel holds its own place, so (1.2, 0.4, 0.2) at (12, 4, 2); the background is 1.
  const auto parts = readVectorGrid(path, "Cd");
  for (int c = 0; c != 3; ++c) {
    const VdbGridInfo info = describe(parts[std::size_t(c)]);
    EXPECT_EQ(info.activeVoxels, 9047u);
    EXPECT_FLOAT_EQ(info.background, 1.0f);
    const auto bricks = toBricks(parts[std::size_t(c)]);
    EXPECT_EQ(bricks->background(), 1.0f);
    const Vec3i voxel{-3, 7, 5};
    EXPECT_NEAR(bricks->at(voxel), 0.1f * float(voxel[c]), 1e-6f);
    EXPECT_NEAR(bricks->at({12, 4, 2}), c == 0 ? 1.2f : c == 1 ? 0.4f : 0.2f, 1e-6f);
  }
}

TEST(VdbVectors, OfStaggeredGridsStandOnTheFaces) {
  const std::string path = sharedData("volumes/blender_fluid_5_grids.vdb");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const auto density = toBricks(readScalarGrid(path, "density"));
  const auto parts = readVectorGrid(path, "velocity");
  for (int axis = 0; axis != 3; ++axis) {
    const auto bricks = toBricks(parts[std::size_t(axis)]);
    Vec3f shift{};
    shift[axis] = -0.5f;
    const Vec3f expected = density->indexToWorld()(shift);
    for (int c = 0; c != 3; ++c)
      EXPECT_NEAR(bricks->indexToWorld()({0, 0, 0})[c], expected[c], 1e-5f) << axis;
  }
}

TEST(VdbVectors, KeepTiles) {
  const std::string path = sharedData("volumes/velocity_vec3_tiles.vdb");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  // (0, -15, 0) in all of 100^3 voxels.
  const auto parts = readVectorGrid(path, "vel");
  EXPECT_EQ(describe(parts[1]).activeVoxels, 1000000u);
  EXPECT_EQ(valueRange(parts[1]).min, -15.0f);
  EXPECT_EQ(valueRange(parts[1]).max, -15.0f);
  EXPECT_LT(describe(parts[1]).memoryBytes, 8u << 20);
}

TEST(VdbVectors, RefusesWhatHoldsNone) {
  const std::string path = sharedData("volumes/blender_fluid_5_grids.vdb");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  EXPECT_THROW(readVectorGrid(path, "density"), Error);
  EXPECT_THROW(readVectorGrid(path, "v"), Error);
  EXPECT_THROW(readVectorGrid(path + ".missing", "v"), Error);
}

}  // namespace
}  // namespace nephele::test

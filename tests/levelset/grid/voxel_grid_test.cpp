#include "nephele/levelset/grid/voxel_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "nephele/levelset/grid/narrow_band.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/error.h"
#include "tests/support/brick_grids.h"

namespace nephele {
namespace {

using test::scatter;

/// Bricks at x = 0 with samples and at x = 1 with the constant 2; 0.5 elsewhere.
VoxelGrid<float> twoBricks() {
  VoxelGrid<float> grid("test", 0.25, 0.5f);
  float* samples = grid.add({0, 0, 0});
  for (int i = 0; i < kBrickSamples; ++i) samples[i] = scatter({i & 7, i >> 3 & 7, i >> 6});
  grid.setConstant({1, 0, 0}, 2.0f);
  return grid;
}

TEST(VoxelGrid, HoldsSamplesConstantsAndTheBackground) {
  const VoxelGrid<float> grid = twoBricks();
  EXPECT_EQ(grid.at({3, 4, 5}), scatter({3, 4, 5}));
  EXPECT_EQ(grid.at({8, 7, 0}), 2.0f);
  EXPECT_EQ(grid.at({-1, 0, 0}), 0.5f);
  EXPECT_EQ(grid.at({1 << 20, 0, 0}), 0.5f);
  EXPECT_EQ(grid.sampledBricks(), 1u);
  int visited = 0;
  grid.forEachBrick([&](const Vec3i& brick, std::int32_t entry) {
    ++visited;
    EXPECT_EQ(entry, brick.x == 0 ? 0 : -2);
  });
  EXPECT_EQ(visited, 2);
}

TEST(VoxelGrid, BrickThatBecomesConstantForgetsItsSamples) {
  VoxelGrid<float> grid = twoBricks();
  grid.setConstant({0, 0, 0}, 0.5f);
  EXPECT_EQ(grid.at({3, 4, 5}), 0.5f);
  EXPECT_EQ(toBricks(grid)->at({3, 4, 5}), 0.5f);
  // Its place is still held, but must not be written.
  EXPECT_EQ(describe(toVdb(std::move(grid), {"a"})).activeVoxels, 512u);
}

TEST(NarrowBand, HoldsEveryBitInLessMemory) {
  constexpr float kEnd = 0.25f;
  VoxelGrid<float> grid("test", 0.5, -kEnd), same("test", 0.5, -kEnd);
  // The same, taken over while it is made.
  NarrowBand grown(VoxelGrid<float>("test", 0.5, -kEnd), -kEnd, kEnd);
  for (VoxelGrid<float>* g : {&grid, &same, &grown.unfinished()}) g->setConstant({-3, 0, 1}, kEnd);
  for (int b = 0; b < 1100; ++b) {
    const Vec3i brick{b % 11 - 5, b / 11 % 10, b / 110 + 4};
    float* values = grid.add(brick);
    for (int i = 0; i < kBrickSamples; ++i)
      values[i] = std::clamp(0.2f * (scatter({i, b, 0}) - 3), -kEnd, kEnd);
    // What is not between the ends, or is nearly one of them.
    values[3] = 7;
    values[4] = -0.0f;
    values[5] = std::nextafter(kEnd, 0.0f);
    std::copy_n(values, kBrickSamples, same.add(brick));
    std::copy_n(values, kBrickSamples, grown.unfinished().add(brick));
    if (b % 100 == 0) grown.takeOver(false);
  }
  grown.takeOver(true);
  const std::size_t before = same.memoryBytes();
  const NarrowBand band(std::move(grid), -kEnd, kEnd);
  // A quarter of the values lie between; two bits for each, and the table, are the rest.
  EXPECT_LT(band.memoryBytes(), before / 2);
  EXPECT_LT(grown.memoryBytes(), before / 2);
  EXPECT_EQ(band.background(), -kEnd);
  EXPECT_EQ(band.voxelSize(), 0.5);
  const VoxelGrid<float> back = band.voxels();
  int bricks = 0, equal = 0;
  same.forEachBrick([&](const Vec3i& brick, std::int32_t entry) {
    ++bricks;
    std::array<float, kBrickSamples> read, readGrown;
    band.read(band.entryAt(brick), read.data());
    grown.read(grown.entryAt(brick), readGrown.data());
    EXPECT_EQ(std::memcmp(read.data(), readGrown.data(), sizeof read), 0);
    if (entry < 0) {
      EXPECT_EQ(read[17], kEnd);
      EXPECT_LT(back.entryAt(brick), 0);
      return;
    }
    const auto holds = [&](const float* values) {
      return std::memcmp(values, same.samples(entry), sizeof read) == 0;
    };
    equal += holds(read.data()) && holds(back.samples(back.entryAt(brick)));
  });
  EXPECT_EQ(bricks, 1101);
  EXPECT_EQ(equal, 1100);
}

TEST(VoxelGrid, BricksReadTheirNeighboursWhereTheyVary) {
  const VoxelGrid<float> grid = twoBricks();
  for (const Beside beside : {Beside::varying, Beside::constant}) {
    const auto bricks = toBricks(grid, beside);
    for (int z = -9; z < 17; ++z)
      for (int y = -9; y < 17; ++y)
        for (int x = -9; x < 17; ++x) ASSERT_EQ(bricks->at({x, y, z}), grid.at({x, y, z}));
    const float* own = bricks->brick(bricks->poolIndex({0, 0, 0}));
    EXPECT_EQ(own[sampleOffset(8, 3, 3)], 2.0f);
    EXPECT_EQ(own[sampleOffset(-1, 3, 3)], 0.5f);
    // The constant brick beside it, and the background before it.
    const float* after = bricks->brick(bricks->poolIndex({1, 0, 0}));
    EXPECT_EQ(after[sampleOffset(-1, 3, 3)], beside == Beside::varying ? scatter({7, 3, 3}) : 2.0f);
    const float* before = bricks->brick(bricks->poolIndex({-1, 0, 0}));
    EXPECT_EQ(before[sampleOffset(9, 3, 3)], beside == Beside::varying ? scatter({1, 3, 3}) : 0.5f);
    EXPECT_EQ(bricks->voxelSize(), 0.25f);
  }
}

TEST(VoxelGrid, ComesBackFromOpenVdb) {
  const VoxelGrid<float> grid = twoBricks();
  const auto back = toBricks(toVdb(twoBricks(), {"a"}));
  for (int z = -2; z < 10; ++z)
    for (int y = -2; y < 10; ++y)
      for (int x = -2; x < 18; ++x) ASSERT_EQ(back->at({x, y, z}), grid.at({x, y, z}));

  VoxelGrid<Vec3f> vectors("test", 0.25, Vec3f{});
  Vec3f* samples = vectors.add({-1, 2, 0});
  for (int i = 0; i < kBrickSamples; ++i) samples[i] = Vec3f{1, 2, 3} * float(i);
  const VdbGrid file = toVdb(std::move(vectors), {.name = "v"});
  EXPECT_EQ(describe(file).activeVoxels, 512u);
  EXPECT_EQ(toVectorVoxels(file).at({-8 + 3, 16 + 4, 5}), (Vec3f{1, 2, 3} * float(3 + 8 * 4 + 64 * 5)));
}

TEST(VoxelGrid, LevelSetsTurnAndAreClampedToTheirBand) {
  VoxelGrid<float> grid("test", 0.25, -0.75f);
  float* samples = grid.add({0, 0, 0});
  for (int i = 0; i < kBrickSamples; ++i) samples[i] = 0.2f * float((i & 7) - 4);
  const VdbGrid file = toVdb(std::move(grid), {"surface", VdbGridInfo::Class::levelSet});
  const VdbGridInfo info = describe(file);
  EXPECT_FLOAT_EQ(info.background, 0.75f);
  EXPECT_FLOAT_EQ(valueRange(file).min, -0.6f);
  // x = 0 is 0.8 outside, beyond the band.
  EXPECT_EQ(info.activeVoxels, 7u * 64u);
  EXPECT_THROW(toVdb(twoBricks(), {"surface", VdbGridInfo::Class::levelSet}), Error);
  EXPECT_THROW(toVdb(twoBricks(), {"density", VdbGridInfo::Class::fogVolume}), Error);
}

TEST(VoxelGrid, RefusesWhatIsNotFiniteOrTooFarApart) {
  VoxelGrid<float> grid = twoBricks();
  grid.setConstant({5, 5, 5}, std::numeric_limits<float>::infinity());
  EXPECT_THROW(toBricks(grid), Error);
  EXPECT_THROW(toVdb(std::move(grid), {"a"}), Error);
  VoxelGrid<float> wide = twoBricks();
  EXPECT_THROW(wide.setConstant({1 << 27, 1 << 27, 1 << 27}, 1.0f), Error);
}

}  // namespace
}  // namespace nephele

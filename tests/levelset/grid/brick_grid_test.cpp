#include "nephele/levelset/grid/brick_grid.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <utility>

#include "nephele/levelset/grid/brick_ranges.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/error.h"
#include "tests/support/brick_grids.h"

namespace nephele {
namespace {

using test::denseGrid;
using test::scatter;

TEST(BrickGrid, ReturnsItsSamplesAndTheBackgroundOutside) {
  const auto grid = denseGrid({-1, 0, 2}, {2, 1, 1}, scatter, {}, 7.0f);
  for (int x = -8; x < 8; ++x) EXPECT_EQ(grid->at({x, 3, 20}), scatter({x, 3, 20}));
  for (const Vec3i& v : {Vec3i{-9, 0, 16}, Vec3i{8, 0, 16}, Vec3i{0, -1, 16}, Vec3i{0, 8, 16},
                         Vec3i{0, 0, 15}, Vec3i{0, 0, 24}})
    EXPECT_EQ(grid->at(v), 7.0f);
}

TEST(BrickGrid, BordersHoldTheSamplesOfAllNeighbours) {
  const auto grid = denseGrid({-1, -1, 0}, {3, 2, 2}, scatter, {}, 7.0f);
  for (const PlacedBrick& placed : placedBricks(*grid))
    for (int z = -1; z <= 9; ++z)
      for (int y = -1; y <= 9; ++y)
        for (int x = -1; x <= 9; ++x)
          ASSERT_EQ(grid->brick(placed.pool)[sampleOffset(x, y, z)],
                    grid->at(placed.brick * 8 + Vec3i{x, y, z}));
}

TEST(BrickGrid, RangesHoldEveryStoredSample) {
  const auto grid = denseGrid(
      {0, 0, 0}, {2, 1, 1}, [](const Vec3i& v) { return v.x + 100 * v.z; }, {}, -3.0f);
  // Brick 2 owns x = 8 to 15, z = 0 to 7, and its border holds the background.
  EXPECT_EQ(grid->ranges()[2], (Interval{-3.0f, 15.0f + 700.0f}));
  EXPECT_EQ(grid->ranges()[0], Interval::of(-3.0f));
}

TEST(BrickGrid, RangeOfABrickWithoutFiniteValuesIsEverything) {
  std::vector<float> samples(BrickGrid::kVolume, 1.0f);
  EXPECT_EQ(rangeOfBrick(samples.data()), Interval::of(1.0f));
  for (const std::size_t where : {0, 700, 1330})
    for (const float v : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                          -std::numeric_limits<float>::infinity()}) {
      samples[where] = v;
      EXPECT_EQ(rangeOfBrick(samples.data()), Interval::everything()) << where << " " << v;
      samples[where] = 1.0f;
    }
}

TEST(BrickGrid, SharedBricksAreNotPlacedAndKeepTheirSamples) {
  auto grid = denseGrid({0, 0, 0}, {4, 1, 1}, scatter);
  // Position 0 is background, 1 and 2 share brick 2, 3 has its own.
  grid->setTable({0, 2, 2, 4});
  std::fill_n(grid->brick(2), BrickGrid::kVolume, 5.0f);
  fillBorders(*grid);
  const auto placed = placedBricks(*grid);
  ASSERT_EQ(placed.size(), 1u);
  EXPECT_EQ(placed[0].pool, 4);
  EXPECT_EQ(placed[0].brick, (Vec3i{3, 0, 0}));
  EXPECT_EQ(grid->ranges()[2], Interval::of(5.0f));
  EXPECT_EQ(grid->brick(4)[sampleOffset(-1, 0, 0)], 5.0f);
}

TEST(BrickGrid, CountsActiveVoxelsStrictlyInsideTheBand) {
  auto grid = denseGrid({0, 0, 0}, {2, 1, 1}, [](const Vec3i& v) { return v.x; });
  // x = 3 to 11 lie strictly between 2 and 12; each stands for 8 x 8 voxels.
  EXPECT_EQ(activeVoxelCount(*grid, {2.0f, 12.0f}), 9u * 64u);
  grid->setTable({1, 1});
  EXPECT_EQ(activeVoxelCount(*grid, {2.0f, 12.0f}), 2u * 5u * 64u);
}

TEST(BrickGrid, KnowsItsBoxAndSize) {
  const auto grid = denseGrid({-1, 0, 0}, {2, 3, 1}, scatter, {Mat3f::scaling(0.5f), {1, 2, 3}});
  EXPECT_EQ(grid->worldBox(), (Box{{-3, 2, 3}, {5, 14, 7}}));
  EXPECT_GE(grid->memoryBytes(), 7u * BrickGrid::kVolume * sizeof(float));
  EXPECT_TRUE(BrickGrid{}.worldBox().isEmpty());
}

TEST(BrickGrid, PackingKeepsSamplesWithinHalfACode) {
  const auto grid = denseGrid({-1, 0, 2}, {2, 2, 2}, scatter, {}, 7.0f);
  const PackedGrid packed(*grid);
  EXPECT_LT(packed.memoryBytes(), 0.25 * double(grid->memoryBytes()));
  EXPECT_EQ(packed.ranges(), grid->ranges());
  for (int z = 16; z < 32; ++z)
    for (int y = 0; y < 16; ++y)
      for (int x = -8; x < 8; ++x) {
        const Interval range = grid->ranges()[std::size_t(grid->poolIndex(brickOf(Vec3i{x, y, z})))];
        ASSERT_NEAR(packed.at({x, y, z}), grid->at({x, y, z}), (range.max - range.min) / 131070.0f + 1e-6f);
      }
  EXPECT_EQ(packed.at({100, 0, 0}), 7.0f);
}

TEST(BrickGrid, PackedBricksAreAssembledWithTheBordersOfTheirNeighbours) {
  const auto grid = denseGrid({-1, 0, 2}, {2, 2, 2}, scatter, {}, 7.0f);
  const PackedGrid packed(*grid);
  std::array<float, BrickGrid::kVolume> brick, cell;
  for (std::size_t place = 0; place < packed.table().size(); ++place) {
    packed.assemble(place, brick.data());
    const Vec3i first = packed.places().at(place) * BrickGrid::kBrick;
    for (int z = -1; z < 10; ++z)
      for (int y = -1; y < 10; ++y)
        for (int x = -1; x < 10; ++x)
          ASSERT_EQ(brick[std::size_t(sampleOffset(x, y, z))], packed.at(first + Vec3i{x, y, z}));
    // Every cell alone: all of it, its middle, and its corner.
    for (const auto& [begin, count] : {std::pair{0, 4}, {1, 2}, {1, 1}})
      for (int corner = 0; corner < kBrickSamples; ++corner) {
        const int offset = sampleOffset((corner & 7) - 1, (corner >> 3 & 7) - 1, (corner >> 6) - 1);
        cell.fill(-99);
        packed.assembleCell(place, offset, begin, count, cell.data());
        for (int z = begin; z < begin + count; ++z)
          for (int y = begin; y < begin + count; ++y)
            for (int x = begin; x < begin + count; ++x) {
              const int at = (z * BrickGrid::kWidth + y) * BrickGrid::kWidth + x;
              ASSERT_EQ(cell[std::size_t(at)], brick[std::size_t(offset + at)]);
            }
      }
  }
}

TEST(BrickGrid, PackedBricksWithoutSignsAreSeenWithThemByTheirNeighbours) {
  // -1 and 1 by turns, in two bricks side by side.
  std::array<float, kBrickSamples> samples;
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = i % 2 == 0 ? -1.0f : 1.0f;
  PackedGrid grid({}, {{0, 0, 0}, {2, 1, 1}}, 0.0f);
  grid.append(2);
  for (const std::int32_t pool : {1, 2}) {
    grid.encode(pool, samples.data(), {-1, 1}, pool == 2);
    grid.place({pool - 1, 0, 0}, pool);
  }
  std::array<float, BrickGrid::kVolume> signs, signless;
  grid.assemble(0, signs.data());
  grid.assemble(1, signless.data());
  EXPECT_NEAR(signs[std::size_t(sampleOffset(0, 3, 3))], -1, 1e-6);
  EXPECT_NEAR(signs[std::size_t(sampleOffset(8, 3, 3))], -1, 1e-6);
  EXPECT_NEAR(signless[std::size_t(sampleOffset(0, 3, 3))], 1, 1e-6);
  EXPECT_NEAR(signless[std::size_t(sampleOffset(-1, 3, 3))], 1, 1e-6);
  EXPECT_NEAR(signless[std::size_t(sampleOffset(-1, 3, 4))], 1, 1e-6);
}

TEST(BrickGrid, RefusesTablesThatDoNotFit) {
  BrickGrid grid({}, {{0, 0, 0}, {2, 1, 1}});
  grid.append(1);
  for (const std::vector<std::int32_t>& table : {std::vector{0}, {0, 1, 0}, {0, 2}, {-1, 0}})
    EXPECT_THROW(grid.setTable(table), Error);
  grid.setTable({1, 0});
  EXPECT_EQ(grid.poolIndex({0, 0, 0}), 1);
  EXPECT_THROW(BrickGrid({{}, {}, 0.0f}, {{}, {1, 1, 1}}), Error);
  EXPECT_THROW(BrickGrid({}, {{}, {1 << 11, 1 << 11, 1 << 11}}), Error);
  EXPECT_THROW(BrickGrid({}, {{}, {1, -1, 1}}), Error);
}

TEST(BrickGrid, MultipliesSamplesRangesAndBackground) {
  auto grid = denseGrid(
      {0, 0, 0}, {1, 1, 1}, [](const Vec3i& v) { return float(v.x); }, {}, 3.0f);
  grid->multiply(-2.0f);
  EXPECT_EQ(grid->at({3, 0, 0}), -6.0f);
  EXPECT_EQ(grid->at({9, 0, 0}), -6.0f);
  EXPECT_EQ(grid->ranges()[1], (Interval{-14, 0}));
}

TEST(BrickGrid, PackingKeepsConstantsExactlyAndRefusesWhatIsNotFinite) {
  auto grid = denseGrid(
      {0, 0, 0}, {1, 1, 1}, [](const Vec3i&) { return 0.1f; }, {}, 0.1f);
  const PackedGrid packed(*grid);
  EXPECT_EQ(packed.at({3, 4, 5}), 0.1f);
  grid->brick(1)[sampleOffset(3, 4, 5)] = std::numeric_limits<float>::infinity();
  fillBorders(*grid);
  EXPECT_THROW(PackedGrid{*grid}, Error);
}

TEST(BrickRanges, AreExactForSmallRegionsAndContainLargeOnes) {
  const Vec3i first{-3, 1, 0}, count{11, 6, 5};
  const auto grid = denseGrid(first, count, scatter, {}, 0.25f);
  const BrickRanges ranges(*grid);
  std::mt19937 random(3);
  for (int trial = 0; trial < 2000; ++trial) {
    Vec3i low, high;
    for (int a = 0; a < 3; ++a) {
      low[a] = first[a] + int(random() % unsigned(count[a]));
      high[a] = low[a] + int(random() % unsigned(first[a] + count[a] - low[a]));
    }
    Interval hull = grid->ranges()[std::size_t(grid->poolIndex(low))];
    for (int z = low.z; z <= high.z; ++z)
      for (int y = low.y; y <= high.y; ++y)
        for (int x = low.x; x <= high.x; ++x)
          hull = hull.hull(grid->ranges()[std::size_t(grid->poolIndex({x, y, z}))]);
    const Interval found = ranges.over(low, high);
    ASSERT_TRUE(found.contains(hull));
    if (high.x - low.x < 4 && high.y - low.y < 4 && high.z - low.z < 4) {
      ASSERT_EQ(found, hull);
    }
  }
}

TEST(BrickRanges, IncludeTheBackgroundOutsideTheTable) {
  const auto grid = denseGrid(
      {0, 0, 0}, {2, 2, 2}, [](const Vec3i&) { return 1; }, {}, 9.0f);
  const BrickRanges ranges(*grid);
  EXPECT_EQ(ranges.over({5, 5, 5}, {6, 6, 6}), Interval::of(9.0f));
  EXPECT_EQ(ranges.over({-1, 0, 0}, {0, 0, 0}), (Interval{1.0f, 9.0f}));
  constexpr int kFar = 1 << 30;
  EXPECT_EQ(ranges.over({-kFar, -kFar, -kFar}, {kFar, kFar, kFar}), (Interval{1.0f, 9.0f}));
}

}  // namespace
}  // namespace nephele

#include "nephele/render/volume/coded_bricks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/render/volume/coded_density.h"
#include "nephele/render/volume/render_volume.h"
#include "tests/support/density.h"
#include "tests/support/each_target.h"

namespace nephele {
namespace {

constexpr int kWidth = CodedBricks::kWidth;

std::size_t nodeOf(const Vec3i& node) {
  return std::size_t((node.z * kWidth + node.y) * kWidth + node.x);
}

template <class Check>
void forEachNode(Check&& check) {
  for (int z = 0; z != kWidth; ++z)
    for (int y = 0; y != kWidth; ++y)
      for (int x = 0; x != kWidth; ++x) check(Vec3i{x, y, z});
}

// One brick of `value` at its nodes.
template <class Value>
detail::UnsetVector<float> brickOf(Value&& value) {
  detail::UnsetVector<float> nodes(CodedBricks::kNodes);
  forEachNode([&](const Vec3i& node) { nodes[nodeOf(node)] = value(node); });
  return nodes;
}

constexpr std::int32_t kOne[] = {0};

TEST(CodedBricks, AreHalfAUnitOffAtMost) {
  // A unit is 1 / 57343 of the brick's largest value.
  for (const float scale : {1e-20f, 0.01f, 1.0f, 3e5f}) {
    const detail::UnsetVector<float> nodes = brickOf([&](const Vec3i& n) {
      return scale * std::fabs(std::sin(float(7 * n.x + 3 * n.y) + 0.3f * float(n.z)));
    });
    const float most = *std::max_element(nodes.begin(), nodes.end());
    test::forEachTarget([&] {
      const CodedBricks coded(nodes, kOne);
      forEachNode([&](const Vec3i& node) {
        // The quotient and the product are rounded, too.
        ASSERT_NEAR(coded.at(0, node), nodes[nodeOf(node)], most * (0.5f / 57343 + 2e-7f));
      });
    });
  }
}

TEST(CodedBricks, KeepZerosAndBricksOfOneValue) {
  const CodedBricks mixed(brickOf([](const Vec3i& n) { return n.x < 4 ? 0.0f : 0.7f * float(n.y) - 2; }),
                          kOne);
  forEachNode([&](const Vec3i& node) {
    if (node.x < 4) {
      ASSERT_EQ(mixed.at(0, node), 0.0f);
    }
  });
  for (const float value : {0.0f, 0.3f, 1.0f, 123.4f}) {
    const CodedBricks constant(brickOf([&](const Vec3i&) { return value; }), kOne);
    forEachNode([&](const Vec3i& node) { ASSERT_FLOAT_EQ(constant.at(0, node), value); });
  }
}

TEST(CodedBricks, CoarsenWhereMuchIsBelowZero) {
  // Down to -1 / 7 of the largest value at no loss; where more is below 0, 8192 units reach there.
  const CodedBricks coded(brickOf([](const Vec3i& n) { return n.x == 0 ? -4.0f : float(n.z) / 8; }), kOne);
  forEachNode([&](const Vec3i& node) {
    ASSERT_NEAR(coded.at(0, node), node.x == 0 ? -4.0f : float(node.z) / 8, 0.51f * 4 / 8192);
  });
}

TEST(CodedBricks, StayFiniteWhateverTheyHold) {
  const float huge = std::numeric_limits<float>::max(), infinite = std::numeric_limits<float>::infinity();
  test::forEachTarget([&] {
    for (const float value : {huge, infinite}) {
      const CodedBricks coded(brickOf([&](const Vec3i& n) { return n.x == 3 ? value : 1.0f; }), kOne);
      EXPECT_NEAR(coded.at(0, {3, 0, 0}), 1e30f, 1e25f);
      EXPECT_EQ(coded.at(0, {2, 0, 0}), 0.0f);
    }
    const CodedBricks tiny(brickOf([](const Vec3i&) { return 1e-38f; }), kOne);
    EXPECT_EQ(tiny.at(0, {1, 2, 3}), 0.0f);
  });
}

TEST(CodedBricks, AreTheSameByAllInstructionsAndOfNodesSideBySide) {
  const auto grid = test::densityGrid(test::voxels(0.1f), {-20, -20, -20}, {20, 20, 20}, [](const Vec3f& p) {
    return std::sin(3 * p.x) * std::cos(4 * p.y) + std::sin(5 * p.z);
  });
  const CodedBricks expected(*grid);
  // The same nodes, brick by brick.
  detail::UnsetVector<float> nodes;
  for (std::size_t pool = 0; pool != grid->poolSize(); ++pool)
    for (int z = 0; z != kWidth; ++z)
      for (int y = 0; y != kWidth; ++y) {
        const float* row = grid->brick(std::int32_t(pool)) + sampleOffset(0, y, z);
        nodes.insert(nodes.end(), row, row + kWidth);
      }
  test::forEachTarget([&] {
    const CodedBricks coded(*grid), sideBySide(nodes, grid->table());
    for (std::size_t place = 0; place != grid->table().size(); ++place) {
      ASSERT_EQ(coded.entries()[place].first, expected.entries()[place].first);
      ASSERT_EQ(coded.entries()[place].unit, expected.entries()[place].unit);
      ASSERT_EQ(sideBySide.entries()[place].unit, expected.entries()[place].unit);
      const std::int16_t* codes = expected.codes() + expected.entries()[place].first;
      const std::size_t bytes = CodedBricks::kCodes * sizeof(std::int16_t);
      ASSERT_EQ(std::memcmp(coded.codes() + coded.entries()[place].first, codes, bytes), 0);
      ASSERT_EQ(std::memcmp(sideBySide.codes() + sideBySide.entries()[place].first, codes, bytes), 0);
    }
  });
  EXPECT_EQ(double(expected.memoryBytes()),
            CodedBricks::estimateBytes(double(grid->poolSize()), double(grid->table().size())));
}

TEST(CodedBricks, TakeTheMemoryOfSamplesThatAreGivenUp) {
  const auto grid = test::ball(1, 0.02f);
  const auto layout = grid->table();
  RenderVolume kept(grid), given(std::make_shared<BrickGrid>(*grid));
  given.giveUpSamples();
  const CodedBricks &all = kept.coded(), &same = given.coded();
  for (std::size_t place = 0; place < layout.size(); place += 7)
    for (const Vec3i& node : {Vec3i{0, 0, 0}, Vec3i{3, 8, 5}, Vec3i{8, 8, 8}})
      ASSERT_EQ(all.at(place, node), same.at(place, node)) << place;
  EXPECT_EQ(given.density().table(), layout);
  // Whole pages of them.
  const auto zeros = std::ranges::count(given.density().values(), 0.0f);
  EXPECT_GT(double(zeros), 0.9 * double(given.density().values().size()));
  EXPECT_EQ(kept.density().values(), grid->values());
  // A grid that another volume marches, too, stays as it is.
  RenderVolume shared(grid);
  shared.giveUpSamples();
  shared.coded();
  EXPECT_EQ(shared.density().values(), grid->values());
}

// A fog as it comes from a file, of many parts: bumps between constant bricks.
VdbGrid fog() {
  const auto grid =
      test::densityGrid(test::voxels(0.1f), {-150, -60, -60}, {150, 60, 60}, [](const Vec3f& p) {
        return std::clamp(1.5f + std::sin(2 * p.x) * std::cos(3 * p.y) - 0.05f * dot(p, p), 0.0f, 1.0f);
      });
  return toVdb(*grid, {"density", VdbGridInfo::Class::fogVolume});
}

TEST(CodedDensity, IsGivenTheSamplesOfEveryBrickOnce) {
  const VdbGrid vdb = fog();
  const auto whole = toBricks(vdb);
  std::vector<std::atomic<int>> times(whole->poolSize());
  std::atomic<int> other = 0;
  const auto told =
      toBricks(vdb, {[&](std::size_t bricks, std::size_t places) {
                       EXPECT_EQ(bricks, whole->poolSize());
                       EXPECT_EQ(places, whole->table().size());
                     },
                     [&](std::int32_t pool, const float* samples) {
                       ++times[std::size_t(pool)];
                       other += !std::equal(samples, samples + BrickGrid::kVolume, whole->brick(pool));
                     }});
  EXPECT_TRUE(std::ranges::all_of(times, [](int count) { return count == 1; }));
  EXPECT_EQ(other, 0);
  EXPECT_EQ(told->table(), whole->table());
  EXPECT_EQ(told->ranges(), whole->ranges());
}

TEST(CodedDensity, KnowsWhatTheSamplesTell) {
  const VdbGrid vdb = fog();
  const RenderVolume all(toBricks(vdb));
  CodedDensity coded;
  const auto grid = toBricks(vdb, coded.sink());
  const RenderVolume volume(grid, std::move(coded));
  EXPECT_FALSE(volume.hasSamples());
  EXPECT_LT(volume.memoryBytes(), all.memoryBytes() - all.density().values().size() * 3);
  EXPECT_EQ(volume.typicalDensity(), all.typicalDensity());
  EXPECT_EQ(volume.outline(), all.outline());
  EXPECT_EQ(volume.worldBounds().min, all.worldBounds().min);
  EXPECT_EQ(volume.worldBounds().max, all.worldBounds().max);
  for (std::size_t place = 0; place < grid->table().size(); place += 3)
    for (const Vec3i& node : {Vec3i{0, 0, 0}, Vec3i{3, 8, 5}, Vec3i{8, 8, 8}})
      ASSERT_EQ(volume.coded().at(place, node), all.coded().at(place, node)) << place;
}

TEST(BrickMeasures, FindWhereAnythingIs) {
  std::vector<float> brick(BrickGrid::kVolume, -1.0f);
  EXPECT_GT(BrickMeasures::of(brick.data()).first[0], BrickMeasures::of(brick.data()).last[0]);
  // Beside the nodes 0 to 8 nothing counts.
  brick[std::size_t(sampleOffset(-1, 3, 3))] = brick[std::size_t(sampleOffset(4, 9, 2))] = 5;
  EXPECT_GT(BrickMeasures::of(brick.data()).first[1], BrickMeasures::of(brick.data()).last[1]);
  // Of these three, two are among its own voxels.
  brick[std::size_t(sampleOffset(0, 5, 7))] = 0.5f;
  brick[std::size_t(sampleOffset(2, 4, 7))] = 2;
  brick[std::size_t(sampleOffset(1, 4, 8))] = 1;
  const BrickMeasures found = BrickMeasures::of(brick.data());
  EXPECT_EQ(found.first, (std::array<std::int8_t, 3>{0, 4, 7}));
  EXPECT_EQ(found.last, (std::array<std::int8_t, 3>{2, 5, 8}));
  EXPECT_EQ(found.density, 2.5);
  EXPECT_EQ(found.squares, 4.25);
}

}  // namespace
}  // namespace nephele

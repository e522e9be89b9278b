#include "nephele/levelset/grid/bake.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cstring>
#include <limits>

#include "nephele/levelset/grid/grid_field.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/operations.h"
#include "tests/support/brick_grids.h"

namespace nephele {
namespace {

using test::ball;
using test::countedBall;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

Box cube(float half) {
  return {{-half, -half, -half}, {half, half, half}};
}

/// Calls body(voxel) for the voxels of the box [-last, last]^3.
template <class Body>
void forVoxels(int last, const Body& body) {
  for (int z = -last; z <= last; ++z)
    for (int y = -last; y <= last; ++y)
      for (int x = -last; x <= last; ++x) body(Vec3i{x, y, z});
}

bool same(const BrickGrid& a, const BrickGrid& b) {
  return a.table() == b.table() && a.firstBrick() == b.firstBrick() && a.brickCount() == b.brickCount() &&
         a.values().size() == b.values().size() && a.ranges().size() == b.ranges().size() &&
         std::memcmp(a.values().data(), b.values().data(), a.values().size() * sizeof(float)) == 0 &&
         std::memcmp(a.ranges().data(), b.ranges().data(), a.ranges().size() * sizeof(Interval)) == 0;
}

TEST(Bake, HoldsTheFieldAtVoxelCentresBitForBit) {
  const ScalarField field = ball({0.1f, -0.2f, 0.3f}, 1.0f);
  const auto grid = bakeGrid(field, {.voxelSize = 0.07f, .box = cube(1.4f)});
  forVoxels(20, [&](const Vec3i& v) { ASSERT_EQ(grid->at(v), field(grid->indexToWorld()(Vec3f(v)))); });
}

TEST(Bake, SparseEqualsDenseInsideTheBand) {
  const float h = 0.05f;
  const Interval band{-6 * h, 7 * h};
  const ScalarField field = max(ball({-0.4f, 0, 0}, 0.6f), ball({0.7f, 0.1f, 0}, 0.5f));
  const auto dense =
      bakeGrid(functionField([&](const Vec3f& p) { return field(p); }), {.voxelSize = h, .box = cube(1.5f)});
  for (const auto interpolation : {Interpolation::trilinear, Interpolation::tricubic}) {
    const auto sparse =
        bakeGrid(field, {.voxelSize = h, .box = cube(1.5f), .band = band, .interpolation = interpolation});
    EXPECT_LT(sparse->poolSize(), dense->poolSize() / 2);
    const auto clamped = [&](float v) { return std::min(std::max(v, band.min), band.max); };
    forVoxels(30, [&](const Vec3i& v) {
      const float truth = dense->at(v), value = sparse->at(v);
      ASSERT_EQ(clamped(value), clamped(truth));
      if (truth > band.min && truth < band.max) {
        ASSERT_EQ(value, truth);
      }
    });
    // Samples that are read lie within sqrt(3) voxels, for cubics within sqrt(12): there, all are inside the
    // band.
    const ScalarField a = gridField(dense, interpolation), b = gridField(sparse, interpolation);
    std::mt19937 random(2);
    std::uniform_real_distribution<float> u(-1.5f, 1.5f);
    int inside = 0;
    for (int i = 0; i < 20000; ++i) {
      const Vec3f p{u(random), u(random), u(random)};
      const float distance = field(p),
                  reach = interpolation == Interpolation::tricubic ? 3.5f * h : 1.75f * h;
      if (distance < band.min + reach || distance > band.max - reach) continue;
      ASSERT_EQ(a(p), b(p));
      ++inside;
    }
    EXPECT_GT(inside, 100) << "the band was met";
  }
}

TEST(Bake, EvaluatesExactlyTheBricksThatTheBandEnters) {
  const float h = 1.0f, radius = 40.0f;
  std::atomic<std::size_t> calls{0};
  const ScalarField field = countedBall({}, radius, calls);
  const auto grid = bakeGrid(field, {.voxelSize = h, .box = cube(60), .band = {-2, 2}});
  // Every brick by its own exact range over the samples 0 to 8 that its cells interpolate between.
  std::size_t entered = 0;
  const Vec3i last = grid->firstBrick() + grid->brickCount();
  for (int z = grid->firstBrick().z; z < last.z; ++z)
    for (int y = grid->firstBrick().y; y < last.y; ++y)
      for (int x = grid->firstBrick().x; x < last.x; ++x) {
        const Vec3f low = Vec3f(Vec3i{x, y, z} * 8);
        const Interval range = field.range(Box{low, low + Vec3f{8, 8, 8}}.intersection(cube(60)));
        entered += range.min < 2 && range.max > -2;
      }
  EXPECT_EQ(calls.load(), entered * 512);
  // A sphere of area A crosses about 1.5 A / 64 cubes of 8^3; the band and the shared face widen that to (8 +
  // 4) / 8.
  EXPECT_LT(double(entered), 3.0 * 4 * kPi * radius * radius / 64);
}

TEST(Bake, DoesNotEvaluateWhatIsSettled) {
  std::atomic<std::size_t> calls{0};
  const ScalarField field = countedBall({}, 1.0f, calls);
  const auto outside = bakeGrid(field, {.voxelSize = 0.1f, .box = {{5, 5, 5}, {9, 9, 9}}, .band = {-1, 1}});
  EXPECT_EQ(calls.load(), 0u);
  EXPECT_EQ(outside->poolSize(), 1u);
  const auto constant = bakeGrid(ScalarField(3.0f), {.voxelSize = 1, .box = {{-8, -8, -8}, {7, 7, 7}}});
  EXPECT_EQ(constant->at({0, 0, 0}), 3.0f);
  EXPECT_EQ(constant->at({9, 0, 0}), 0.0f);
}

TEST(Bake, SettlesOnTheNearerEndOfTheBand) {
  const auto grid = bakeGrid(ball({}, 40.0f), {.voxelSize = 1, .box = cube(60), .band = {-2, 3}});
  EXPECT_EQ(grid->at({0, 0, 0}), 3.0f);
  EXPECT_EQ(grid->at({55, 0, 0}), -2.0f);
  EXPECT_EQ(grid->background(), -2.0f);
  EXPECT_EQ(grid->at({500, 0, 0}), -2.0f);
}

TEST(Bake, CollapsesBricksWhoseSamplesAreSettled) {
  // No range at all: everything is evaluated, and what the band does not enter must still be dropped.
  const ScalarField truth = ball({}, 40.0f);
  const BakeOptions options{.voxelSize = 1, .box = cube(60), .band = {-2, 3}};
  const auto known = bakeGrid(truth, options);
  const auto blind = bakeGrid(functionField([&](const Vec3f& p) { return truth(p); }), options);
  EXPECT_LE(blind->poolSize(), known->poolSize());
  const auto clamped = [](float v) { return std::min(std::max(v, -2.0f), 3.0f); };
  forVoxels(60, [&](const Vec3i& v) { ASSERT_EQ(clamped(blind->at(v)), clamped(truth(Vec3f(v)))); });
  const auto constant =
      bakeGrid(functionField([](const Vec3f&) { return 3.0f; }), {.voxelSize = 1, .box = cube(32)});
  // Bricks inside are one; those at the faces of the box end at the background.
  EXPECT_EQ(constant->poolIndex({0, 0, 0}), constant->poolIndex({-2, 1, 2}));
  EXPECT_EQ(constant->at({0, 0, 0}), 3.0f);
}

TEST(Bake, IsTheSameAtAnyThreadCount) {
  const ScalarField field = max(ball({-0.4f, 0, 0}, 0.6f), ball({0.7f, 0.1f, 0}, 0.5f));
  const BakeOptions options{.voxelSize = 0.02f, .box = cube(1.5f), .band = {-0.1f, 0.1f}};
  std::shared_ptr<BrickGrid> first;
  for (const std::size_t threads : {1, 2, 4}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    const auto grid = bakeGrid(field, options);
    if (first) {
      EXPECT_TRUE(same(*first, *grid)) << threads << " threads";
    } else {
      first = grid;
    }
  }
}

TEST(Bake, BordersAgreeWithTheOwnersOfTheSamples) {
  const auto grid = bakeGrid(ball({3, 1, -2}, 20.0f), {.voxelSize = 1, .box = cube(31), .band = {-2, 2}});
  for (const PlacedBrick& placed : placedBricks(*grid))
    for (int z = -1; z <= 9; ++z)
      for (int y = -1; y <= 9; ++y)
        for (int x = -1; x <= 9; ++x)
          ASSERT_EQ(grid->brick(placed.pool)[sampleOffset(x, y, z)],
                    grid->at(placed.brick * 8 + Vec3i{x, y, z}));
}

TEST(Bake, IsRightInTheWholeBoxAndBackgroundBeyondTheNextVoxel) {
  const auto f = [](const Vec3f& p) { return 5 + p.x - 2 * p.y + 0.5f * p.z; };
  const ScalarField field = bake(
      functionField(f), {.voxelSize = 0.3f, .box = {{-1, 0, 2.05f}, {3.3f, 4.1f, 5}}, .background = -7.0f});
  std::mt19937 random(4);
  std::uniform_real_distribution<float> u(0, 1);
  for (int i = 0; i < 1000; ++i) {
    const Vec3f p{-1 + 4.3f * u(random), 4.1f * u(random), 2.05f + 2.95f * u(random)};
    EXPECT_NEAR(field(p), f(p), 1e-5f);
  }
  // Voxel centres of the box reach from -1.2 to 3.3 in x; one voxel on, the background is reached.
  EXPECT_EQ(field({-1.51f, 2, 3}), -7.0f);
  EXPECT_EQ(field({3.91f, 2, 3}), -7.0f);
  EXPECT_NEAR(field({-1.35f, 2.1f, 3}), (f({-1.2f, 2.1f, 3}) - 7) / 2, 1e-4f);
}

TEST(Bake, FallsOffToTheBackgroundWithinOneVoxelOnEverySide) {
  // Bricks begin at voxel 0 and end at 7: the cells beyond belong to other bricks.
  const ScalarField field =
      bake(ScalarField(3.0f), {.voxelSize = 1, .box = {{0, 0, 0}, {7, 7, 7}}, .background = 1.0f});
  for (int axis = 0; axis < 3; ++axis)
    for (const float edge : {-1.0f, 7.0f})
      for (const float t : {0.25f, 0.5f, 0.75f}) {
        Vec3f p{3, 3, 3};
        p[axis] = edge + t;
        EXPECT_EQ(field(p), 1 + 2 * (edge < 0 ? t : 1 - t));
      }
}

TEST(Bake, TakesBoxesWithoutThicknessAndFarAway) {
  const auto f = [](const Vec3f& p) { return p.x + p.y; };
  const Vec3f point{1e5f, -1e5f, 3};
  for (const Box& box : {Box{point, point}, Box{point, point + Vec3f{20, 0, 0}}}) {
    const auto grid = bakeGrid(functionField(f), {.voxelSize = 0.5f, .box = box});
    EXPECT_EQ(grid->at({200000, -200000, 6}), f(point));
    EXPECT_EQ(grid->at({200000, -199990, 6}), 0.0f);
  }
}

TEST(Bake, KeepsValuesThatAreNotFinite) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto grid = bakeGrid(functionField([&](const Vec3f& p) {
                               return p.x < 0 ? nan : p.x > 5 ? kInfinity : p.x;
                             }),
                             {.voxelSize = 1, .box = cube(10), .band = {1, 4}});
  EXPECT_TRUE(std::isnan(grid->at({-3, 0, 0})));
  EXPECT_EQ(grid->at({3, 0, 0}), 3.0f);
  EXPECT_EQ(gridField(grid).range(cube(10)), Interval::everything());
}

TEST(Bake, BakesVectorsOnGridsOfOneLayout) {
  const auto f = [](const Vec3f& p) { return Vec3f{p.x * p.y, 2 - p.z, p.x > 0.5f ? 1.0f : 0.0f}; };
  const VectorField field = bake(functionField(f), {.voxelSize = 0.1f, .box = cube(1)});
  const VectorGrids grids = gridsOf(field);
  EXPECT_EQ(grids[0]->table(), grids[2]->table());
  forVoxels(10, [&](const Vec3i& v) {
    const Vec3f truth = f(grids[0]->indexToWorld()(Vec3f(v)));
    for (int c = 0; c < 3; ++c) ASSERT_EQ(grids[c]->at(v), truth[c]);
  });
  EXPECT_THROW(bake(functionField(f), {.voxelSize = 0.1f, .box = cube(1), .band = {0, 1}}), Error);
}

TEST(Bake, RefusesOptionsOutsideTheirRange) {
  const ScalarField field(1.0f);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto refused = [&](const BakeOptions& options) { EXPECT_THROW(bakeGrid(field, options), Error); };
  refused({.voxelSize = 0, .box = cube(1)});
  refused({.voxelSize = -1, .box = cube(1)});
  refused({.voxelSize = nan, .box = cube(1)});
  refused({.voxelSize = kInfinity, .box = cube(1)});
  refused({.voxelSize = 1, .box = Box{}});
  refused({.voxelSize = 1, .box = Box::everywhere()});
  refused({.voxelSize = 1, .box = {{0, 0, nan}, {1, 1, 1}}});
  refused({.voxelSize = 1, .box = cube(1), .band = {1, 0}});
  refused({.voxelSize = 1, .box = cube(1), .background = nan});
  refused({.voxelSize = 1e-6f, .box = {{100, 100, 100}, {100.1f, 100.1f, 100.1f}}});
  refused({.voxelSize = 1e-3f, .box = cube(10000)});
}

TEST(Bake, StopsWhenCancelledAndReportsItsProgress) {
  struct Watch : Progress {
    mutable std::atomic<int> steps{0};
    int limit = 1 << 30;
    void advance(double fraction) const override {
      EXPECT_GE(fraction, 0.0);
      EXPECT_LE(fraction, 1.0);
      ++steps;
    }
    bool cancelled() const override { return steps >= limit; }
  };
  const BakeOptions options{.voxelSize = 1, .box = cube(150), .band = {-2, 2}};
  Watch patient, hasty;
  hasty.limit = 3;
  bakeGrid(ball({}, 100.0f), options, patient);
  EXPECT_GT(patient.steps, 10);
  EXPECT_THROW(bakeGrid(ball({}, 100.0f), options, hasty), Cancelled);
}

}  // namespace
}  // namespace nephele

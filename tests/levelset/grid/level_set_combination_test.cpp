// Level sets of balls, as one, against the fields that they were sampled from and closed forms.
#include "nephele/levelset/grid/level_set_combination.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>

#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/mesh/mesh_to_level_set.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/shape/shapes.h"

namespace nephele::test {
namespace {

constexpr float kVoxel = 0.03f, kBand = 3 * kVoxel;
const Vec3f kLeft{-0.3f, 0, 0}, kRight{0.3f, 0, 0};

VoxelGrid<float> ballAt(const Vec3f& centre, float radius = 0.5f, float band = kBand, float voxel = kVoxel) {
  return toVoxels(*bakeGrid(
      sphere(centre, radius),
      {.voxelSize = voxel, .box = {{-1.5f, -1.5f, -1.5f}, {1.5f, 1.5f, 1.5f}}, .band = {-band, band}}));
}

std::vector<VoxelGrid<float>> balls(float band = kBand) {
  std::vector<VoxelGrid<float>> all;
  all.push_back(ballAt(kLeft, 0.5f, band));
  all.push_back(ballAt(kRight, 0.5f, band));
  return all;
}

float cut(float value) {
  return std::clamp(value, -kBand, kBand);
}

/// Calls check(point, value) at the voxels around the balls.
template <class Check>
void forVoxels(const VoxelGrid<float>& grid, const Check& check) {
  for (int k = -20; k <= 20; ++k)
    for (int j = -20; j <= 20; ++j)
      for (int i = -30; i <= 30; ++i) check(Vec3f{float(i), float(j), float(k)} * kVoxel, grid.at({i, j, k}));
}

TEST(LevelSetCombination, IsTheMaximumAndMinimumVoxelByVoxel) {
  const auto solids = balls();
  using enum Combination;
  for (const Combination how : {unionOf, intersection, cutout}) {
    const VoxelGrid<float> all = combined(solids, {.combination = how, .halfWidth = kBand});
    EXPECT_EQ(all.background(), -kBand);
    forVoxels(all, [&](const Vec3f& p, float value) {
      const float a = sphere(kLeft, 0.5f)(p), b = sphere(kRight, 0.5f)(p);
      const float expected = how == unionOf        ? std::max(a, b)
                             : how == intersection ? std::min(a, b)
                                                   : std::min(a, -b);
      ASSERT_NEAR(value, cut(expected), 1e-6f) << p.x << " " << p.y << " " << p.z;
    });
  }
}

// Two caps of height 0.2 of balls of radius 0.5 are a lens: 2 pi h^2 (3 r - h) / 3.
TEST(LevelSetCombination, EnclosesWhatItShould) {
  const auto solids = balls();
  const double pi = 3.14159265358979, ball = 4 * pi / 3 * 0.125, lens = 2 * pi * 0.04 * (1.5 - 0.2) / 3;
  const auto volumeOf = [&](Combination how) {
    return enclosedVolume(combined(solids, {.combination = how, .halfWidth = kBand}));
  };
  EXPECT_NEAR(volumeOf(Combination::unionOf), 2 * ball - lens, 2e-3);
  EXPECT_NEAR(volumeOf(Combination::intersection), lens, 2e-3);
  EXPECT_NEAR(volumeOf(Combination::cutout), ball - lens, 2e-3);
}

TEST(LevelSetCombination, BlendsFillCreasesOnly) {
  const float w = 0.1f;
  CombinationOptions options{.blend = w, .halfWidth = kBand};
  EXPECT_FLOAT_EQ(neededHalfWidth(options), kBand + 0.125f);
  const auto solids = balls(neededHalfWidth(options));
  const VoxelGrid<float> blended = combined(solids, options);
  float most = 0;
  forVoxels(blended, [&](const Vec3f& p, float value) {
    const float a = sphere(kLeft, 0.5f)(p), b = sphere(kRight, 0.5f)(p),
                h = std::max(w - std::abs(a - b), 0.0f);
    ASSERT_NEAR(value, cut(std::max(a, b) + h * h / (4 * w)), 1e-6f) << p.x << " " << p.y << " " << p.z;
    if (std::abs(value) < kBand) most = std::max(most, value - cut(std::max(a, b)));
  });
  EXPECT_NEAR(most, w / 4, 0.1 * w);
  options.combination = Combination::intersection;
  const VoxelGrid<float> hollowed = combined(solids, options);
  forVoxels(hollowed, [&](const Vec3f& p, float value) {
    const float a = sphere(kLeft, 0.5f)(p), b = sphere(kRight, 0.5f)(p),
                h = std::max(w - std::abs(a - b), 0.0f);
    ASSERT_NEAR(value, cut(std::min(a, b) - h * h / (4 * w)), 1e-6f);
  });
}

TEST(LevelSetCombination, CutsOutAllButTheFirst) {
  std::vector<VoxelGrid<float>> solids = balls();
  solids.push_back(ballAt({0, 0.4f, 0}, 0.3f));
  const VoxelGrid<float> left = combined(solids, {.combination = Combination::cutout, .halfWidth = kBand});
  forVoxels(left, [&](const Vec3f& p, float value) {
    const float expected =
        std::min({sphere(kLeft, 0.5f)(p), -sphere(kRight, 0.5f)(p), -sphere({0, 0.4f, 0}, 0.3f)(p)});
    ASSERT_NEAR(value, cut(expected), 1e-6f);
  });
}

TEST(LevelSetCombination, OfOneIsItself) {
  std::vector<VoxelGrid<float>> one;
  one.push_back(ballAt({}));
  const VoxelGrid<float> same = combined(one, {.halfWidth = kBand});
  forVoxels(same, [&](const Vec3f& p, float value) { ASSERT_NEAR(value, cut(sphere({}, 0.5f)(p)), 1e-6f); });
}

TEST(LevelSetCombination, IsTheSameAtAnyNumberOfThreads) {
  const auto solids = balls();
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const VoxelGrid<float> slow = combined(solids, {.blend = 0.05f, .halfWidth = kBand});
  const tbb::global_control four(tbb::global_control::max_allowed_parallelism, 4);
  const VoxelGrid<float> quick = combined(solids, {.blend = 0.05f, .halfWidth = kBand});
  forVoxels(slow, [&](const Vec3f& p, float value) {
    const Vec3f q = p * (1 / kVoxel);
    ASSERT_EQ(value, quick.at({int(std::lround(q.x)), int(std::lround(q.y)), int(std::lround(q.z))}));
  });
}

TEST(LevelSetCombination, RefusesWhatCannotBe) {
  const auto solids = balls();
  EXPECT_THROW(combined({}, {.halfWidth = kBand}), Error);
  EXPECT_THROW(combined(solids, {.halfWidth = 0}), Error);
  EXPECT_THROW(combined(solids, {.blend = -1, .halfWidth = kBand}), Error);
  std::vector<VoxelGrid<float>> other = balls();
  other.push_back(ballAt({}, 0.5f, kBand, 0.05f));
  EXPECT_THROW(combined(other, {.halfWidth = kBand}), Error);
}

}  // namespace
}  // namespace nephele::test

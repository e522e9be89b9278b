#include "nephele/render/volume/render_volume.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "nephele/levelset/grid/bake.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/shape/shapes.h"
#include "tests/support/density.h"

namespace nephele {
namespace {

using test::ball;
using test::densityGrid;
using test::voxels;

TEST(RenderVolume, BoundsWhatItHolds) {
  const RenderVolume volume(ball(1.0f, 0.1f, 3.0f));
  EXPECT_FLOAT_EQ(volume.maxDensity(), 3.0f);
  // The ball, softened by half a voxel, and the voxel that interpolation reaches beyond it.
  for (int axis = 0; axis != 3; ++axis) {
    EXPECT_NEAR(volume.worldBounds().max[axis], 1.1f, 0.051f);
    EXPECT_NEAR(volume.worldBounds().min[axis], -1.1f, 0.051f);
  }
}

TEST(RenderVolume, KnowsTheDistanceToTheNextDensity) {
  // Two single voxels; the distance is measured against a search over all bricks that hold anything.
  const auto grid = densityGrid(voxels(1), {0, 0, 0}, {79, 47, 63}, [](const Vec3f& p) {
    return p == Vec3f{4, 4, 4} || p == Vec3f{76, 44, 36} ? 1.0f : 0.0f;
  });
  const RenderVolume volume(grid);
  std::size_t entry = 0;
  for (int z = 0; z != grid->brickCount().z; ++z)
    for (int y = 0; y != grid->brickCount().y; ++y)
      for (int x = 0; x != grid->brickCount().x; ++x, ++entry) {
        int nearest = 1000;
        for (const Vec3i& brick : volume.occupiedBricks()) {
          const Vec3i d = brick - grid->firstBrick() - Vec3i{x, y, z};
          nearest = std::min(nearest, std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)}));
        }
        ASSERT_EQ(int(volume.emptiness()[entry]), nearest) << x << " " << y << " " << z;
      }
}

TEST(RenderVolume, KnowsHowFarItIsConstant) {
  // Solid but for its rim: counted against every brick of the table, as the definition says.
  const auto grid = bakeGrid(clamp(sphere({0, 0, 0}, 50.0f), 0.0f, 1.0f),
                             {.voxelSize = 1.0f, .box = {{-60, -60, -60}, {60, 60, 60}}, .background = 0.0f});
  const RenderVolume volume(grid);
  std::set<std::int32_t> constants;
  for (std::size_t entry = 0; entry != grid->table().size(); ++entry)
    if (volume.uniformity()[entry] != 0) constants.insert(grid->table()[entry]);
  ASSERT_EQ(constants.size(), 1u);
  const Vec3i n = grid->brickCount();
  int most = 0;
  for (int z = 0; z != n.z; ++z)
    for (int y = 0; y != n.y; ++y)
      for (int x = 0; x != n.x; ++x) {
        const std::size_t entry = (std::size_t(z) * n.y + y) * n.x + x;
        int nearest = 32;
        for (int k = 0; k != n.z; ++k)
          for (int j = 0; j != n.y; ++j)
            for (int i = 0; i != n.x; ++i)
              if (!constants.contains(grid->table()[(std::size_t(k) * n.y + j) * n.x + i]))
                nearest = std::min(nearest, std::max({std::abs(i - x), std::abs(j - y), std::abs(k - z)}));
        most = std::max(most, nearest);
        ASSERT_EQ(int(volume.uniformity()[entry]), nearest) << x << " " << y << " " << z;
      }
  // A cube of bricks that fits into the ball.
  EXPECT_GE(most, 3);
}

TEST(RenderVolume, OutlinesEveryVoxelAboveZero) {
  const auto inside = [](const Vec3f& p) {
    return std::fabs(p.x) + 2 * std::fabs(p.y) + std::fabs(p.z - 5) < 30.0f;
  };
  const auto grid = densityGrid(voxels(1), {-40, -20, -30}, {40, 20, 40},
                                [&](const Vec3f& p) { return inside(p) ? 1.0f : 0.0f; });
  const RenderVolume volume(grid);
  // Support of the outline's hull against the voxels', in scattered directions.
  for (int i = 0; i != 50; ++i) {
    const Vec3f n = normalize(Vec3f{std::sin(i * 1.7f), std::sin(i * 2.9f + 1), std::cos(i * 0.9f)});
    float hull = -1e9f, content = -1e9f;
    for (const Vec3f& p : volume.outline()) hull = std::max(hull, dot(n, p));
    for (int z = -30; z <= 40; ++z)
      for (int y = -20; y <= 20; ++y)
        for (int x = -40; x <= 40; ++x) {
          const Vec3f p{float(x), float(y), float(z)};
          if (inside(p)) content = std::max(content, dot(n, p));
        }
    EXPECT_GE(hull, content);
    EXPECT_LE(hull, content + 2.5f * 8);
  }
}

TEST(RenderVolume, IsEmptyWhereNothingIsAboveZero) {
  const RenderVolume volume(densityGrid(voxels(1), {0, 0, 0}, {9, 9, 9}, [](const Vec3f&) { return -1.0f; }));
  EXPECT_TRUE(volume.isEmpty());
  EXPECT_TRUE(volume.worldBounds().isEmpty());
  EXPECT_TRUE(RenderVolume(std::make_shared<BrickGrid>()).isEmpty());
}

TEST(RenderVolume, KnowsTheDensityThatLightMeets) {
  // 100 voxels of 1 and 50 of 4: (100 + 800) / (100 + 200).
  const RenderVolume volume(
      densityGrid(voxels(1), {-5, 0, 0}, {9, 0, 9}, [](const Vec3f& p) { return p.x < 5 ? 1.0f : 4.0f; }));
  EXPECT_FLOAT_EQ(volume.typicalDensity(), 3.0f);
}

TEST(RenderVolume, RefusesWhatHasNoPicture) {
  const auto unbounded = std::make_shared<BrickGrid>(Lattice{}, BrickBox{}, 0.5f);
  EXPECT_THROW(RenderVolume{unbounded}, Error);
  EXPECT_THROW(RenderVolume(densityGrid(voxels(1), {0, 0, 0}, {3, 3, 3}, [](const Vec3f&) { return NAN; })),
               Error);
}

}  // namespace
}  // namespace nephele

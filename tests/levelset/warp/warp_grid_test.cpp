// Maps between shapes on bricks.
#include "nephele/levelset/warp/warp_grid.h"

#include <gtest/gtest.h>

#include <limits>

#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"
#include "nephele/modeling/shape/shapes.h"

namespace nephele::test {
namespace {

const Box kUnit{{-1, -1, -1}, {1, 1, 1}};

TEST(WarpBricks, HoldTheMapAroundTheSurface) {
  const ScalarField ball = sphere({0, 0, 0}, 1);
  const WarpBricks bricks(ball, kUnit, {.voxelSize = 0.05, .halfWidthVoxels = 3});
  const VectorField map = identity() + VectorField(Vec3f{1, 2, 3});
  const VectorGrids grids = bricks.sample(map);
  std::size_t checked = 0;
  for (int k = -24; k <= 24; ++k)
    for (int j = -24; j <= 24; ++j)
      for (int i = -24; i <= 24; ++i) {
        const Vec3f p = Vec3f{float(i), float(j), float(k)} * 0.05f;
        if (std::abs(1 - length(p)) > 3 * 0.05f) continue;
        const Vec3f expected = map(p);
        for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(grids[c]->at({i, j, k}), expected[int(c)], 1e-5);
        ++checked;
      }
  // The shell's volume: 4 pi / 3 (1.15^3 - 0.85^3) / 0.05^3.
  EXPECT_NEAR(double(checked), 30396, 400);
  // Far inside there is nothing.
  EXPECT_EQ(grids[0]->at({0, 0, 0}), 0);
}

TEST(WarpBricks, GiveALevelSetThatCanBeMeshed) {
  const ScalarField ball = sphere({0, 0, 0}, 1);
  for (const double halfWidth : {1.0, 3.0}) {
    const WarpBricks bricks(ball, kUnit, {.voxelSize = 0.04, .halfWidthVoxels = halfWidth});
    const Mesh mesh = marchingCubes(*bricks.sample(ball));
    EXPECT_TRUE(diagnose(mesh).manifold());
    EXPECT_EQ(diagnose(mesh).components, 1u);
    for (const Vec3d& p : mesh.positions) EXPECT_NEAR(length(p), 1, 0.04 * 0.04);
  }
}

TEST(WarpBricks, KeepTheirVoxelsFarFromTheOrigin) {
  const Vec3f centre{1e5f, -2e5f, 3e5f};
  const ScalarField ball = sphere(centre, 1);
  const Box box{centre - Vec3f{1, 1, 1}, centre + Vec3f{1, 1, 1}};
  const Mesh mesh = marchingCubes(*WarpBricks(ball, box, {.voxelSize = 0.25}).sample(ball));
  EXPECT_GT(mesh.faceCount(), 100u);
  // Floats are 1/32 apart there.
  for (const Vec3d& p : mesh.positions) EXPECT_NEAR(length(p - Vec3d(centre)), 1, 0.15);
}

TEST(WarpBricks, RefuseWhatCannotBeSampled) {
  const ScalarField ball = sphere({0, 0, 0}, 1);
  EXPECT_THROW(WarpBricks(ball, kUnit, {.voxelSize = 0}), Error);
  EXPECT_THROW(WarpBricks(ball, kUnit, {.voxelSize = -1}), Error);
  EXPECT_THROW(WarpBricks(ball, Box{}, {.voxelSize = 0.1}), Error);
  EXPECT_THROW(WarpBricks(ball, kUnit, {.voxelSize = 1e-9}), Error);
  const ScalarField nothing = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(WarpBricks(ball, kUnit, {.voxelSize = 0.1}).sample(nothing), Error);
}

}  // namespace
}  // namespace nephele::test

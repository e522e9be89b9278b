#include "nephele/levelset/cut/marching_tetrahedra.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "nephele/levelset/cut/cut.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/modeling/base/error.h"
#include "tests/levelset/cut/balls_and_blades.h"
#include "tests/support/brick_grids.h"
#include "tests/support/mesh_topology.h"

namespace nephele::test {
namespace {

TEST(MarchingTetrahedra, AreClosedManifoldsOnAnySamples) {
  for (std::uint32_t seed = 0; seed < 400; ++seed) {
    const Mesh mesh = marchingTetrahedra(*randomLattice(seed, 3 + int(seed / 4 % 4)));
    if (mesh.faceCount() == 0) continue;
    const Topology topology = topologyOf(mesh);
    ASSERT_TRUE(topology.isClosedManifold()) << "seed " << seed << ": " << topology;
    ASSERT_GT(signedVolume(mesh), 0) << seed;
  }
}

TEST(MarchingTetrahedra, DoNotCrossThemselves) {
  for (std::uint32_t seed = 0; seed < 12; ++seed)
    EXPECT_EQ(countSelfIntersections(marchingTetrahedra(*randomLattice(seed, 5))), 0u) << seed;
}

TEST(MarchingTetrahedra, OfABallGainTheFourthOfTheErrorAtHalfTheVoxel) {
  const double exact = 4 * M_PI / 3;
  const double coarse = signedVolume(marchingTetrahedra(*ball(10))) / exact - 1;
  const double fine = signedVolume(marchingTetrahedra(*ball(20))) / exact - 1;
  EXPECT_LT(std::abs(fine), 0.005);
  EXPECT_NEAR(coarse / fine, 4, 0.4);  // linear in cells: second order
}

TEST(MarchingTetrahedra, PassThroughSamplesOfZero) {
  // A cube whose faces are samples: these become vertices, with no slivers beside them.
  const auto cube = denseGrid(
      {-1, -1, -1}, {2, 2, 2},
      [](const Vec3i& v) {
        return 5.0f - float(std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}));
      },
      {}, -1.0f);
  const Mesh mesh = marchingTetrahedra(*cube);
  EXPECT_TRUE(topologyOf(mesh).isClosedManifold()) << topologyOf(mesh);
  // 602 samples on the surface of 10 x 10 x 10 cells, but six of its edges, 9 samples each, and six corners
  // have no edge of a tetrahedron that leads inside.
  EXPECT_EQ(mesh.positions.size(), 602u - 6u * 9u - 6u);
  for (const Vec3d& p : mesh.positions) {
    EXPECT_EQ(p, Vec3d(std::round(p.x), std::round(p.y), std::round(p.z)));
    EXPECT_EQ(std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}), 5);
  }
}

TEST(MarchingTetrahedra, StandWhereTheMapOfTheGridPutsThem) {
  // Turned, stretched and mirrored.
  Affine map;
  map.linear.m = {0, 0.5f, 0, 0.25f, 0, 0, 0, 0, 2};
  map.translation = {10, 20, 30};
  const auto value = [](const Vec3i& v) { return 5.3f - length(Vec3f(v)); };
  const Mesh plain = marchingTetrahedra(*denseGrid({-1, -1, -1}, {2, 2, 2}, value, {}, -1.0f));
  const Mesh mapped = marchingTetrahedra(*denseGrid({-1, -1, -1}, {2, 2, 2}, value, map, -1.0f));
  EXPECT_TRUE(topologyOf(mapped).isClosedManifold());
  EXPECT_NEAR(signedVolume(mapped) / signedVolume(plain), 0.25, 1e-9);
  EXPECT_NEAR(length(Vec3d(boundingBox(mapped).center()) - Vec3d{10, 20, 30}), 0, 1e-4);
}

TEST(MarchingTetrahedra, RefuseWhatHasNoSurface) {
  EXPECT_THROW(marchingTetrahedra(*denseGrid(
                   {0, 0, 0}, {1, 1, 1}, [](const Vec3i&) { return 1; }, {}, 1.0f)),
               Error);
  EXPECT_THROW(
      marchingTetrahedra(*denseGrid(
          {0, 0, 0}, {1, 1, 1},
          [](const Vec3i& v) { return v.x == 3 ? std::numeric_limits<float>::quiet_NaN() : float(4 - v.y); },
          {}, -1.0f)),
      Error);
  const auto outside = denseGrid(
      {0, 0, 0}, {1, 1, 1}, [](const Vec3i&) { return -1; }, {}, -1.0f);
  EXPECT_EQ(marchingTetrahedra(*outside).faceCount(), 0u);
  EXPECT_THROW(cutIntoMeshes(*outside, {}), Error);
}

}  // namespace
}  // namespace nephele::test

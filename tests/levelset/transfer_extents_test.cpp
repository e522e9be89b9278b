// The bar of texture coordinates on a globe: no face spans more than half of them without a pole in it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "levelset/grid_field.h"
#include "levelset/marching_cubes.h"
#include "levelset/mesh_io.h"
#include "levelset/mesh_warp.h"
#include "levelset/surface_relaxation.h"
#include "levelset/transfer_attributes.h"
#include "levelset/transfer_quality.h"
#include "modeling/error.h"
#include "tests/support/linked_tori.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"
#include "tests/support/test_meshes.h"
#include "tests/support/uv_layout.h"

namespace nephele::test {
namespace {

/// A globe of 760 triangles, u along the equator, v from pole to pole.
Mesh globe() {
  return triangulated(readMesh(ownData("data/sphere_uv.obj")));
}

Mesh coarseTori() {
  constexpr float kVoxel = 1.0f / 12;
  return marchingCubes(*bakeGrid(linkedToriAndCone(), {.voxelSize = kVoxel,
                                                       .box = Box{{-1.6f, -1.2f, -1.2f}, {1.6f, 1.6f, 1.2f}},
                                                       .band = Interval{-3 * kVoxel, 3 * kVoxel}}));
}

/// Faces whose u or v spans more than half, but for those that go around the axis near to a pole. On a globe
/// the way from corner to corner is the shorter one; around a pole these sum to a whole turn.
std::size_t smearedFaces(const Mesh& mesh) {
  const std::vector<float>& uv = attributeOf(mesh, "uv").values;
  std::size_t count = 0;
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
    const float* c = uv.data() + 6 * f;
    const auto [lowU, highU] = std::minmax({c[0], c[2], c[4]});
    const auto [lowV, highV] = std::minmax({c[1], c[3], c[5]});
    if (highU - lowU <= 0.5f && highV - lowV <= 0.5f) continue;
    float turn = 0;
    for (int i = 0; i < 3; ++i) {
      const float way = c[2 * ((i + 1) % 3)] - c[2 * i];
      turn += way - std::round(way);
    }
    // A corner on the pole has the mean of the others, which hides the turn.
    constexpr float kOn = 1e-3f, kNear = 0.2f;
    const bool isAround = std::abs(turn) > 0.5f || lowV < kOn || highV > 1 - kOn;
    count += !(isAround && (highV < kNear || lowV > 1 - kNear));
  }
  return count;
}

struct Case {
  const char* name;
  MeshWarpOptions options;
};

class UvExtents : public ::testing::TestWithParam<Case> {};

std::size_t smeared(const Mesh& object, const MeshWarpOptions& options) {
  const Mesh reference = globe();
  const MeshWarp warp = warpMesh(reference, object, options);
  return smearedFaces(transferAttributes(reference, object, warp.images));
}

TEST_P(UvExtents, StayBelowHalfOnACoarseObject) {
  EXPECT_EQ(smeared(coarseTori(), GetParam().options), 0u);
}

TEST_P(UvExtents, StayBelowHalfOnTheObjectOfTheNotes) {
  EXPECT_EQ(smeared(triangulated(readMesh(ownData("data/linked_tori_and_cone.obj"))), GetParam().options),
            0u);
}

INSTANTIATE_TEST_SUITE_P(
    Methods, UvExtents,
    ::testing::Values(Case{"closest", {.method = WarpMethod::closest, .quality = WarpQuality::fast}},
                      Case{"fast", {.align = Alignment::none, .quality = WarpQuality::fast}},
                      Case{"fastAligned", {.quality = WarpQuality::fast}},
                      Case{"balanced", {.align = Alignment::none}}, Case{"balancedAligned", {}},
                      Case{"best", {.align = Alignment::none, .quality = WarpQuality::best}},
                      Case{"bestAligned", {.quality = WarpQuality::best}}),
    [](const auto& parameter) { return std::string(parameter.param.name); });

TEST(UvExtentsOfProjections, StayBelowHalfOnTheBunny) {
  const std::string path = sharedData("meshes/bunny_60k.obj");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const Mesh bunny = triangulated(readMesh(path));
  EXPECT_EQ(smeared(bunny, {.method = WarpMethod::closest}), 0u);
  EXPECT_EQ(smeared(bunny, {.align = Alignment::none, .quality = WarpQuality::fast}), 0u);
  EXPECT_EQ(smeared(bunny, {.quality = WarpQuality::fast}), 0u);
}

TEST(Tears, AreCountedWhereSidesSpanTheReference) {
  // A ball on itself is whole. Its top vertex thrown to the bottom tears what hangs on it.
  const Mesh ball = icosphere(1, 4);
  const ExactDistance reference(ball);
  EXPECT_EQ(countTears(reference, ball, ball.positions), 0u);
  std::vector<Vec3d> images = ball.positions;
  images[0] = -images[0];
  std::size_t around = 0;
  for (const std::uint32_t v : ball.corners) around += v == 0;
  EXPECT_EQ(countTears(reference, ball, images), around);
  // Coarse triangles are long, not torn.
  const Mesh coarse = icosphere(1, 0);
  EXPECT_EQ(countTears(reference, coarse, coarse.positions), 0u);
  EXPECT_THROW(countTears(reference, ball, coarse.positions), Error);
}

TEST(Tears, AreJoinedByRelaxation) {
  // A ball in its own place, whose images in one cap are thrown to the other side: no map without folds, and
  // a ring of triangles that spans the ball.
  const Mesh ball = icosphere(1, 3);
  const ExactDistance reference(ball);
  std::vector<Vec3d> torn = ball.positions;
  for (Vec3d& p : torn)
    if (p.y > 0.8) p *= -1.0;
  const std::size_t before = countTears(reference, ball, torn);
  EXPECT_GT(before, 50u);
  RelaxationOptions options{.smoothingRounds = 0, .rounds = 16, .limit = 5, .lastLimit = 3};
  for (const double from : {0.0, 0.5}) {
    options.resistsFrom = from;
    EXPECT_EQ(countTears(reference, ball, relaxImages(reference, ball, torn, options)), 0u) << from;
  }
}

}  // namespace
}  // namespace nephele::test

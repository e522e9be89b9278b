// The bar of texture coordinates on a globe: no face spans more than half of them without a pole in it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/levelset/warp/mesh_warp.h"
#include "nephele/levelset/warp/surface_relaxation.h"
#include "nephele/levelset/warp/transfer_attributes.h"
#include "nephele/levelset/warp/transfer_quality.h"
#include "nephele/modeling/base/error.h"
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
  const Mesh reference = globe(), object = coarseTori();
  const MeshWarp warp = warpMesh(reference, object, GetParam().options);
  EXPECT_EQ(smearedFaces(transferAttributes(reference, object, warp.images)), 0u);
  if (GetParam().options.quality != WarpQuality::best) return;
  // The tori's handles have nowhere to go on a globe. Relaxation alone leaves some thirty torn triangles.
  EXPECT_TRUE(warp.isRelaxed);
  EXPECT_EQ(countTears(ExactDistance(reference), object, warp.images), 0u);
}

class UvExtentsOfNotes : public UvExtents {};

TEST_P(UvExtentsOfNotes, StayBelowHalf) {
  EXPECT_EQ(smeared(triangulated(readMesh(ownData("data/linked_tori_and_cone.obj"))), GetParam().options),
            0u);
}

const Case kCases[] = {{"closest", {.method = WarpMethod::closest, .quality = WarpQuality::fast}},
                       {"fast", {.align = Alignment::none, .quality = WarpQuality::fast}},
                       {"fastAligned", {.quality = WarpQuality::fast}},
                       {"balanced", {.align = Alignment::none}},
                       {"balancedAligned", {}},
                       {"best", {.align = Alignment::none, .quality = WarpQuality::best}},
                       {"bestAligned", {.quality = WarpQuality::best}}};
const auto nameOf = [](const auto& parameter) { return std::string(parameter.param.name); };

INSTANTIATE_TEST_SUITE_P(Methods, UvExtents, ::testing::ValuesIn(kCases), nameOf);
// Best takes seconds here: once.
INSTANTIATE_TEST_SUITE_P(Methods, UvExtentsOfNotes, ::testing::ValuesIn(kCases, kCases + 6), nameOf);

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

TEST(Tears, AreMendedInPatches) {
  // A ball on itself, with a small cap slid by 60 degrees: the ring around the cap is torn, and half of it
  // folded. Mending brings the cap back and leaves the other half of the ball alone.
  const Mesh ball = icosphere(1, 4);
  const ExactDistance reference(ball);
  std::vector<Vec3d> torn = ball.positions;
  for (Vec3d& p : torn)
    if (p.y > 0.97) p = reference.at({p.x, 0.5 * p.y - 0.866 * p.z, 0.5 * p.z + 0.866 * p.y}).point;
  EXPECT_GT(countTears(reference, ball, torn), 20u);
  const std::vector<Vec3d> mended = SurfaceRelaxation(reference, ball).mended(torn);
  EXPECT_EQ(countTears(reference, ball, mended), 0u);
  EXPECT_EQ(transferQuality(ball, ball, mended).flippedFraction, 0.0);
  for (std::size_t v = 0; v < torn.size(); ++v) {
    const bool isFar = ball.positions[v].y < -0.5;
    ASSERT_TRUE(!isFar || mended[v] == torn[v]) << v;
  }
  EXPECT_THROW(SurfaceRelaxation(reference, ball).mended(std::vector<Vec3d>(3)), Error);
}

TEST(Tears, StayWhereNothingIsBetter) {
  // Nothing torn, nothing folded: mending changes nothing.
  const Mesh ball = icosphere(1, 3);
  const ExactDistance reference(ball);
  EXPECT_EQ(SurfaceRelaxation(reference, ball).mended(ball.positions), ball.positions);
}

TEST(UvExtentsOfBest, StayBelowHalfOnASmallBunny) {
  const std::string path = sharedData("meshes/bunny_7k.obj");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const Mesh bunny = triangulated(readMesh(path));
  EXPECT_EQ(smeared(bunny, {.align = Alignment::none, .quality = WarpQuality::best}), 0u);
}

}  // namespace
}  // namespace nephele::test

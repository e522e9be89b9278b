#include "nephele/levelset/warp/alignment.h"

#include <gtest/gtest.h>

#include <functional>

#include "nephele/levelset/io/mesh_io.h"
#include "nephele/modeling/base/error.h"
#include "tests/support/test_data.h"
#include "tests/support/test_meshes.h"

namespace nephele {
namespace {

/// A shape without any symmetry: a box with a bent, lopsided top.
Mesh lopsided() {
  Mesh mesh = test::icosphere(1, 3);
  for (Vec3d& p : mesh.positions) {
    p = {p.x * 1.5 + 0.3 * p.y * p.y, p.y + 0.25 * p.x * p.z, p.z * 0.6 + 0.2 * std::max(p.x, 0.0)};
    if (p.y > 0.3) p.y += 0.8 * (p.y - 0.3);
  }
  return mesh;
}

Similarity similarity(const Vec3f& axis, float degrees, double scale, const Vec3d& shift) {
  Similarity result;
  const Mat3f turn = Mat3f::rotation(axis, radians(degrees));
  for (std::size_t i = 0; i < 9; ++i) result.turn[i] = double(turn.m[i]);
  result.scale = scale;
  result.shift = shift;
  return result;
}

/// How far the aligned object is from where it came from, in sizes.
double error(const Mesh& reference, const Similarity& by) {
  const Mesh object = moved(reference, by);
  const ExactDistance to(reference), from(object);
  const Similarity found = alignSimilarity(to, from).similarity;
  double worst = 0;
  for (std::size_t i = 0; i < object.positions.size(); ++i)
    worst = std::max(worst, length(found(object.positions[i]) - reference.positions[i]));
  return worst / to.size();
}

TEST(AlignSimilarity, UndoesAnyTurnScaleAndShift) {
  // The turns are float matrices, which are rotations to 1e-7; the project's bar is 0.1 / 256 of the size.
  const Mesh mesh = lopsided();
  int number = 0;
  for (const float degrees : {0.0f, 30.0f, 75.0f, 120.0f, 180.0f})
    for (const double scale : {0.5, 2.0}) {
      ++number;
      const Vec3f axis{std::sin(float(number)), std::cos(1.7f * float(number)), 0.3f};
      EXPECT_LE(error(mesh, similarity(axis, degrees, scale, {3.0 * number, -7, 2})), 1e-6)
          << degrees << " degrees, scale " << scale;
    }
}

TEST(AlignSimilarity, UndoesTurnsOfSpot) {
  const std::string path = test::sharedData("meshes/spot_uv.obj");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const Mesh mesh = triangulated(readMesh(path));
  for (const float degrees : {30.0f, 90.0f, 150.0f, 180.0f})
    EXPECT_LE(error(mesh, similarity({1, 2, 0.5f}, degrees, 1.4, {1, 2, 3})), 1e-6) << degrees;
}

TEST(AlignSimilarity, WorksFarFromTheOriginAndBetweenUnits) {
  const Mesh mesh = lopsided();
  EXPECT_LE(error(mesh, similarity({1, 0, 1}, 100, 1000, {1e6, 2e6, -1e6})), 1e-6);
  EXPECT_LE(error(mesh, similarity({1, 0, 1}, 100, 1e-3, {5, 0, 0})), 1e-6);
}

TEST(AlignSimilarity, LeavesABallUnturnedAndDoesNotCollapse) {
  // Reference points taken back hold the scale: the ball's radius is 1, the object's area and moments ask for
  // about 0.7 (half axes 1.5, 1.3, 0.6 and an offset), and 0 would make all distances of its points 0.
  const ExactDistance ball(test::icosphere(1, 3)), object(lopsided());
  const AlignmentResult found = alignSimilarity(ball, object);
  EXPECT_LE(found.similarity.angle(), 1e-6);
  EXPECT_GT(found.similarity.scale, 0.5);
  EXPECT_LT(found.similarity.scale, 1.2);
  EXPECT_LT(found.cost, 0.25);
}

TEST(AlignSimilarity, GivesTheSameTwice) {
  const ExactDistance to(lopsided()), from(test::torusMesh(1, 0.4, 32, 16));
  const AlignmentResult a = alignSimilarity(to, from), b = alignSimilarity(to, from);
  EXPECT_EQ(a.similarity.turn, b.similarity.turn);
  EXPECT_EQ(a.similarity.shift, b.similarity.shift);
  EXPECT_EQ(a.cost, b.cost);
}

TEST(AlignSimilarity, TurnsBack) {
  const Similarity s = similarity({1, 2, 3}, 50, 2, {1, 1, 1});
  const Vec3d p(0.3, -0.2, 0.9), q = (s(p) - s.shift) / s.scale;
  EXPECT_LE(length(s.turnedBack(q) - p), 1e-6);
  EXPECT_NEAR(s.angle(), double(radians(50.0f)), 1e-6);
}

TEST(AlignSimilarity, RejectsTooFewPoints) {
  const ExactDistance ball(test::icosphere(1, 2));
  EXPECT_THROW(alignSimilarity(ball, ball, {.pointCount = 5}), Error);
}

double rootMeanSquare(const ExactDistance& reference, const Mesh& object,
                      const std::function<Vec3d(const Vec3d&)>& map) {
  double sum = 0;
  for (const Vec3d& p : object.positions) {
    const double d = reference.at(map(p)).distance;
    sum += d * d;
  }
  return std::sqrt(sum / double(object.positions.size()));
}

TEST(AlignLattice, BendsAnEllipsoidOntoABall) {
  Mesh mesh = test::icosphere(1, 3);
  for (Vec3d& p : mesh.positions) p.x *= 1.4;
  const ExactDistance ball(test::icosphere(1, 4)), object(mesh);
  const Similarity aligned = alignSimilarity(ball, object).similarity;
  const BendLattice bend = alignLattice(ball, object, aligned, {.smoothness = 1e-3});
  const double before = rootMeanSquare(ball, mesh, aligned);
  const double after = rootMeanSquare(ball, mesh, [&](const Vec3d& p) { return bend(aligned(p)); });
  EXPECT_GT(before, 0.1);
  EXPECT_LE(after, 0.2 * before);
}

TEST(AlignLattice, LeavesEqualShapesAlone) {
  const Mesh mesh = lopsided();
  const ExactDistance shape(mesh);
  const BendLattice bend = alignLattice(shape, shape, {});
  double worst = 0;
  for (const Vec3d& p : mesh.positions) worst = std::max(worst, length(bend(p) - p));
  EXPECT_LE(worst, 1e-3 * shape.size());
}

TEST(AlignLattice, RejectsBadOptions) {
  const ExactDistance ball(test::icosphere(1, 2));
  EXPECT_THROW(alignLattice(ball, ball, {}, {.pointCount = 5}), Error);
  EXPECT_THROW(alignLattice(ball, ball, {}, {.smoothness = 0}), Error);
}

}  // namespace
}  // namespace nephele

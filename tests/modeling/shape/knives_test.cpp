#include "nephele/modeling/shape/knives.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/shape/shapes.h"
#include "tests/support/check_field.h"

namespace nephele::test {
namespace {

constexpr Box kCube{{-1, -1, -1}, {1, 1, 1}};
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

TEST(RandomBlades, FollowFromTheSeedAndLongerListsBeginLikeShorterOnes) {
  const auto few = randomBlades({.count = 3, .box = kCube, .seed = 4});
  const auto many = randomBlades({.count = 40, .box = kCube, .seed = 4});
  const auto other = randomBlades({.count = 3, .box = kCube, .seed = 5});
  ASSERT_EQ(many.size(), 40u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(few[i].normal, many[i].normal);
    EXPECT_EQ(few[i].point, many[i].point);
    EXPECT_NE(few[i].normal, other[i].normal);
  }
  for (const BladePlane& blade : many) {
    EXPECT_NEAR(length(blade.normal), 1, 1e-6f);
    // The middle half of the box.
    EXPECT_TRUE((Box{{-0.5f, -0.5f, -0.5f}, {0.5f, 0.5f, 0.5f}}.contains(blade.point)));
  }
}

TEST(RandomBlades, PointInAllDirectionsAlike) {
  // Directions are uniform on the sphere: every component has mean 0 and mean square 1/3. 4000 draws:
  // standard errors 0.009 and 0.005.
  Vec3d mean, square;
  for (const BladePlane& blade : randomBlades({.count = 4000, .box = kCube})) {
    const Vec3d n(blade.normal);
    mean += n / 4000.0;
    square += n * n / 4000.0;
  }
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(mean[axis], 0, 0.04);
    EXPECT_NEAR(square[axis], 1.0 / 3, 0.02);
  }
}

TEST(RandomBlades, MayAllPassThroughTheMiddle) {
  const Box box{{0, 2, -6}, {2, 4, -2}};
  for (const BladePlane& blade : randomBlades({.count = 5, .box = box, .throughCentre = true}))
    EXPECT_EQ(blade.point, (Vec3f{1, 3, -4}));
}

TEST(RandomBlades, RefuseWhatMakesNoSense) {
  EXPECT_TRUE(randomBlades({.count = 0, .box = kCube}).empty());
  EXPECT_THROW(randomBlades({.count = -1, .box = kCube}), Error);
  EXPECT_THROW(randomBlades({.count = 1}), Error);
  EXPECT_THROW(randomBlades({.count = 1, .box = Box::everywhere()}), Error);
}

TEST(RoughKnife, IsTheHeightOverItsPlane) {
  // K(x) - (x - p) . n is the noise at the foot of x: the same for every x over that foot.
  const BladePlane blade{{0.2f, -0.1f, 0.3f}, {1, 2, -2}};
  const Knife rough = roughKnife(blade, {.amplitude = 0.1f, .noise = {.frequency = 3, .seed = 2}});
  const Knife flat = flatKnife(blade);
  const Vec3f n = normalize(blade.normal), along = normalize(cross(n, Vec3f{0, 1, 0}));
  for (const float t : {-1.0f, -0.3f, 0.4f, 2.0f}) {
    const Vec3f foot = blade.point + along * t;
    const float height = rough.field(foot);
    EXPECT_NE(height, 0);
    for (const float up : {-0.5f, 0.1f, 0.7f}) EXPECT_NEAR(rough.field(foot + n * up), height + up, 2e-5f);
    EXPECT_NEAR(flat.field(foot + n * 0.5f), 0.5f, 1e-6f);
  }
}

TEST(RoughKnife, HasTheHeightThatIsAskedFor) {
  // Root mean square of the field on the plane: amplitude. 128 x 128 points over 60 x 60 cells.
  const Knife rough = roughKnife({}, {.amplitude = 0.25f, .noise = {.frequency = 1}});
  double square = 0;
  for (int i = 0; i < 128; ++i)
    for (int j = 0; j < 128; ++j) {
      const float k = rough.field({float(i) * 0.47f, 0, float(j) * 0.47f});
      square += double(k) * double(k) / (128 * 128);
    }
  EXPECT_NEAR(std::sqrt(square), 0.25, 0.02);
}

TEST(RoughKnife, KeepsWhatEveryFieldPromises) {
  const BladePlane blade{{0.1f, 0.2f, 0}, {0.3f, 1, 0.2f}};
  for (const NoiseKind kind : {NoiseKind::perlin, NoiseKind::simplex, NoiseKind::value})
    checkField(
        roughKnife(blade, {.amplitude = 0.05f, .noise = {.kind = kind, .frequency = 2}, .octaves = 2}).field,
        kCube, {.smoothShare = 0.5});
}

TEST(RoughKnife, IsNowhereSteeperThanItSays) {
  std::mt19937 random(1);
  const Points points = randomPoints(kCube, 20000, random);
  for (const NoiseKind kind : noiseKinds()) {
    const Knife knife = roughKnife({}, {.amplitude = 0.1f, .noise = {.kind = kind, .frequency = 3}});
    Values<float> values(points.size());
    Gradients<float> grads(points.size());
    knife.field.evalGrad(points.spans(), values.spans(), grads.spans());
    for (std::size_t i = 0; i < points.size(); ++i)
      ASSERT_LE(length(Vec3f{grads.data[0][i], grads.data[1][i], grads.data[2][i]}), knife.steepest)
          << noiseName(kind);
  }
}

TEST(RoughKnife, WithoutAmplitudeIsThePlane) {
  const BladePlane blade{{0.1f, 0.2f, 0}, {0.3f, 1, 0.2f}};
  const Knife rough = roughKnife(blade, {.amplitude = 0});
  EXPECT_EQ(rough.steepest, 1.0f);
  EXPECT_EQ(rough.field({0.4f, 0.5f, 0.6f}), flatKnife(blade).field({0.4f, 0.5f, 0.6f}));
  EXPECT_THROW(roughKnife(blade, {.amplitude = -1}), Error);
  EXPECT_THROW(roughKnife({{}, {0, 0, 0}}, {.amplitude = 1}), Error);
  EXPECT_THROW(flatKnife({{}, {0, 0, 0}}), Error);
}

TEST(ScatteredPoints, LieInsideTheShapeAndFollowFromTheSeed) {
  const ScalarField ball = sphere({0, 0, 0}, 0.7f);
  const auto points = scatteredPoints(ball, kCube, 300, 9);
  ASSERT_EQ(points.size(), 300u);
  Vec3d mean;
  for (const Vec3f& p : points) {
    EXPECT_LT(length(p), 0.7f);
    mean += Vec3d(p) / 300.0;
  }
  // The standard error of the mean of each coordinate is 0.7 / sqrt(5 * 300) = 0.018.
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(mean[axis], 0, 0.08);
  EXPECT_EQ(points, scatteredPoints(ball, kCube, 300, 9));
  EXPECT_NE(points, scatteredPoints(ball, kCube, 300, 10));
  EXPECT_THROW(scatteredPoints(ScalarField(-1), kCube, 3, 1), Error);
  EXPECT_THROW(scatteredPoints(ball, kCube, -3, 1), Error);
  EXPECT_THROW(scatteredPoints(ball, Box{}, 3, 1), Error);
}

TEST(VoronoiCell, IsPositiveWhereItsPointIsTheNearest) {
  const auto points = scatteredPoints(ScalarField(1), kCube, 12, 3);
  std::mt19937 random(2);
  const Points at = randomPoints(kCube, 2000, random);
  std::vector<Values<float>> cells;
  for (std::size_t c = 0; c < points.size(); ++c) cells.push_back(evaluate(voronoiCell(points, c), at));
  for (std::size_t i = 0; i < at.size(); ++i) {
    std::size_t nearest = 0;
    for (std::size_t c = 1; c < points.size(); ++c)
      if (length(points[c] - at[i]) < length(points[nearest] - at[i])) nearest = c;
    for (std::size_t c = 0; c < points.size(); ++c)
      ASSERT_EQ(cells[c].data[0][i] > 0, c == nearest) << "cell " << c << " at " << i;
  }
}

TEST(VoronoiCell, OfOnePointIsEverything) {
  const std::vector<Vec3f> one{{1, 2, 3}};
  EXPECT_GT(voronoiCell(one, 0)({100, 0, 0}), 1e30f);
  EXPECT_THROW(voronoiCell(one, 1), Error);
  const std::vector<Vec3f> twice{{1, 2, 3}, {1, 2, 3}};
  EXPECT_THROW(voronoiCell(twice, 0), Error);
  const std::vector<Vec3f> bad{{1, 2, 3}, {kNan, 2, 3}};
  EXPECT_THROW(voronoiCell(bad, 0), Error);
}

TEST(PieceField, IsTheSmallestOfShapeAndKnives) {
  const ScalarField ball = sphere({0, 0, 0}, 1);
  const std::vector<Knife> knives{flatKnife({{0.1f, 0, 0}, {1, 0, 0}}), Knife(sphere({0, 1, 0}, 0.5f))};
  const ScalarField piece = pieceField(ball, knives, {{true, false}}, 0.1f);
  const Vec3f p{0.3f, 0.2f, -0.1f};
  const float expected =
      std::min({1 - length(p), p.x - 0.1f - 0.05f, length(p - Vec3f{0, 1, 0}) - 0.5f - 0.05f});
  EXPECT_NEAR(piece(p), expected, 1e-6f);
  EXPECT_THROW(pieceField(ball, knives, {{true}}), Error);
  EXPECT_THROW(pieceField(ball, knives, {{true, false}}, -1), Error);
  // Without knives, the shape.
  EXPECT_EQ(pieceField(ball, {}, {})(p), ball(p));
}

TEST(PieceField, KerfHasItsWidthWhereTheKnifeIsSteep) {
  // A plane whose field rises three times as fast: the piece begins half a kerf from it all the same.
  const Knife steep(3.0f * plane({0, 0, 0}, {1, 0, 0}), 3);
  const std::vector<Knife> knives{steep};
  const ScalarField piece = pieceField(sphere({0, 0, 0}, 1), knives, {{true}}, 0.2f);
  EXPECT_NEAR(piece({0.15f, 0, 0}), 0.05f, 1e-6f);
  EXPECT_NEAR(piece({0.05f, 0, 0}), -0.05f, 1e-6f);
}

}  // namespace
}  // namespace nephele::test

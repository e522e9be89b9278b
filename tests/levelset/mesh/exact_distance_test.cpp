#include "nephele/levelset/mesh/exact_distance.h"

#include <gtest/gtest.h>

#include <random>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/shape/shapes.h"
#include "tests/support/check_field.h"
#include "tests/support/test_meshes.h"

namespace nephele {
namespace {

TEST(ExactDistance, IsThatOfABoxInsideAndOutside) {
  // The box as a field has its distance in closed form.
  const ScalarField closed = box({{-1, -2, -3}, {1, 2, 3}});
  const ScalarField exact = exactDistance(test::boxMesh({-1, -2, -3}, {1, 2, 3}));
  std::mt19937 random(1);
  const test::Points points = test::randomPoints({{-4, -4, -4}, {4, 4, 4}}, 5000, random);
  const auto a = test::evaluate(closed, points), b = test::evaluate(exact, points);
  for (std::size_t i = 0; i < points.size(); ++i) ASSERT_NEAR(a.data[0][i], b.data[0][i], 2e-6) << i;
}

TEST(ExactDistance, HasAUnitGradientThatPointsInside) {
  const ExactDistance distance(test::icosphere(1, 3));
  const Vec3d outside = distance.at({2, 1, 0.5}).gradient, inside = distance.at({0.4, 0.2, 0.1}).gradient;
  const Vec3d towards = normalize(Vec3d(-2, -1, -0.5));
  EXPECT_GT(dot(outside, towards), 0.98);  // facets of an icosphere of 1280 triangles lean by 5 degrees
  EXPECT_GT(dot(inside, towards), 0.98);
  EXPECT_NEAR(length(outside), 1, 1e-12);
  const Vec3d corner = distance.mesh().positions[3];
  const ExactDistance::Hit on = distance.at(corner);
  EXPECT_LE(std::abs(on.distance), 1e-15);
  EXPECT_GT(dot(on.gradient, normalize(-corner)), 0.99);
}

TEST(ExactDistance, GradientIsThatOfDifferences) {
  const ExactDistance distance(test::torusMesh(1, 0.4, 24, 12));
  std::mt19937 random(2);
  const test::Points points = test::randomPoints({{-2, -2, -1}, {2, 2, 1}}, 400, random);
  constexpr double kStep = 1e-6;
  int kinks = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3d p(points[i]);
    const ExactDistance::Hit hit = distance.at(p);
    Vec3d difference;
    for (int c = 0; c < 3; ++c) {
      Vec3d step;
      step[c] = kStep;
      difference[c] = (distance.at(p + step).distance - distance.at(p - step).distance) / (2 * kStep);
    }
    kinks += length(difference - hit.gradient) > 1e-4;
  }
  EXPECT_LE(kinks, 2);  // points within a step of the medial axis
}

TEST(ExactDistance, LosesNothingFarFromTheOriginAndAtAnySize) {
  const Mesh mesh = test::icosphere(1, 3);
  const ExactDistance here(mesh);
  std::mt19937 random(3);
  const test::Points points = test::randomPoints({{-2, -2, -2}, {2, 2, 2}}, 300, random);
  for (const double size : {1e-6, 1.0, 1e6}) {
    const Vec3d far(1e6 * size, -3e5 * size, 2e6 * size);
    Mesh moved = mesh;
    for (Vec3d& p : moved.positions) p = p * size + far;
    const ExactDistance there(moved);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vec3d p(points[i]);
      // Doubles at 2e6 sizes hold 2e-10 of the size; which of two facets is nearer is told in floats.
      ASSERT_NEAR(there.at(p * size + far).distance / size, here.at(p).distance, 1e-6);
    }
  }
}

TEST(ExactDistance, HasNoInsideWhereTheMeshIsOpen) {
  Mesh open = test::boxMesh({-1, -1, -1}, {1, 1, 1});
  open.corners.resize(open.corners.size() - 6);
  open.faceStart.resize(open.faceStart.size() - 2);
  const ExactDistance distance(open);
  EXPECT_FALSE(distance.isSolid());
  EXPECT_TRUE(ExactDistance(test::boxMesh({-1, -1, -1}, {1, 1, 1})).isSolid());
  for (const Vec3d& p : {Vec3d(0, 0.5, 0), Vec3d(0, 3, 0), Vec3d(0, 0, 0)}) {
    const ExactDistance::Hit hit = distance.at(p);
    EXPECT_LT(hit.distance, 0);
    EXPECT_NEAR(length(hit.gradient), 1, 1e-12);
  }
}

TEST(ExactDistance, TurnsWhatIsInsideOut) {
  Mesh mesh = test::icosphere(1, 2);
  for (std::size_t t = 0; t < mesh.corners.size(); t += 3) std::swap(mesh.corners[t], mesh.corners[t + 1]);
  const ExactDistance distance(mesh);
  EXPECT_TRUE(distance.isTurned());
  EXPECT_GT(distance.at({0, 0, 0.1}).distance, 0.8);
  EXPECT_LT(distance.at({0, 0, 2}).distance, 0);
  EXPECT_GT(distance.normal(0).x * distance.mesh().positions[mesh.corners[0]].x, 0);
}

TEST(ExactDistance, CountsCoincidentPositionsAsOne) {
  // Every triangle with corners of its own.
  const Mesh whole = test::icosphere(1, 2);
  Mesh split;
  for (std::size_t t = 0; t < whole.faceCount(); ++t) {
    std::array<std::uint32_t, 3> face;
    for (std::size_t i = 0; i < 3; ++i) {
      face[i] = std::uint32_t(split.positions.size());
      split.positions.push_back(whole.positions[whole.corners[3 * t + i]]);
    }
    split.addFace(face);
  }
  EXPECT_TRUE(ExactDistance(split).isSolid());
  EXPECT_GT(ExactDistance(split).at({0, 0, 0}).distance, 0.9);
}

TEST(ExactDistance, RangesContainTheValues) {
  const ScalarField field = exactDistance(test::torusMesh(1, 0.4, 24, 12));
  std::mt19937 random(4);
  const Box all{{-2, -2, -1}, {2, 2, 1}};
  for (int k = 0; k < 50; ++k) {
    const Box part = test::randomSubBox(all, random, k);
    const Interval range = field.range(part);
    const auto values = test::evaluate(field, test::randomPoints(part, 50, random));
    for (const float v : values.data[0]) ASSERT_TRUE(range.contains(v));
  }
}

// From afar floats cannot tell the sides of a plate apart, but all that is outside of its box is outside of
// it.
TEST(ExactDistance, HasNoInsideOutsideOfTheBox) {
  const ExactDistance plate(test::boxMesh({0, 0, 0}, {1, 1, 1e-4}));
  EXPECT_NEAR(plate.at({0.3, 0.4, 5e-5}).distance, 5e-5, 1e-12);
  for (const double z : {2000.0, -2000.0, 1e5, 1e9}) {
    const ExactDistance::Hit hit = plate.at({0.3, 0.4, z});
    EXPECT_NEAR(hit.distance / -std::abs(z), 1, 1e-6) << z;
    EXPECT_NEAR(hit.gradient.z, z > 0 ? -1 : 1, 1e-6) << z;
  }
}

TEST(ExactDistance, IsNanWhereThePointIs) {
  const auto distance = std::make_shared<ExactDistance>(test::icosphere(1, 1));
  const float nan = std::nanf("");
  EXPECT_TRUE(std::isnan(exactDistance(distance)({nan, 0, 0})));
  EXPECT_TRUE(std::isnan(closestPoint(distance)({0, nan, 0}).x));
}

TEST(ExactDistance, RejectsWhatIsNoMesh) {
  EXPECT_THROW(ExactDistance(Mesh{}), Error);
  Mesh mesh = test::icosphere(1, 0);
  mesh.positions[2].y = std::nan("");
  EXPECT_THROW(ExactDistance{mesh}, Error);
  Mesh point;
  point.positions = {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}};
  point.addFace(std::array<std::uint32_t, 3>{0, 1, 2});
  EXPECT_THROW(ExactDistance{point}, Error);
  Mesh wrong = test::icosphere(1, 0);
  wrong.corners[0] = 99;
  EXPECT_THROW(ExactDistance{wrong}, Error);
}

}  // namespace
}  // namespace nephele

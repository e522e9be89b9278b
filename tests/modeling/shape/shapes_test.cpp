#include "nephele/modeling/shape/shapes.h"

#include <gtest/gtest.h>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"
#include "tests/support/check_field.h"
#include "tests/support/each_target.h"

namespace nephele {
namespace {

const Box kAround{{-2, -2, -2}, {2, 2, 2}};

TEST(Sphere, IsRadiusMinusDistance) {
  const ScalarField s = sphere({1, 2, 3}, 2);
  EXPECT_FLOAT_EQ(s({1, 2, 3}), 2);
  EXPECT_FLOAT_EQ(s({1, 2, 5}), 0);
  EXPECT_FLOAT_EQ(s({4, 6, 3}), -3);  // 3-4-5 triangle
}

TEST(Box, IsDistanceToFacesEdgesAndCorners) {
  const ScalarField b = box(Box{{-1, -2, -3}, {1, 2, 3}});
  EXPECT_FLOAT_EQ(b({0, 0, 0}), 1);
  EXPECT_FLOAT_EQ(b({0, 1.5f, 0}), 0.5f);
  EXPECT_FLOAT_EQ(b({3, 0, 0}), -2);
  EXPECT_FLOAT_EQ(b({4, 6, 0}), -5);   // from the edge (1, 2, .)
  EXPECT_FLOAT_EQ(b({2, 4, -5}), -3);  // from the corner: 1-2-2-3
}

TEST(Plane, IsPositiveOnTheSideOfTheNormal) {
  const ScalarField p = plane({0, 1, 0}, {0, 2, 0});
  EXPECT_FLOAT_EQ(p({5, 4, -3}), 3);
  EXPECT_FLOAT_EQ(p({5, 0, -3}), -1);
}

TEST(Torus, IsDistanceToTheTube) {
  const ScalarField t =
      torus({.center = {0, 0, 1}, .axis = {0, 0, 5}, .majorRadius = 2, .minorRadius = 0.5f});
  EXPECT_FLOAT_EQ(t({2, 0, 1}), 0.5f);
  EXPECT_FLOAT_EQ(t({0, -2, 1.5f}), 0);
  EXPECT_NEAR(t({5, 0, 5}), 0.5 - 5, 1e-6);  // 3-4-5 from the tube's middle
  EXPECT_NEAR(t({0, 0, 1}), 0.5 - 2, 1e-6);
}

TEST(Capsule, IsDistanceToTheSegment) {
  const ScalarField c = capsule({0, 0, 0}, {0, 4, 0}, 1);
  EXPECT_FLOAT_EQ(c({3, 2, 0}), -2);
  EXPECT_FLOAT_EQ(c({0, 8, 3}), -4);
  EXPECT_FLOAT_EQ(c({0, 2, 0}), 1);
  const ScalarField point = capsule({1, 1, 1}, {1, 1, 1}, 2);
  EXPECT_FLOAT_EQ(point({1, 1, 4}), -1);
}

TEST(Cone, IsDistanceToBaseSlantAndApex) {
  // Radius 3, height 4: the slant has length 5.
  const ScalarField c = cone({.apex = {0, 4, 0}, .baseCenter = {0, 0, 0}, .baseRadius = 3});
  EXPECT_FLOAT_EQ(c({1, -2, 0}), -2);
  EXPECT_FLOAT_EQ(c({0, 7, 0}), -3);
  EXPECT_NEAR(c({6, -4, 0}), -5, 1e-6);            // from the rim
  EXPECT_NEAR(c({0, 1, 0}), 1, 1e-6);              // base is nearest: slant is 3 * 3 / 5 away
  EXPECT_NEAR(c({0, 3, 0}), 3.0 / 5, 1e-6);        // slant: 1 * 3 / 5
  EXPECT_NEAR(c({1.5f + 4, 2 + 3, 0}), -5, 1e-6);  // from the slant's middle along its normal (4, 3) / 5
}

TEST(Ellipsoid, HasItsSurfaceWhereTheEquationHasIt) {
  const Vec3f r{1, 2, 0.5f};
  const ScalarField e = ellipsoid({1, 0, 0}, r);
  for (int i = 0; i < 200; ++i) {
    const float a = 0.1f * i, b = 0.37f * i;
    const Vec3f n{std::cos(a) * std::sin(b), std::sin(a) * std::sin(b), std::cos(b)};
    EXPECT_NEAR(e(Vec3f{1, 0, 0} + n * r), 0, 2e-6f);
    EXPECT_GT(e(Vec3f{1, 0, 0} + n * r * 0.9f), 0);
    EXPECT_LT(e(Vec3f{1, 0, 0} + n * r * 1.1f), 0);
  }
  const ScalarField round = ellipsoid({0, 0, 0}, {2, 2, 2});
  EXPECT_NEAR(round({0, 3, 4}), -3, 1e-5);  // a sphere's distance
  EXPECT_FLOAT_EQ(e({1, 0, 0}), 0.5f);      // the centre is where it has no limit: the smallest radius
}

TEST(Shapes, KeepWhatEveryFieldPromises) {
  const std::pair<const char*, ScalarField> all[] = {
      {"sphere", sphere({0.1f, -0.2f, 0.3f}, 1)},
      {"box", box(Box{{-1, -0.5f, -0.7f}, {0.8f, 0.9f, 1}})},
      {"plane", plane({0.1f, 0.2f, 0}, {1, 2, -1})},
      {"torus", torus({.center = {0.1f, 0, 0}, .axis = {1, 1, 0}, .majorRadius = 1, .minorRadius = 0.3f})},
      {"cone", cone({.apex = {0.2f, 1, 0.1f}, .baseCenter = {0, -0.7f, 0}, .baseRadius = 0.8f})},
      {"capsule", capsule({-1, 0, 0.2f}, {0.5f, 0.7f, 0}, 0.4f)},
      {"ellipsoid", ellipsoid({0, 0.1f, 0}, {1, 0.6f, 1.4f})}};
  for (const auto& [name, field] : all) {
    SCOPED_TRACE(name);
    test::checkField(field, kAround);
  }
}

TEST(Shapes, HaveGradientsOfLengthOneWhereTheyAreDistances) {
  std::mt19937 random(5);
  const test::Points points = test::randomPoints(kAround, 2000, random);
  for (const ScalarField& f :
       {sphere({0, 0, 0}, 1), box(Box{{-1, -1, -1}, {1, 1, 1}}), plane({0, 0, 0}, {1, 2, 3}), torus(), cone(),
        capsule({-1, 0, 0}, {1, 0, 0}, 0.5f)}) {
    std::vector<float> values(points.size());
    test::Gradients<float> g(points.size());
    f.evalGrad(points.spans(), values, g.spans());
    for (std::size_t i = 0; i < points.size(); ++i)
      ASSERT_NEAR(length(Vec3f{g.data[0][i], g.data[1][i], g.data[2][i]}), 1, 1e-5) << i;
  }
}

TEST(Shapes, AreTheSameBitsOnEveryInstructionSet) {
  std::mt19937 random(6);
  const test::Points points = test::randomPoints(kAround, 1000, random);
  for (const ScalarField& f : {sphere({0, 0, 0}, 1), box(Box{{-1, -1, -1}, {1, 1, 1}}), torus(), cone(),
                               capsule({-1, 0, 0}, {1, 0, 0}, 0.5f), ellipsoid({0, 0, 0}, {1, 2, 3})}) {
    const auto first = test::evaluate(f, points);
    test::forEachTarget([&] {
      const auto again = test::evaluate(f, points);
      for (std::size_t i = 0; i < points.size(); ++i)
        ASSERT_TRUE(test::sameBits(first.data[0][i], again.data[0][i])) << i;
    });
  }
}

TEST(Shapes, KeepTheirRangeFarFromTheOrigin) {
  // Rounding of coordinates is what the widening of ranges is for.
  const Vec3f far{30000, -20000, 10000};
  const Box around{far - Vec3f{2, 2, 2}, far + Vec3f{2, 2, 2}};
  test::CheckOptions options;
  options.gradient = false;
  test::checkField(sphere(far, 1), around, options);
  test::checkField(torus({.center = far}), around, options);
  test::checkField(ellipsoid(far, {1, 2, 0.5f}), around, options);
  test::checkField(cone({.apex = far + Vec3f{0, 1, 0}, .baseCenter = far}), around, options);
}

TEST(Shapes, HaveRangesOverAllOfSpace) {
  EXPECT_EQ(sphere({0, 0, 0}, 2).range(Box::everywhere()),
            (Interval{-std::numeric_limits<float>::infinity(), 2}));
  EXPECT_GE(box(Box{{0, 0, 0}, {2, 2, 2}}).range(Box::everywhere()).max, 1);
}

TEST(Shapes, RangesSettleBoxesAwayFromTheSurface) {
  const ScalarField s = sphere({0, 0, 0}, 1);
  EXPECT_LT(s.range({{1, 1, 1}, {2, 2, 2}}).max, -0.7f);  // nearest corner: 1 - sqrt 3
  EXPECT_GT(s.range({{-0.2f, -0.2f, -0.2f}, {0.2f, 0.2f, 0.2f}}).min, 0.6f);
  EXPECT_LT(box(Box{{-1, -1, -1}, {1, 1, 1}}).range({{2, -1, -1}, {3, 1, 1}}).max, -0.99f);
}

TEST(Shapes, RefuseArgumentsThatMakeNoShape) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(sphere({0, 0, 0}, 0), Error);
  EXPECT_THROW(sphere({0, nan, 0}, 1), Error);
  EXPECT_THROW(sphere({0, 0, 0}, nan), Error);
  EXPECT_THROW(box(Box{}), Error);
  EXPECT_THROW(box(Box::everywhere()), Error);
  EXPECT_THROW(plane({0, 0, 0}, {0, 0, 0}), Error);
  EXPECT_THROW(torus({.minorRadius = -1}), Error);
  EXPECT_THROW(cone({.apex = {0, 0, 0}, .baseCenter = {0, 0, 0}}), Error);
  EXPECT_THROW(capsule({0, 0, 0}, {1, 0, 0}, 0), Error);
  EXPECT_THROW(ellipsoid({0, 0, 0}, {1, 0, 1}), Error);
}

}  // namespace
}  // namespace nephele

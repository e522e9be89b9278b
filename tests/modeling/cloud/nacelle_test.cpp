#include "nephele/modeling/cloud/nacelle.h"

#include <gtest/gtest.h>

#include <random>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/cloud/surface_point.h"
#include "nephele/modeling/field/function_field.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"
#include "nephele/modeling/noise/noise.h"
#include "tests/support/check_field.h"
#include "tests/support/linked_tori.h"

namespace nephele {
namespace {

using test::Points;

constexpr float kVoxel = 1.0f / 30.0f;  // of the notes' figure 4.1, as our algorithms state it

struct Warped {
  Points from, to;
  NacelleStatistics statistics;

  Warped(const ScalarField& object, const ScalarField& reference, const Points& points,
         const NacelleOptions& options)
      : from(points), to(points.size()) {
    statistics = nacelleAt(object, reference, from.spans(), Spans<3>{{to.x, to.y, to.z}}, options);
  }
  bool isFinite() const {
    for (std::size_t i = 0; i < to.size(); ++i)
      if (!nephele::isFinite(to[i])) return false;
    return true;
  }
};

Points figurePoints(std::size_t count) {
  std::mt19937 random(1);
  return test::randomPoints({{-1.6f, -1.2f, -1.2f}, {1.6f, 1.6f, 1.2f}}, count, random);
}

/// Points of the zero surface of `l` near random ones.
Points surfacePoints(const ScalarField& l, std::size_t count) {
  const Points points = figurePoints(count);
  test::Values<Vec3f> found = test::evaluate(surfacePoint(l, {.voxel = 1e-3f}), points);
  Points result(count);
  for (std::size_t i = 0; i < count; ++i)
    result.set(i, {found.data[0][i], found.data[1][i], found.data[2][i]});
  return result;
}

/// (1 - |x|^2) / 2: a ball whose values are no distances, the example of the project's ALGORITHMS.
ScalarField quadraticBall() {
  const VectorField x = position();
  return 0.5f * (1.0f - dot(x, x));
}

TEST(Nacelle, WarpsASphereToLinkedToriAndACone) {
  // ALGORITHMS of the project: p99 <= 0.01 voxels after 3 steps on points of the object's surface.
  const ScalarField object = test::linkedToriAndCone(), reference = sphere({0, 0, 0}, 1);
  const Warped warp(object, reference, surfacePoints(object, 4000), {.steps = 3, .voxel = kVoxel});
  ASSERT_EQ(warp.statistics.iterations.size(), 4u);
  EXPECT_LE(warp.statistics.iterations[1].median, 1e-3);  // the table's row for one step
  EXPECT_LE(warp.statistics.iterations[2].p99, 1e-3);
  EXPECT_LE(warp.statistics.iterations[3].p99, 0.01);
  EXPECT_LE(warp.statistics.result.max, 0.1);
  EXPECT_EQ(warp.statistics.unconvergedFraction, 0.0);
}

TEST(Nacelle, MapsEveryLevelToTheSameLevelOfTheReference) {
  // The definition, equation 4.1, all around the object and inside it. The sphere's inradius is above the
  // object's, so every level has an image.
  const ScalarField object = test::linkedToriAndCone(), reference = sphere({0.1f, 0.2f, 0}, 1.3f);
  const VectorField X = nacelle(object, reference, {.voxel = kVoxel});
  const Points points = figurePoints(2000);
  const auto wanted = test::evaluate(object, points);
  const auto found = test::evaluate(compose(reference, X), points);
  for (std::size_t i = 0; i < points.size(); ++i)
    ASSERT_NEAR(found.data[0][i], wanted.data[0][i], 1e-3 * double(kVoxel)) << i;
}

TEST(Nacelle, TakesTheSecondOrderStepOfAQuadraticExactly) {
  // (1 - r^2) / 2 has g = -x, M = -1, so gamma = -1 and the step ends where the value is exactly right. In
  // double precision: at most 3e-11 voxels, the figure of the project's ALGORITHMS; the first order is off by
  // voxels.
  double worst1 = 0, worst2 = 0;
  for (int i = 0; i <= 100; ++i)
    for (const double target : {-0.3, -0.1, 0.0, 0.2, 0.4}) {
      const double x = 0.5 + 0.01 * i, r = target - (1 - x * x) / 2, gg = x * x;
      const auto after = [&](double a) {
        const double y = x - a * x;
        return std::abs(target - (1 - y * y) / 2) / double(kVoxel);
      };
      worst1 = std::max(worst1, after(nacelleStep(r, gg, 0.0)));
      worst2 = std::max(worst2, after(nacelleStep(r, gg, -gg)));
    }
  EXPECT_LE(worst2, 3e-11);
  EXPECT_GE(worst1, 2.0);
}

TEST(Nacelle, NeedsOneStepOfSecondOrderForAQuadratic) {
  // As above with fields, to the rounding of floats: 1e-7 in values of about 1.
  const ScalarField object = 0.5f * test::linkedToriAndCone();
  const Points points = surfacePoints(object, 2000);
  const Warped first(object, quadraticBall(), points, {.steps = 1, .order = 1, .voxel = kVoxel});
  const Warped second(object, quadraticBall(), points, {.steps = 1, .order = 2, .voxel = kVoxel});
  EXPECT_LE(second.statistics.iterations[1].p95, 1e-2);
  EXPECT_GE(first.statistics.iterations[1].p95, 0.2);
}

TEST(Nacelle, TakesANonNegativeRootOnly) {
  // 1 + 2 delta gamma < 0: no point along the gradient has the value; the top of the parabola is at -1/gamma.
  EXPECT_DOUBLE_EQ(nacelleStep(1.0, 1.0, -4.0), 0.25);
  EXPECT_DOUBLE_EQ(nacelleStep(0.1, 1.0, 0.0), 0.1);
  // |g| = 1/8: |g|^2 counts as 1/16, and the way 16 * 1/8 = 2 is within 2 / (1/4).
  EXPECT_DOUBLE_EQ(nacelleStep(1.0, 1.0 / 64, 0.0), 16.0);
}

TEST(Nacelle, AgreesWithTheFieldBitForBit) {
  const ScalarField object = test::linkedToriAndCone(), reference = sphere({0, 0, 0}, 1);
  const NacelleOptions options{.voxel = kVoxel};
  const Warped warp(object, reference, figurePoints(1000), options);
  const auto field = test::evaluate(nacelle(object, reference, options), warp.from);
  for (std::size_t i = 0; i < warp.to.size(); ++i)
    ASSERT_EQ(warp.to[i], (Vec3f{field.data[0][i], field.data[1][i], field.data[2][i]}));
}

TEST(Nacelle, GivesAPointWhereTheReferenceHasNoGradient) {
  // The middle of a sphere, the axis and the core circle of a torus, the middle of a box.
  Points points(4);
  points.set(1, {0, 0, 0.5f});
  points.set(2, {1, 0, 0});
  points.set(3, {0.25f, 0.25f, 0.25f});
  for (const ScalarField& reference : {sphere({0, 0, 0}, 1), torus({.majorRadius = 1, .minorRadius = 0.25f}),
                                       box({{-1, -1, -1}, {1, 1, 1}})})
    for (const int order : {1, 2}) {
      const Warped warp(sphere({0, 0, 0}, 0.7f), reference, points, {.order = order, .voxel = kVoxel});
      EXPECT_TRUE(warp.isFinite());
    }
}

TEST(Nacelle, StaysFiniteFarAwayAndAtAnySize) {
  const ScalarField reference = sphere({0, 0, 0}, 1);
  Points points(3);
  points.set(0, {1e6f, 0, 0});
  points.set(1, {3e8f, -2e8f, 1e8f});
  points.set(2, {1e-20f, 0, 0});
  EXPECT_TRUE(Warped(sphere({1e6f, 0, 0}, 1), reference, points, {.voxel = kVoxel}).isFinite());
  EXPECT_TRUE(Warped(sphere({0, 0, 0}, 1000), reference, points, {.voxel = kVoxel}).isFinite());
  const ScalarField nothing = log(ScalarField(-1.0f)), endless = 1 / ScalarField(0.0f);
  EXPECT_TRUE(Warped(nothing, reference, points, {.voxel = kVoxel}).isFinite());
  EXPECT_TRUE(Warped(endless, reference, points, {.voxel = kVoxel}).isFinite());
  const Warped warp(0.0f, nothing, points, {.voxel = kVoxel});
  EXPECT_TRUE(warp.isFinite());
  EXPECT_EQ(warp.statistics.unconvergedFraction, 1.0);
}

TEST(Nacelle, FallsBackToTheClosestPointBeyondTheBandOfTheReference) {
  // A sphere whose distance is known within 0.2 only: beyond it the gradient is 0 and nothing can move. The
  // object is a larger sphere, so X = c + L_O n with c = x / |x| and n = -x / |x|.
  const ScalarField reference = clamp(sphere({0, 0, 0}, 1), -0.2f, 0.2f), object = sphere({0, 0, 0}, 1.9f);
  const VectorField closest = normalize(position());
  Points points(2);
  points.set(0, {0, 2, 0});
  points.set(1, {1.2f, 1.6f, 0});
  const Warped stuck(object, reference, points, {.voxel = kVoxel});
  EXPECT_EQ(stuck.statistics.unconvergedFraction, 1.0);
  EXPECT_GT(stuck.statistics.result.max, 1.0);
  EXPECT_EQ(stuck.to[0], points[0]);
  const Warped fallen(object, reference, points, {.voxel = kVoxel, .closestPoint = closest});
  EXPECT_EQ(fallen.statistics.unconvergedFraction, 1.0);
  EXPECT_LE(fallen.statistics.result.max, 0.1);
  EXPECT_NEAR(fallen.to[0].y, 1.1f, 1e-5);  // c = (0, 1, 0), L_O = -0.1, n points down
  EXPECT_NEAR(fallen.to[1].x, 0.66f, 1e-5);
  EXPECT_NEAR(fallen.to[1].y, 0.88f, 1e-5);
}

TEST(Nacelle, HoldsTheObjectWithinTheBand) {
  // In the middle of a large sphere the object is 2 deep, which a sphere of radius 1 is nowhere.
  const VectorField X =
      nacelle(sphere({0, 0, 0}, 2), sphere({0, 0, 0}, 1), {.steps = 5, .voxel = kVoxel, .band = {-1, 0.75f}});
  const Vec3f p = X({0.1f, 0, 0});
  EXPECT_NEAR(length(p), 0.25f, 1e-4);  // where the sphere is 0.75 deep
}

TEST(Nacelle, StartsWhereItIsTold) {
  const Vec3f shift{10, 0, 0};
  const ScalarField object = sphere({-10, 0, 0}, 1), reference = sphere({0, 0, 0}, 1);
  const VectorField X = nacelle(object, reference, {.voxel = kVoxel, .start = position() + shift});
  const Vec3f p = X({-10, 1.5f, 0});
  EXPECT_NEAR(length(p - Vec3f(0, 1.5f, 0)), 0, 1e-5);
}

TEST(Nacelle, HalvesStepsThatDoNotHelp) {
  // The cube root of a distance is so steep at 0 that plain Newton steps go twice too far and back forever:
  // for sign(d) |d|^(1/3), x - f / f' = -2 x.
  const ScalarField d = sphere({0, 0, 0}, 1);
  const ScalarField steep = d / pow(abs(d), 2.0f / 3.0f);
  const Vec3f p = nacelle(0.0f, steep, {.steps = 20, .voxel = 0.02f})({1.3f, 0, 0});
  EXPECT_NEAR(length(p), 1, 1e-3);
}

TEST(Nacelle, LooksUpBakedCurvatures) {
  // A hook that changes nothing but the way: the same answer up to the differences that the Hessian is made
  // of (steps of 1e-3 of gradients good to 1e-7).
  int baked = 0;
  const auto hook = [&baked](const ScalarField& f) {
    ++baked;
    return f;
  };
  const ScalarField object = 0.5f * test::linkedToriAndCone();
  const Points points = figurePoints(500);
  const Warped plain(object, quadraticBall(), points, {.order = 2, .voxel = kVoxel});
  const Warped looked(object, quadraticBall(), points, {.order = 2, .voxel = kVoxel, .bake = hook});
  EXPECT_EQ(baked, 2);  // g.g and g.M.g
  for (std::size_t i = 0; i < points.size(); ++i) ASSERT_LE(length(plain.to[i] - looked.to[i]), 2e-3) << i;
}

TEST(Nacelle, CountsPercentilesOfResiduals) {
  std::vector<float> values(1000);
  for (int i = 0; i < 1000; ++i) values[std::size_t(i)] = float((i * 7) % 1000) * (i & 1 ? -1.0f : 1.0f);
  const WarpResidual r = residualOf(values);
  EXPECT_EQ(r.median, 500);
  EXPECT_EQ(r.p95, 950);
  EXPECT_EQ(r.p99, 990);
  EXPECT_EQ(r.max, 999);
  std::vector<float> none;
  EXPECT_EQ(residualOf(none).max, 0);
  std::vector<float> unknown{0, std::nanf("")};
  EXPECT_TRUE(std::isinf(residualOf(unknown).max));
}

TEST(Nacelle, RejectsBadOptions) {
  const ScalarField l = sphere({0, 0, 0}, 1);
  EXPECT_THROW(nacelle(l, l, {.steps = 0}), Error);
  EXPECT_THROW(nacelle(l, l, {.steps = 21}), Error);
  EXPECT_THROW(nacelle(l, l, {.order = 3}), Error);
  EXPECT_THROW(nacelle(l, l, {.voxel = 0.0f}), Error);
  EXPECT_THROW(nacelle(l, l, {.toleranceVoxels = -1}), Error);
  EXPECT_THROW(nacelle(l, l, {.fallbackVoxels = -1}), Error);
  EXPECT_THROW(nacelle(l, l, {.band = {1, -1}}), Error);
}

}  // namespace
}  // namespace nephele

#include "nephele/modeling/cloud/surface_point.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/function_field.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"
#include "nephele/modeling/noise/noise.h"
#include "nephele/modeling/shape/combinations.h"
#include "nephele/modeling/shape/shapes.h"
#include "tests/support/check_field.h"

namespace nephele {
namespace {

using test::Points;

/// Points, their surface points by the block form, and l there.
struct Projected {
  Points from, to;
  std::vector<float> residual;

  Projected(const ScalarField& l, const Points& points, const SurfacePointOptions& options)
      : from(points), to(points.size()), residual(points.size()) {
    Scratch& scratch = Scratch::local();
    for (std::size_t first = 0; first < points.size(); first += kBlockSize) {
      Scratch::Frame frame(scratch);
      const int count = int(std::min<std::size_t>(kBlockSize, points.size() - first));
      const BlockLanes<3> xyz = frame.lanes<3>(), y = frame.lanes<3>();
      float* const r = frame.lane();
      std::copy_n(points.x.data() + first, count, xyz[0]);
      std::copy_n(points.y.data() + first, count, xyz[1]);
      std::copy_n(points.z.data() + first, count, xyz[2]);
      detail::projectToSurface(*l.node(), scratch.pointBlock(xyz, count), y, r, options, scratch);
      for (int i = 0; i < count; ++i) {
        to.set(first + std::size_t(i), {y[0][i], y[1][i], y[2][i]});
        residual[first + std::size_t(i)] = r[i];
      }
    }
  }
};

TEST(SurfacePoint, IsTheClosestPointOfASphere) {
  const VectorField y = surfacePoint(sphere({1, 0, 0}, 2), {.voxel = 0.01f});
  const Vec3f p = y({1, 6, 8});
  EXPECT_NEAR(p.x, 1, 1e-4);
  EXPECT_NEAR(p.y, 1.2f, 1e-4);  // along (0, 0.6, 0.8)
  EXPECT_NEAR(p.z, 1.6f, 1e-4);
}

TEST(SurfacePoint, LeavesSurfacePointsWhereTheyAre) {
  const Vec3f p{1, 0, 0};
  EXPECT_EQ(surfacePoint(sphere({0, 0, 0}, 1))(p), p);
}

TEST(SurfacePoint, ReachesTheBarOnDisplacedSurfaces) {
  // ALGORITHMS of the project, slopes up to 0.5: after 5 steps median |l(y)| <= 0.01 voxels, p95 <= 0.02, p99
  // <= 0.1, more than 0.1 voxels off at most 1 %. Two displaced layers, points within the reach of a third.
  const float h = 0.02f, frequency = 4, amplitude = 0.5f / frequency;
  ScalarField l = sphere({0, 0, 0}, 1);
  std::mt19937 random(7);
  for (int layer = 0; layer < 3; ++layer) {
    Points near(0);
    const Points candidates = test::randomPoints({{-1.5f, -1.5f, -1.5f}, {1.5f, 1.5f, 1.5f}}, 60000, random);
    const auto values = test::evaluate(l, candidates);
    for (std::size_t i = 0; i < candidates.size(); ++i)
      if (values.data[0][i] > -0.1f && values.data[0][i] < 4 * h) {
        near.x.push_back(candidates.x[i]);
        near.y.push_back(candidates.y[i]);
        near.z.push_back(candidates.z[i]);
      }
    ASSERT_GT(near.size(), 1000u);
    near.x.resize(std::min<std::size_t>(near.size(), 3000));
    near.y.resize(near.x.size());
    near.z.resize(near.x.size());
    const Projected result(l, near, {.voxel = h});
    std::vector<float> error;
    for (const float r : result.residual) error.push_back(std::abs(r) / h);
    std::sort(error.begin(), error.end());
    const auto quantile = [&](double q) { return error[std::size_t(q * double(error.size() - 1))]; };
    EXPECT_LE(quantile(0.5), 0.01f) << "layer " << layer;
    EXPECT_LE(quantile(0.95), 0.02f) << "layer " << layer;
    EXPECT_LE(quantile(0.99), 0.1f) << "layer " << layer;
    const float a = amplitude * std::pow(0.5f, float(layer)), f = frequency * std::pow(2.0f, float(layer));
    l = l + a * abs(compose(perlin({.frequency = f * 0.5f, .seed = unsigned(layer)}),
                            surfacePoint(l, {.voxel = h})));
    if (layer == 1) break;  // the pure form of a third layer costs (1 + 7 k)^3 evaluations
  }
}

TEST(SurfacePoint, ResidualIsTheFieldAtTheResult) {
  const ScalarField l = box(Box{{-1, -0.6f, -0.3f}, {1, 0.5f, 0.7f}}) * 2;
  std::mt19937 random(3);
  const Projected result(l, test::randomPoints({{-2, -2, -2}, {2, 2, 2}}, 1000, random), {.voxel = 0.01f});
  const auto there = test::evaluate(l, result.to), here = test::evaluate(l, result.from);
  for (std::size_t i = 0; i < result.from.size(); ++i) {
    ASSERT_TRUE(test::sameBits(result.residual[i], there.data[0][i]));
    ASSERT_LE(std::abs(result.residual[i]), std::abs(here.data[0][i]));  // never worse than the start
  }
}

TEST(SurfacePoint, KeepsTheBestPointWhereThereIsNoSurface) {
  // l = 1 + x^2 has no zero; its smallest value is at x = 0.
  const ScalarField l = 1 + square(component(position(), 0));
  const ScalarField after = compose(l, surfacePoint(l));
  EXPECT_LE(after({0.5f, 0, 0}), 1.25f);
}

TEST(SurfacePoint, UsesTheFallbackWhereTheGradientVanishes) {
  const ScalarField s = sphere({0, 0, 0}, 1);
  EXPECT_EQ(surfacePoint(s)({0, 0, 0}), Vec3f{});
  const VectorField fallback = VectorField(Vec3f{0, 1, 0});
  EXPECT_EQ(surfacePoint(s, {.fallback = fallback})({0, 0, 0}), (Vec3f{0, 1, 0}));
  const VectorField y = surfacePoint(s, {.fallback = fallback});
  EXPECT_NEAR(y({0.5f, 0, 0}).x, 1, 1e-5);  // elsewhere the gradient serves
}

TEST(SurfacePoint, PointsThatAreDoneCostNothing) {
  long count = 0;
  const ScalarField l = functionField(
      [&count](const Vec3f& p) {
        ++count;
        return 1 - length(p);
      },
      {.gradient = [](const Vec3f& p) { return -normalize(p); }});
  Points points(200);
  for (std::size_t i = 0; i < 200; ++i) points.set(i, i < 100 ? Vec3f{1, 0, 0} : Vec3f{0, 3, 0});
  test::evaluate(surfacePoint(l), points);
  // 100 points are on the surface: one evaluation. For a distance the others need one step, hence two.
  EXPECT_EQ(count, 100 + 200);
}

TEST(SurfacePoint, SurvivesValuesThatAreNotNumbers) {
  const ScalarField l = functionField([](const Vec3f&) { return std::nanf(""); });
  EXPECT_EQ(surfacePoint(l)({1, 2, 3}), (Vec3f{1, 2, 3}));
  const float inf = std::numeric_limits<float>::infinity();
  EXPECT_NO_THROW(surfacePoint(sphere({0, 0, 0}, 1))({inf, 0, std::nanf("")}));
}

TEST(SurfacePoint, StepsZeroReturnsThePoint) {
  EXPECT_EQ(surfacePoint(sphere({0, 0, 0}, 1), {.steps = 0})({3, 0, 0}), (Vec3f{3, 0, 0}));
}

TEST(SurfacePoint, KeepsWhatEveryFieldPromises) {
  const ScalarField l = blend(sphere({0, 0, 0}, 1), sphere({0.8f, 0, 0}, 0.6f), 0.3f);
  // The result is only as good as the tolerance: differences need a step far above it.
  test::checkField(surfacePoint(l, {.voxel = 1e-3f}), {{0.3f, 0.3f, 0.3f}, {2, 2, 2}}, {.gradient = false});
}

TEST(SurfacePoint, RefusesOptionsOutsideTheirRange) {
  const ScalarField s = sphere({0, 0, 0}, 1);
  EXPECT_THROW(surfacePoint(s, {.steps = -1}), Error);
  EXPECT_THROW(surfacePoint(s, {.voxel = 0.0f}), Error);
  EXPECT_THROW(surfacePoint(s, {.toleranceVoxels = -1}), Error);
}

}  // namespace
}  // namespace nephele

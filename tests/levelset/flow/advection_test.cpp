// Advection of grids: what arrives where, what is lost on the way.
#include "nephele/levelset/flow/advection.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/function_field.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"
#include "nephele/modeling/noise/noise.h"
#include "tests/support/density.h"

namespace nephele::test {
namespace {

using Grid = std::shared_ptr<const BrickGrid>;
using Method = AdvectionMethod;

const Method kMethods[] = {Method::gridless, Method::selma, Method::grid};

/// A ball of density 1 whose edge is `edge` voxels wide.
float softBall(const Vec3f& p, const Vec3f& centre, float radius, float edge) {
  const float t = std::clamp((radius - length(p - centre)) / edge + 0.5f, 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

/// In voxels of 1 about the origin, or as `map` says.
Grid softBallGrid(float radius, const Affine& map = voxels(1), const Vec3f& centre = {}) {
  const float voxel = std::cbrt(std::abs(determinant(map.linear))), edge = 3 * voxel;
  const int n = int(std::ceil((radius + length(centre) + length(map.translation)) / voxel)) + 4;
  return densityGrid(map, {-n, -n, -n}, {n, n, n},
                     [=](const Vec3f& p) { return softBall(p, centre, radius, edge); });
}

template <class Body>
void forVoxels(const BrickGrid& grid, const Body& body) {
  for (int z = 0; z < grid.brickCount().z * 8; ++z)
    for (int y = 0; y < grid.brickCount().y * 8; ++y)
      for (int x = 0; x < grid.brickCount().x * 8; ++x) {
        const Vec3i voxel = grid.firstBrick() * 8 + Vec3i{x, y, z};
        if (grid.poolIndex(brickOf(voxel)) != 0) body(voxel, grid.at(voxel));
      }
}

double mass(const BrickGrid& grid) {
  double sum = 0;
  forVoxels(grid, [&](const Vec3i&, float value) { sum += value; });
  return sum;
}

double denseVolume(const BrickGrid& grid) {
  double count = 0;
  forVoxels(grid, [&](const Vec3i&, float value) { count += value > 0.5f; });
  return count;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Divergence-free, at most about one voxel per step of dt = 1, whirls of some 60 voxels.
VectorField stirring() {
  return curlNoise({.frequency = 1 / 64.0f, .seed = 5}) * ScalarField(0.35f);
}

TEST(Advection, ShiftsGridsByWholeVoxelsExactly) {
  const Grid ball = softBallGrid(10);
  for (const Method method : kMethods) {
    const AdvectedGrids moved =
        advectGrids({ball}, VectorField(Vec3f{4, -2, 0}), {.method = method, .steps = 3, .dt = 0.5f});
    double worst = 0;
    forVoxels(*ball, [&](const Vec3i& v, float value) {
      worst = std::max(worst, double(std::abs(moved.grids[0]->at(v + Vec3i{6, -3, 0}) - value)));
    });
    EXPECT_LT(worst, 1e-5) << int(method);
    EXPECT_NEAR(mass(*moved.grids[0]) / mass(*ball), 1, 1e-6) << int(method);
  }
}

TEST(Advection, ASteadyWindIsTheSameEverywhereInTheMap) {
  // X = x - u t, in any voxels: their faces are no numbers that a float holds, and u along them is zero. Far
  // away, by the origin of the voxels or by their numbers, rounding is a hundredth of a voxel each step.
  constexpr float kVoxel = 0.0195906f;
  constexpr int kSteps = 12;
  const Vec3f u = Vec3f{5.1f, 1.6f, 0} * kVoxel;
  const auto worst = [&](const Affine& map, const Vec3i& middle) {
    const Vec3f centre = map(Vec3f(middle));
    const Vec3i reach{16, 16, 16};
    const Grid ball = densityGrid(map, middle - reach, middle + reach, [&](const Vec3f& p) {
      return softBall(p, centre, 12 * kVoxel, 3 * kVoxel);
    });
    const AdvectedGrids moved = advectGrids({ball}, VectorField(u), {.steps = kSteps, .rebakeShare = {}});
    double most = 0;
    for (int axis = 0; axis < 3; ++axis)
      forVoxels(*moved.map->displacement[std::size_t(axis)], [&](const Vec3i&, float value) {
        most = std::max(most, double(std::abs(value + float(kSteps) * u[axis])) / kVoxel);
      });
    for (const AdvectionStep& step : moved.steps) {
      EXPECT_EQ(step.foldedShare, 0);
      EXPECT_NEAR(double(step.bricks) / double(moved.steps.front().bricks), 1, 0.35);
    }
    EXPECT_NEAR(mass(*moved.grids[0]) / mass(*ball), 1, 1e-3);
    return most;
  };
  EXPECT_LT(worst(voxels(kVoxel), {3, 5, -2}), 1e-3);
  EXPECT_LT(worst({voxels(kVoxel).linear, {2000, -1000, 500}}, {3, 5, -2}), 0.02 * kSteps);
  EXPECT_LT(worst(voxels(kVoxel), {100000, -50000, 20000}), 0.02 * kSteps);
}

TEST(Advection, WithoutStepsChangesNothing) {
  const Grid ball = softBallGrid(9);
  for (const Method method : kMethods) {
    const AdvectedGrids same = advectGrids({ball}, stirring(), {.method = method, .steps = 0});
    forVoxels(*ball, [&](const Vec3i& v, float value) { ASSERT_EQ(same.grids[0]->at(v), value); });
  }
}

TEST(Advection, SelmaMeetsItsBarsAfterSixtySteps) {
  // The bars of section 2.9: dense volume 97 to 103 %, mass within 1 %, median map error 0.1 voxel.
  const Grid ball = softBallGrid(12);
  const VectorField u = stirring();
  const AdvectionOptions options{.steps = 60, .rebakeShare = {}};
  const AdvectedGrids selma = advectGrids({ball}, u, options);
  EXPECT_NEAR(denseVolume(*selma.grids[0]) / denseVolume(*ball), 1, 0.03);
  EXPECT_NEAR(mass(*selma.grids[0]) / mass(*ball), 1, 0.01);

  // What the map should be: the walk through all 60 steps, without grids.
  const VectorField truth = traceBack(u, {.steps = 60}), map = mapField(*selma.map);
  std::vector<double> errors, distances;
  int number = 0;
  forVoxels(*selma.grids[0], [&](const Vec3i& v, float value) {
    if (value < 0.1f || ++number % 7 != 0) return;
    const Vec3f x(v);
    errors.push_back(double(length(map(x) - truth(x))));
    distances.push_back(double(length(truth(x) - x)));
  });
  ASSERT_GT(errors.size(), 1000u);
  EXPECT_LE(median(errors), 0.1);
  // That it was a flow at all: features travelled by many voxels.
  EXPECT_GT(median(distances), 8);

  // The gridded density cannot: it thins out.
  const AdvectedGrids plain = advectGrids(
      {ball}, u, {.method = Method::grid, .scheme = GridScheme::plain, .steps = 60, .rebakeShare = {}});
  EXPECT_LT(denseVolume(*plain.grids[0]), 0.9 * denseVolume(*selma.grids[0]));
}

TEST(Advection, SelmaKeepsItsCostPerStep) {
  // Work and memory follow the bricks kept, not the steps before; counted, not timed. A turn keeps the shape.
  const VectorField turning = functionField([](const Vec3f& p) { return Vec3f{p.z, 0.0f, -p.x} * 0.05f; });
  const AdvectedGrids selma =
      advectGrids({softBallGrid(12, voxels(1), {10, 0, 0})}, turning, {.steps = 30, .rebakeShare = {}});
  ASSERT_EQ(selma.steps.size(), 30u);
  double bricks = 0, bytes = 0;
  for (const AdvectionStep& step : selma.steps) {
    bricks += double(step.bricks) / 30;
    bytes += double(step.memoryBytes) / 30;
  }
  for (const AdvectionStep& step : selma.steps) {
    EXPECT_NEAR(double(step.bricks) / bricks, 1, 0.2);
    EXPECT_NEAR(double(step.memoryBytes) / bytes, 1, 0.2);
  }
}

/// LeVeque's deformation of the unit cube, here of 40 voxels, which runs backwards in its second half.
VectorField deformation(double time, double period) {
  const float scale = 40, share = float(std::cos(M_PI * time / period)) * scale;
  return functionField([=](const Vec3f& p) {
    const auto s = [](float x) { return std::sin(x * float(M_PI)); };
    const float x = p.x / scale, y = p.y / scale, z = p.z / scale;
    return Vec3f{2 * s(x) * s(x) * s(2 * y) * s(2 * z), -s(2 * x) * s(y) * s(y) * s(2 * z),
                 -s(2 * x) * s(2 * y) * s(z) * s(z)} *
           share;
  });
}

TEST(Advection, ComesBackFromDeformationInTheOrderOfTheMethods) {
  // R. LeVeque, High-Resolution Conservative Algorithms for Advection (1996): what is left at the end is the
  // error, since the flow ends where it began.
  const Grid ball = densityGrid(voxels(1), {0, 0, 0}, {40, 40, 40}, [](const Vec3f& p) {
    return softBall(p, {14, 14, 14}, 6, 3);
  });
  constexpr int kSteps = 36;
  constexpr double kPeriod = 1.5;
  const auto error = [&](Method method, GridScheme scheme) {
    const AdvectedGrids result =
        advectGrids({ball}, [&](int step) { return deformation((step + 0.5) * kPeriod / kSteps, kPeriod); },
                    {.method = method,
                     .scheme = scheme,
                     .steps = kSteps,
                     .dt = float(kPeriod / kSteps),
                     .rebakeShare = {}});
    double sum = 0;
    for (int z = 0; z <= 40; ++z)
      for (int y = 0; y <= 40; ++y)
        for (int x = 0; x <= 40; ++x)
          sum += std::abs(double(result.grids[0]->at({x, y, z})) - ball->at({x, y, z}));
    return sum / mass(*ball);
  };
  const double selma = error(Method::selma, {}), plain = error(Method::grid, GridScheme::plain),
               macCormack = error(Method::grid, GridScheme::macCormack),
               bfecc = error(Method::grid, GridScheme::bfecc);
  EXPECT_LT(selma, 0.25 * macCormack);
  EXPECT_LT(macCormack, 0.7 * plain);
  EXPECT_LT(bfecc, 0.7 * plain);
  EXPECT_LT(selma, 0.06);
}

TEST(Advection, IsTheSameForTurnedVoxels) {
  // The same ball and flow, once on voxels that stand askew: equal where interpolation is good.
  const Affine askew{Mat3f::rotation({1, 2, 3}, 0.7f) * Mat3f::scaling(0.9f), {3, -2, 1}};
  const Grid straight = softBallGrid(14, voxels(0.9f)), turned = softBallGrid(14, askew);
  for (const Method method : {Method::gridless, Method::selma}) {
    const AdvectionOptions options{.method = method, .steps = 12};
    const Grid a = advectGrids({straight}, stirring(), options).grids[0];
    const Grid b = advectGrids({turned}, stirring(), options).grids[0];
    EXPECT_NEAR(mass(*b) / mass(*a), 1, 0.003) << int(method);
    const ScalarField fieldA = gridField(a), fieldB = gridField(b);
    std::vector<double> differences;
    forVoxels(*b, [&](const Vec3i& v, float value) {
      if (value > 0.02f && (v.x + v.y + v.z) % 5 == 0) {
        const Vec3f p = b->indexToWorld()(Vec3f(v));
        differences.push_back(double(std::abs(fieldA(p) - value)));
      }
    });
    EXPECT_LT(median(differences), 0.01) << int(method);
  }
}

TEST(Advection, CarriesSeveralGridsOnVoxelsOfTheirOwn) {
  const Grid fine = softBallGrid(10), coarse = softBallGrid(10, voxels(2));
  for (const Method method : kMethods) {
    const AdvectedGrids moved =
        advectGrids({coarse, fine}, VectorField(Vec3f{4, 0, 0}), {.method = method, .steps = 2});
    EXPECT_EQ(moved.grids[0]->voxelSize(), 2);
    double worst = 0;
    forVoxels(*coarse, [&](const Vec3i& v, float value) {
      worst = std::max(worst, double(std::abs(moved.grids[0]->at(v + Vec3i{4, 0, 0}) - value)));
    });
    forVoxels(*fine, [&](const Vec3i& v, float value) {
      worst = std::max(worst, double(std::abs(moved.grids[1]->at(v + Vec3i{8, 0, 0}) - value)));
    });
    EXPECT_LT(worst, 1e-5) << int(method);
  }
}

TEST(Advection, ContinuesAMapAsIfItHadNeverStopped) {
  const Grid ball = softBallGrid(12);
  const AdvectedGrids atOnce = advectGrids({ball}, stirring(), {.steps = 9, .rebakeShare = {}});
  AdvectedGrids frame{{ball}, {}, {}};
  for (int i = 0; i < 3; ++i)
    frame = advectGrids({ball}, stirring(), {.steps = 3, .rebakeShare = {}, .startMap = frame.map});
  EXPECT_EQ(frame.map->bricks, atOnce.map->bricks);
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_EQ(frame.map->displacement[c]->values(), atOnce.map->displacement[c]->values());
  EXPECT_EQ(frame.grids[0]->values(), atOnce.grids[0]->values());
}

TEST(Advection, DoesNotDependOnTheThreads) {
  const Grid ball = softBallGrid(12);
  for (const Method method : kMethods) {
    detail::UnsetVector<float> values[2];
    for (int run = 0; run < 2; ++run) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, run == 0 ? 1 : 4);
      values[run] = advectGrids({ball}, stirring(), {.method = method, .steps = 3}).grids[0]->values();
    }
    EXPECT_EQ(values[0], values[1]) << int(method);
  }
}

TEST(Advection, NeverLeavesTheValuesThatAGridHeld) {
  const Grid ball = softBallGrid(12);
  for (const Method method : kMethods)
    for (const GridScheme scheme : {GridScheme::plain, GridScheme::macCormack, GridScheme::bfecc}) {
      if (method != Method::grid && scheme != GridScheme::plain) continue;
      const Grid moved =
          advectGrids({ball}, stirring(), {.method = method, .scheme = scheme, .steps = 5}).grids[0];
      forVoxels(*moved, [&](const Vec3i&, float value) {
        ASSERT_GE(value, 0);
        ASSERT_LE(value, 1);
      });
    }
}

TEST(Advection, FindsMatterThatJumpsFartherThanItsOwnSize) {
  const Grid ball = softBallGrid(4);
  for (const Method method : kMethods) {
    const Grid moved =
        advectGrids({ball}, VectorField(Vec3f{100, 0, 0}), {.method = method, .steps = 1}).grids[0];
    EXPECT_FLOAT_EQ(moved->at({100, 0, 0}), 1) << int(method);
    EXPECT_EQ(moved->at({0, 0, 0}), 0) << int(method);
  }
}

TEST(Advection, BakesAndStartsAgainWhereTheMapFolds) {
  // A shear that folds: u turns over within a few voxels.
  const VectorField folding = vectorNoise({.frequency = 0.12f, .seed = 2}) * ScalarField(4.0f);
  const Grid ball = softBallGrid(12);
  const AdvectedGrids never = advectGrids({ball}, folding, {.steps = 4, .rebakeShare = {}});
  const AdvectedGrids rebaked = advectGrids({ball}, folding, {.steps = 4, .rebakeShare = 0.05});
  EXPECT_GT(never.steps.back().foldedShare, 0.05);
  EXPECT_TRUE(
      std::any_of(rebaked.steps.begin(), rebaked.steps.end(), [](const auto& s) { return s.rebaked; }));
  EXPECT_FALSE(std::any_of(never.steps.begin(), never.steps.end(), [](const auto& s) { return s.rebaked; }));
  // A shift folds nothing.
  EXPECT_EQ(advectGrids({ball}, VectorField(Vec3f{1, 0, 0}), {.steps = 3}).steps.back().foldedShare, 0);
}

TEST(Advection, ReadsAMapOfLargerVoxelsNearlyAsWell) {
  const Grid ball = softBallGrid(16);
  const Grid fine = advectGrids({ball}, stirring(), {.steps = 10}).grids[0];
  const AdvectedGrids coarse = advectGrids({ball}, stirring(), {.steps = 10, .mapCoarseness = 2});
  EXPECT_NEAR(mass(*coarse.grids[0]) / mass(*fine), 1, 0.01);
  EXPECT_EQ(coarse.map->lattice.voxelSize, 2);
}

TEST(Advection, EndsWhereMatterSpreadsOverMoreThanItMayTake) {
  // Each step makes it half as large again in every direction; the estimate allows for twice the bricks in
  // all.
  const VectorField bursting = position() * ScalarField(0.5f);
  const Grid ball = softBallGrid(8);
  for (const Method method : kMethods) {
    AdvectionOptions options{.method = method, .steps = 4};
    EXPECT_GT(advectGrids({ball}, bursting, options).grids[0]->poolSize(), 8 * ball->poolSize());
    options.mostBytes = estimatedAdvectionBytes({ball}, options);
    try {
      advectGrids({ball}, bursting, options);
      FAIL() << int(method);
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("memory limit"), std::string::npos) << error.what();
    }
    options.steps = 1;
    EXPECT_NO_THROW(advectGrids({ball}, VectorField(Vec3f{0.5f, 1, 0}), options)) << int(method);
  }
}

TEST(Advection, RefusesWhatCannotBe) {
  const Grid ball = softBallGrid(5);
  const VectorField u(Vec3f{1, 0, 0});
  EXPECT_THROW(advectGrids({}, u, {}), Error);
  EXPECT_THROW(advectGrids({ball}, u, {.steps = -1}), Error);
  EXPECT_THROW(advectGrids({ball}, u, {.dt = NAN}), Error);
  EXPECT_THROW(advectGrids({ball}, u, {.dt = INFINITY}), Error);
  EXPECT_THROW(advectGrids({ball}, u, {.mapCoarseness = 0.5f}), Error);
  EXPECT_THROW(advectGrids({ball}, u, {.rebakeShare = 2.0}), Error);
  const Grid empty = densityGrid(voxels(1), {0, 0, 0}, {1, 1, 1}, [](const Vec3f&) { return 0.0f; });
  EXPECT_THROW(advectGrids({empty}, u, {}), Error);
  EXPECT_THROW(estimatedAdvectionBytes({empty}, {}), Error);
  for (const Method method : kMethods) {
    EXPECT_THROW(advectGrids({ball}, VectorField(Vec3f{1e6f, 0, 0}), {.method = method}), Error);
    // Noise far away is 0, where a midpoint might land: still too fast.
    EXPECT_THROW(advectGrids({ball}, curlNoise({.frequency = 0.1f}) * ScalarField(1e20f), {.method = method}),
                 Error);
    EXPECT_THROW(advectGrids({ball}, VectorField(Vec3f{NAN, 0, 0}), {.method = method}), Error);
  }
}

}  // namespace
}  // namespace nephele::test

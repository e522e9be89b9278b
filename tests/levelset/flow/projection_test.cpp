#include "nephele/levelset/flow/projection.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <numbers>
#include <random>

#include "nephele/levelset/grid/grid_field.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/calculus.h"
#include "nephele/modeling/field/function_field.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/noise/noise.h"

namespace nephele {
namespace {

using std::numbers::pi;

/// The unit cube of n^3 cells.
ProjectionBox unitCube(int n, Walls walls) {
  return {Lattice::uniform(1.0f / float(n)), {n, n, n}, walls};
}

VectorField function(std::function<Vec3f(const Vec3f&)> f) {
  return functionField(std::move(f));
}

template <class Visit>
void forSamples(const ProjectionBox& box, const Visit& visit) {
  for (int z = 0; z <= box.cells.z; ++z)
    for (int y = 0; y <= box.cells.y; ++y)
      for (int x = 0; x <= box.cells.x; ++x)
        visit(Vec3i{x, y, z}, box.lattice.indexToWorld(Vec3f(Vec3i{x, y, z})));
}

float fastest(const VectorField& u, const ProjectionBox& box) {
  float most = 0;
  forSamples(box, [&](const Vec3i&, const Vec3f& p) { most = std::max(most, length(u(p))); });
  return most;
}

/// Largest divergence at samples, in units of the largest speed of `before` per cell.
float relativeDivergence(const VectorField& u, const VectorField& before, const ProjectionBox& box) {
  const ScalarField divergence = div(u);
  float most = 0;
  forSamples(box, [&](const Vec3i&, const Vec3f& p) { most = std::max(most, std::abs(divergence(p))); });
  const Mat3f& m = box.lattice.indexToWorld.linear;
  const float edge = length(Vec3f(m(0, 0), m(1, 0), m(2, 0)));
  return most * edge / fastest(before, box);
}

float largestDifference(const VectorField& a, const VectorField& b, const ProjectionBox& box) {
  float most = 0;
  forSamples(box, [&](const Vec3i&, const Vec3f& p) { most = std::max(most, length(a(p) - b(p))); });
  return most;
}

/// Random vectors at the samples, smooth nowhere: the hardest that a grid can hold.
VectorField rough(const ProjectionBox& box) {
  return function([toIndex = box.lattice.worldToIndex](const Vec3f& p) {
    const Vec3f q = toIndex(p);
    std::minstd_rand random(
        unsigned(std::lround(q.x) + 1000 * std::lround(q.y) + 1000000 * std::lround(q.z)) * 2654435761u | 1u);
    random.discard(3);
    std::uniform_real_distribution<float> value(-1, 1);
    const float x = value(random), y = value(random), z = value(random);
    return Vec3f(x, y, z);
  });
}

class ProjectionOfBoth : public testing::TestWithParam<Walls> {};
INSTANTIATE_TEST_SUITE_P(Walls, ProjectionOfBoth, testing::Values(Walls::periodic, Walls::closed),
                         [](const auto& test) {
                           return test.param == Walls::closed ? "closed" : "periodic";
                         });

TEST_P(ProjectionOfBoth, DivergenceIsRounding) {
  for (const int n : {1, 2, 3, 8, 15, 20, 31}) {
    const ProjectionBox box = unitCube(n, GetParam());
    const VectorField u = withoutDivergence(rough(box), box);
    EXPECT_LT(relativeDivergence(u, rough(box), box), 1e-5f) << n;
  }
}

TEST_P(ProjectionOfBoth, BoxesMayBeOblongAndTurned) {
  Affine map{Mat3f::rotation({1, 2, 3}, 0.7f), {3, -2, 1}};
  for (int row = 0; row < 3; ++row) {
    map.linear(row, 0) *= 0.1f;
    map.linear(row, 1) *= 0.2f;
    map.linear(row, 2) *= 0.15f;
  }
  const ProjectionBox box{Lattice::of(map), {12, 7, 10}, GetParam()};
  EXPECT_LT(relativeDivergence(withoutDivergence(rough(box), box), rough(box), box), 1e-5f);
}

TEST_P(ProjectionOfBoth, AgainItChangesNothing) {
  const ProjectionBox box = unitCube(20, GetParam());
  const VectorField once = withoutDivergence(rough(box), box);
  EXPECT_LT(largestDifference(withoutDivergence(once, box), once, box), 1e-5f);
  EXPECT_GT(fastest(once, box), 0.5f);
}

TEST_P(ProjectionOfBoth, IsTheSameAtAnyNumberOfThreads) {
  const ProjectionBox box = unitCube(21, GetParam());
  const VectorField many = withoutDivergence(rough(box), box);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(largestDifference(withoutDivergence(rough(box), box), many, box), 0.0f);
}

TEST_P(ProjectionOfBoth, EndsWhenCancelled) {
  struct Cancelling : Progress {
    bool cancelled() const override { return true; }
  };
  const ProjectionBox box = unitCube(4, GetParam());
  EXPECT_THROW(withoutDivergence(rough(box), box, Cancelling()), Cancelled);
}

// p = cos(2 pi (x + y + z)) periodic, cos(2 pi x) cos(2 pi y) cos(2 pi z) closed: along a diagonal, or with
// equal wave numbers, differences and derivatives are parallel.
TEST(Projection, OfAGradientIsNothing) {
  const ProjectionBox periodic = unitCube(16, Walls::periodic);
  const VectorField wave = function([](const Vec3f& p) {
    const float s = float(-2 * pi * std::sin(2 * pi * double(p.x + p.y + p.z)));
    return Vec3f(s, s, s);
  });
  EXPECT_LT(fastest(withoutDivergence(wave, periodic), periodic), 1e-5f);
  const ProjectionBox closed = unitCube(16, Walls::closed);
  const VectorField standing = function([](const Vec3f& p) {
    const auto s = [](float x) { return std::sin(2 * pi * double(x)); };
    const auto c = [](float x) { return std::cos(2 * pi * double(x)); };
    return Vec3f(float(s(p.x) * c(p.y) * c(p.z)), float(c(p.x) * s(p.y) * c(p.z)),
                 float(c(p.x) * c(p.y) * s(p.z)));
  });
  EXPECT_LT(fastest(withoutDivergence(standing, closed), closed), 1e-5f);
}

// Of other gradients as much is left as differences and derivatives differ: a quarter at half the cell.
TEST(Projection, OfASmoothGradientIsOfSecondOrder) {
  const VectorField gradient = function([](const Vec3f& p) {
    const double a = 2 * pi * double(p.x), b = 2 * pi * double(2 * p.y);
    return Vec3f(float(std::cos(a) * std::sin(b)), float(2 * std::sin(a) * std::cos(b)), 0);
  });
  const auto left = [&](int n) {
    const ProjectionBox box = unitCube(n, Walls::periodic);
    return fastest(withoutDivergence(gradient, box), box);
  };
  EXPECT_NEAR(left(16) / left(32), 4, 0.4);
}

// The curl, by the same differences, of random vectors. Cells are odd, so that no wave has two of them.
TEST(Projection, LeavesACurl) {
  const ProjectionBox box = unitCube(15, Walls::periodic);
  const VectorField potential = rough(box);
  const float cell = 1.0f / 15;
  const VectorField curl = function([&](const Vec3f& p) {
    const auto at = [&](int axis, int step) {
      Vec3i i(Vec3f(std::round(p.x * 15), std::round(p.y * 15), std::round(p.z * 15)));
      i[axis] += step;
      for (int a = 0; a < 3; ++a) i[a] = (i[a] + 15) % 15;
      return potential(box.lattice.indexToWorld(Vec3f(i)));
    };
    const auto along = [&](int axis) { return (at(axis, 1) - at(axis, -1)) / (2 * cell); };
    const Vec3f x = along(0), y = along(1), z = along(2);
    return Vec3f(y.z - z.y, z.x - x.z, x.y - y.x);
  });
  EXPECT_LT(largestDifference(withoutDivergence(curl, box), curl, box), 1e-5f * fastest(curl, box));
}

// Taylor and Green's vortices have no divergence, and none by central differences.
TEST(Projection, LeavesVorticesInAClosedBox) {
  const ProjectionBox box = unitCube(16, Walls::closed);
  const VectorField vortices = function([](const Vec3f& p) {
    const double x = pi * double(p.x), y = 2 * pi / 2 * double(p.y);
    return Vec3f(float(std::sin(x) * std::cos(y)), float(-std::cos(x) * std::sin(y)), 0.0f);
  });
  EXPECT_LT(largestDifference(withoutDivergence(vortices, box), vortices, box), 2e-6f);
}

TEST(Projection, KeepsTheMeanOfAPeriodicBoxOnly) {
  const VectorField wind(Vec3f(1, 2, 3));
  const ProjectionBox periodic = unitCube(9, Walls::periodic), closed = unitCube(9, Walls::closed);
  EXPECT_LT(largestDifference(withoutDivergence(wind, periodic), wind, periodic), 2e-6f);
  EXPECT_LT(fastest(withoutDivergence(wind, closed), closed), 2e-6f);
}

TEST(Projection, NothingFlowsThroughWalls) {
  const ProjectionBox box = unitCube(12, Walls::closed);
  const VectorField u = withoutDivergence(rough(box), box);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> place(0, 1);
  for (int i = 0; i < 1000; ++i)
    for (int axis = 0; axis < 3; ++axis) {
      Vec3f p(place(random), place(random), place(random));
      p[axis] = float(i % 2);
      ASSERT_LT(std::abs(u(p)[axis]), 1e-5f);
    }
  EXPECT_EQ(length(u(Vec3f(1.5f, 0.5f, 0.5f))), 0.0f);
}

TEST(Projection, PeriodicFlowsGoOnBeyondTheFaces) {
  const ProjectionBox box = unitCube(12, Walls::periodic);
  const VectorField u = withoutDivergence(rough(box), box);
  EXPECT_LT(length(u(Vec3f(0, 0.3f, 0.6f)) - u(Vec3f(1, 0.3f, 0.6f))), 1e-4f);
}

TEST(Projection, IsOnGrids) {
  const ProjectionBox box = unitCube(4, Walls::periodic);
  for (const auto& grid : gridsOf(withoutDivergence(VectorField(Vec3f(1, 0, 0)), box))) ASSERT_TRUE(grid);
}

TEST(Projection, RefusesWhatIsNoBoxOrNoVelocity) {
  const VectorField wind(Vec3f(1, 0, 0));
  ProjectionBox box = unitCube(4, Walls::periodic);
  box.cells.y = 0;
  EXPECT_THROW(withoutDivergence(wind, box), Error);
  box.cells = {4, 4, 4};
  EXPECT_THROW(withoutDivergence(VectorField(Vec3f(NAN, 0, 0)), box), Error);
  Affine oblique;
  oblique.linear(0, 1) = 0.5f;
  box.lattice = Lattice::of(oblique);
  EXPECT_THROW(withoutDivergence(wind, box), Error);
}

}  // namespace
}  // namespace nephele

#include "nephele/levelset/grid/grid_field.h"

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <cstring>
#include <limits>

#include "nephele/levelset/grid/grid_kernels.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"
#include "tests/support/brick_grids.h"

namespace nephele {
namespace {

using test::denseGrid;
using test::scatter;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// Points with values and gradients, structure of arrays.
struct Points {
  std::vector<float> x, y, z, value, gx, gy, gz;

  void add(const Vec3f& p) { x.push_back(p.x), y.push_back(p.y), z.push_back(p.z); }
  std::size_t size() const { return x.size(); }
  Vec3f point(std::size_t i) const { return {x[i], y[i], z[i]}; }
  Vec3f gradient(std::size_t i) const { return {gx[i], gy[i], gz[i]}; }
  void evaluate(const ScalarField& field) {
    for (auto* lane : {&value, &gx, &gy, &gz}) lane->assign(size(), 0.0f);
    field.evalGrad({x, y, z}, value, {{gx, gy, gz}});
  }
};

Points randomPoints(int count, const Vec3f& low, const Vec3f& high, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> u(0, 1);
  Points points;
  for (int i = 0; i < count; ++i) {
    const float a = u(random), b = u(random), c = u(random);
    points.add(low + (high - low) * Vec3f{a, b, c});
  }
  return points;
}

/// A turned, scaled and moved map: voxel size 0.1.
Affine turned() {
  return {Mat3f::rotation({1, 2, -1}, 0.7f) * Mat3f::scaling(0.1f), {3, -2, 1}};
}

void expectNear(const Vec3f& a, const Vec3f& b, float tolerance, const char* what) {
  EXPECT_NEAR(a.x, b.x, tolerance) << what;
  EXPECT_NEAR(a.y, b.y, tolerance) << what;
  EXPECT_NEAR(a.z, b.z, tolerance) << what;
}

class EveryTarget : public testing::Test {
 protected:
  void TearDown() override { choose(0); }
  static void choose(std::int64_t target) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  }
};

// The plain loops are the truth; a vector kernel must give its bits on every instruction set this machine
// has.
class EveryTargetAndStorage : public EveryTarget, public testing::WithParamInterface<bool> {};

INSTANTIATE_TEST_SUITE_P(Grids, EveryTargetAndStorage, testing::Values(false, true),
                         [](const auto& storage) { return storage.param ? "Packed" : "Floats"; });

TEST_P(EveryTargetAndStorage, KernelsGiveTheBitsOfThePlainLoops) {
  const std::int64_t targets = hwy::SupportedTargets();
  for (const Affine& map : {Affine{}, Affine{Mat3f::scaling(0.25f), {-1, 2, 0.5f}}, turned()}) {
    const auto grid = denseGrid({-2, -1, 0}, {3, 2, 2}, scatter, map, -0.5f);
    const PackedGrid packed(*grid);
    const GridView view = GetParam() ? GridView(packed) : GridView(*grid);
    Points points;
    for (const Vec3f& q :
         {Vec3f{kNan, 0, 0}, Vec3f{0, kInfinity, 0}, Vec3f{0, 0, -kInfinity}, Vec3f{1e30f, 0, 0},
          Vec3f{-16, -8, 0}, Vec3f{8, 8, 16}, Vec3f{0, 0, -1e-9f}, Vec3f{-1e-9f, 1, 1}, Vec3f{0, 0, 3}})
      points.add(map(q));
    const Points random = randomPoints(247, {-20, -12, -4}, {12, 12, 20});
    for (std::size_t i = 0; i < random.size(); ++i) points.add(map(random.point(i)));
    ASSERT_EQ(points.size(), std::size_t(kBlockSize));
    const PointBlock block{points.x.data(), points.y.data(), points.z.data(), kBlockSize, 1};

    using Lanes = std::array<std::array<float, kBlockSize>, 4>;
    const auto compare = [](const Lanes& a, const Lanes& b) {
      return std::memcmp(&a, &b, sizeof(Lanes)) == 0;
    };
    const auto run = [&](auto kernel, auto gradKernel) {
      std::array<Lanes, 2> result{};
      kernel(view, block, result[0][0].data());
      gradKernel(view, block, result[1][0].data(),
                 {result[1][1].data(), result[1][2].data(), result[1][3].data()});
      return result;
    };
    const auto nearestOf = [&](auto kernel) {
      Lanes result{};
      kernel(view, block, result[0].data());
      return result;
    };
    const Lanes nearest = nearestOf(sampleNearestScalar);
    const auto trilinear = run(sampleTrilinearScalar, sampleTrilinearGradScalar);
    const auto tricubic = run(sampleTricubicScalar, sampleTricubicGradScalar);
    EXPECT_EQ(trilinear[0][0], trilinear[1][0]);
    EXPECT_EQ(tricubic[0][0], tricubic[1][0]);
    for (std::int64_t rest = targets; rest != 0; rest &= rest - 1) {
      choose(rest & -rest);
      EXPECT_TRUE(compare(nearestOf(sampleNearest), nearest)) << hwy::TargetName(rest & -rest);
      const auto vectorTrilinear = run(sampleTrilinear, sampleTrilinearGrad);
      const auto vectorTricubic = run(sampleTricubic, sampleTricubicGrad);
      for (int k = 0; k < 2; ++k) {
        EXPECT_TRUE(compare(vectorTrilinear[k], trilinear[k])) << hwy::TargetName(rest & -rest) << " " << k;
        EXPECT_TRUE(compare(vectorTricubic[k], tricubic[k])) << hwy::TargetName(rest & -rest) << " " << k;
      }
    }
  }
}

TEST(GridField, NearestSampleIsThatOfTheRoundedPosition) {
  // The truth is BrickGrid::at. Packed: within 1/131070 of a brick's range, at most 2 here.
  for (const bool isPacked : {false, true})
    for (const Affine& map : {Affine{}, turned()}) {
      const auto grid = denseGrid({-2, -1, 0}, {3, 2, 2}, scatter, map, -0.5f);
      const PackedGrid packed(*grid);
      const Points random = randomPoints(256, {-20, -12, -4}, {12, 12, 20});
      Points points;
      for (std::size_t i = 0; i < random.size(); ++i) points.add(map(random.point(i)));
      const PointBlock block{points.x.data(), points.y.data(), points.z.data(), kBlockSize, 1};
      std::array<float, kBlockSize> values;
      sampleNearest(isPacked ? GridView(packed) : GridView(*grid), block, values.data());
      int covered = 0;
      for (std::size_t i = 0; i < random.size(); ++i) {
        const Vec3f p = random.point(i);
        const Vec3i voxel{int(std::floor(p.x + 0.5f)), int(std::floor(p.y + 0.5f)),
                          int(std::floor(p.z + 0.5f))};
        EXPECT_NEAR(values[i], grid->at(voxel), isPacked ? 2.0f / 131070 : 0.0f);
        covered += grid->covers(brickOf(voxel));
      }
      EXPECT_GT(covered, 50);
      EXPECT_LT(covered, 250);
    }
}

TEST(GridField, ReproducesAffineFunctionsAndTheirGradient) {
  // f and its gradient are known in closed form; differences are rounding of numbers up to 60 in index space.
  const Vec3f slope{2, -1, 0.5f};
  for (const Affine& map : {Affine{}, Affine{Mat3f::scaling(0.25f), {-1, 2, 0.5f}}, turned()}) {
    const auto grid = denseGrid(
        {-2, -2, -2}, {4, 4, 4}, [&](const Vec3i& v) { return 3 + dot(slope, map(Vec3f(v))); }, map);
    for (const auto interpolation : {Interpolation::trilinear, Interpolation::tricubic}) {
      const ScalarField field = gridField(grid, interpolation);
      Points points = randomPoints(500, {-14, -14, -14}, {13, 13, 13});
      for (std::size_t i = 0; i < points.size(); ++i) {
        const Vec3f p = map(points.point(i));
        points.x[i] = p.x, points.y[i] = p.y, points.z[i] = p.z;
      }
      points.evaluate(field);
      for (std::size_t i = 0; i < points.size(); ++i) {
        EXPECT_NEAR(points.value[i], 3 + dot(slope, points.point(i)), 2e-5f);
        expectNear(points.gradient(i), slope, 2e-4f, "gradient");
      }
    }
  }
}

TEST(GridField, TricubicReproducesQuadratics) {
  // Catmull-Rom slopes are central differences, exact for quadratics; so are trilinear blends of such
  // differences.
  const auto f = [](const auto& p) {
    return 1 + 2 * p.x - p.y + p.x * p.x - 0.5f * p.y * p.y + 0.25f * p.x * p.z + p.y * p.z;
  };
  const auto gradient = [](const Vec3f& p) {
    return Vec3f{2 + 2 * p.x + 0.25f * p.z, -1 - p.y + p.z, 0.25f * p.x + p.y};
  };
  const auto grid = denseGrid({-1, -1, -1}, {2, 2, 2}, [&](const Vec3i& v) { return f(Vec3f(v)); });
  Points cubic = randomPoints(500, {-6, -6, -6}, {5, 5, 5}), linear = cubic;
  cubic.evaluate(gridField(grid, Interpolation::tricubic));
  linear.evaluate(gridField(grid));
  for (std::size_t i = 0; i < cubic.size(); ++i) {
    EXPECT_NEAR(cubic.value[i], f(cubic.point(i)), 1e-4f);
    expectNear(cubic.gradient(i), gradient(cubic.point(i)), 1e-4f, "tricubic");
    expectNear(linear.gradient(i), gradient(linear.point(i)), 1e-4f, "trilinear");
  }
}

TEST(GridField, TricubicIsOffCubicsByTheKnownTerm) {
  // The Hermite form with slopes 3 x^2 + 1 instead of 3 x^2 (voxel 1) is off x^3 by t (1 - t) (1 - 2 t).
  const auto grid = denseGrid({-1, -1, -1}, {2, 2, 2}, [](const Vec3i& v) { return v.x * v.x * v.x; });
  const ScalarField field = gridField(grid, Interpolation::tricubic);
  for (float x = -5; x < 5; x += 0.13f) {
    const float t = x - std::floor(x);
    EXPECT_NEAR(field({x, 0.3f, -0.6f}), x * x * x + t * (1 - t) * (1 - 2 * t), 1e-4f);
  }
}

TEST(GridField, TrilinearGradientIsTheDifferenceOverOneVoxel) {
  for (const Affine& map : {Affine{Mat3f::scaling(0.25f), {-1, 2, 0.5f}}, turned()}) {
    const auto grid = denseGrid({-2, -2, -2}, {4, 4, 4}, scatter, map);
    const ScalarField field = gridField(grid);
    Points points = randomPoints(400, {-14, -14, -14}, {13, 13, 13}, 5);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vec3f p = map(points.point(i));
      points.x[i] = p.x, points.y[i] = p.y, points.z[i] = p.z;
    }
    points.evaluate(field);
    for (std::size_t i = 0; i < points.size(); ++i)
      for (int axis = 0; axis < 3; ++axis) {
        const Vec3f step{map.linear(0, axis), map.linear(1, axis), map.linear(2, axis)};
        const float difference = (field(points.point(i) + step) - field(points.point(i) - step)) / 2;
        // The scattered samples change by up to 2 per voxel; index coordinates are rounded to 2e-6 voxels.
        EXPECT_NEAR(dot(points.gradient(i), step), difference, 2e-4f);
      }
  }
}

TEST(GridField, TricubicGradientIsTheDerivative) {
  const auto grid = denseGrid({-1, -1, -1}, {2, 2, 2}, scatter, turned());
  const ScalarField field = gridField(grid, Interpolation::tricubic);
  Points points;
  const Points indices = randomPoints(400, {-6, -6, -6}, {5, 5, 5}, 6);
  for (std::size_t i = 0; i < indices.size(); ++i) points.add(turned()(indices.point(i)));
  points.evaluate(field);
  for (std::size_t i = 0; i < points.size(); ++i)
    for (int axis = 0; axis < 3; ++axis) {
      // A hundredth of a voxel: the second derivative jumps at cells, by some 10 / voxel^2.
      Vec3f step{};
      step[axis] = 1e-3f;
      const float difference = (field(points.point(i) + step) - field(points.point(i) - step)) / 2e-3f;
      EXPECT_NEAR(points.gradient(i)[axis], difference, 0.3f) << "of gradients up to 20";
    }
}

TEST(GridField, IsContinuousAcrossBricksAndTheEdgeOfTheTable) {
  const auto grid = denseGrid({-1, -1, -1}, {2, 2, 2}, [](const Vec3i& v) {
    const bool edge = std::max({v.x, v.y, v.z}) > 5 || std::min({v.x, v.y, v.z}) < -6;
    return edge ? 0.0f : scatter(v);
  });
  for (const auto interpolation : {Interpolation::trilinear, Interpolation::tricubic}) {
    const ScalarField field = gridField(grid, interpolation);
    for (const float face : {-8.0f, 0.0f, 8.0f})
      for (int axis = 0; axis < 3; ++axis) {
        Points below = randomPoints(200, {-8, -8, -8}, {8, 8, 8}, 7), above = below;
        for (std::size_t i = 0; i < below.size(); ++i) {
          (axis == 0 ? below.x : axis == 1 ? below.y : below.z)[i] = face - 1e-5f;
          (axis == 0 ? above.x : axis == 1 ? above.y : above.z)[i] = face + 1e-5f;
        }
        below.evaluate(field);
        above.evaluate(field);
        for (std::size_t i = 0; i < below.size(); ++i) {
          EXPECT_NEAR(below.value[i], above.value[i], 2e-4f);
          expectNear(below.gradient(i), above.gradient(i), 2e-3f, "gradient");
        }
      }
  }
}

TEST(GridField, KeepsConstantsExactly) {
  const auto grid = denseGrid(
      {0, 0, 0}, {2, 2, 2}, [](const Vec3i&) { return 0.1f; }, turned(), 0.1f);
  for (const auto interpolation : {Interpolation::trilinear, Interpolation::tricubic}) {
    Points points = randomPoints(500, {1, -4, -1}, {5, 0, 3});
    points.evaluate(gridField(grid, interpolation));
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_EQ(points.value[i], 0.1f);
      EXPECT_EQ(points.gradient(i), Vec3f{});
    }
  }
}

TEST(GridField, IsBackgroundOutsideAndWhereCoordinatesAreNotFinite) {
  const auto grid = denseGrid(
      {0, 0, 0}, {1, 1, 1}, [](const Vec3i&) { return 3; }, {}, -2.0f);
  const BrickGrid empty({}, {}, -2.0f);
  for (const auto& g : {std::shared_ptr<const BrickGrid>(grid), std::make_shared<const BrickGrid>(empty)})
    for (const auto interpolation : {Interpolation::trilinear, Interpolation::tricubic}) {
      Points points;
      for (const float v : {kNan, kInfinity, -kInfinity, 1e38f, -1e38f, 3e9f, -0.01f, 8.0f})
        for (int axis = 0; axis < 3; ++axis) {
          Vec3f p{4, 4, 4};
          p[axis] = v;
          points.add(p);
        }
      points.evaluate(gridField(g, interpolation));
      for (std::size_t i = 0; i < points.size(); ++i) {
        EXPECT_EQ(points.value[i], -2.0f);
        EXPECT_EQ(points.gradient(i), Vec3f{});
      }
    }
}

TEST(GridField, RangeContainsSamples) {
  for (const Affine& map : {Affine{Mat3f::scaling(0.25f), {-1, 2, 0.5f}}, turned()}) {
    const auto grid = denseGrid({-3, -3, -3}, {7, 6, 5}, scatter, map, 0.3f);
    for (const auto interpolation : {Interpolation::trilinear, Interpolation::tricubic}) {
      const ScalarField field = gridField(grid, interpolation);
      std::mt19937 random(9);
      std::uniform_real_distribution<float> u(0, 1);
      const Box all = grid->worldBox().expanded(0.5f);
      for (int trial = 0; trial < 40; ++trial) {
        const Vec3f size = all.size() * (trial % 2 ? 0.5f : 0.03f);
        const Vec3f low = all.min + (all.size() - size) * Vec3f{u(random), u(random), u(random)};
        const Interval range = field.range({low, low + size});
        Points points = randomPoints(500, low, low + size, unsigned(trial));
        points.evaluate(field);
        for (const float v : points.value) ASSERT_TRUE(range.contains(v)) << v;
      }
    }
  }
}

TEST(GridField, RangeIsTightAndKeepsZero) {
  const auto grid =
      denseGrid({-4, -1, -1}, {8, 2, 2}, [](const Vec3i& v) { return v.x < 0 ? 0.0f : 1.0f + float(v.x); });
  const ScalarField field = gridField(grid);
  // Bricks from x = 8 on store samples x = 7 to 17 at most, and background at the sides; none are negative.
  const Interval range = field.range({{9, -3, -3}, {12, 3, 3}});
  EXPECT_EQ(range.min, 0.0f);
  EXPECT_NEAR(range.max, 18.0f, 1e-4f);
  EXPECT_EQ(field.range({{-30, -3, -3}, {-20, 3, 3}}), Interval::of(0.0f));
  EXPECT_TRUE(field.range(Box::everywhere()).contains(Interval{0.0f, 32.0f}));
}

TEST(GridField, RestrictsToAConstantWhereAllBricksAreOne) {
  const auto grid = denseGrid({-4, -1, -1}, {8, 2, 2}, [](const Vec3i& v) { return v.x < 0 ? 0.0f : 1.0f; });
  const ScalarField field = gridField(grid);
  const Box zero{{-30, -3, -3}, {-20, 3, 3}}, mixed{{-3, -3, -3}, {3, 3, 3}};
  const ScalarField restricted = field.restrictedTo(zero);
  EXPECT_EQ(gridOf(restricted), nullptr);
  EXPECT_EQ(restricted({-25, 0, 0}), 0.0f);
  EXPECT_EQ(gridOf(field.restrictedTo(mixed)), grid);
}

TEST(GridField, ReadsVoxelsAMillionFromTheOrigin) {
  const int b = 1000000 / 8;
  const auto grid = denseGrid({b, -b, b}, {2, 2, 2}, scatter);
  const ScalarField field = gridField(grid), cubic = gridField(grid, Interpolation::tricubic);
  for (int i = 0; i < 16; ++i) {
    const Vec3i v{8 * b + i, -8 * b + 15 - i, 8 * b + 3};
    EXPECT_EQ(field(Vec3f(v)), scatter(v));
    EXPECT_EQ(cubic(Vec3f(v)), scatter(v));
  }
}

TEST(GridField, AnswersForItsGridAndStep) {
  const auto grid = denseGrid({0, 0, 0}, {1, 1, 1}, scatter, {Mat3f::scaling(0.25f), {}});
  const ScalarField field = gridField(grid);
  EXPECT_EQ(gridOf(field), grid);
  EXPECT_EQ(gridOf(ScalarField(1.0f)), nullptr);
  EXPECT_NEAR(field.differenceStep(), 0.25f, 1e-7f);
}

TEST(GridField, ReadsVectorsComponentByComponent) {
  const auto a = denseGrid({0, 0, 0}, {1, 1, 1}, scatter),
             b = denseGrid({0, 0, 0}, {2, 1, 1}, scatter, turned());
  const auto c = denseGrid({-1, 0, 0}, {1, 1, 1}, scatter, {Mat3f::scaling(2), {}});
  const VectorField field = gridField(VectorGrids{a, b, c});
  const Vec3f p{3.1f, 2.2f, 5.3f};
  EXPECT_EQ(field(p), (Vec3f{gridField(a)(p), gridField(b)(p), gridField(c)(p)}));
  EXPECT_EQ(gridsOf(field), (VectorGrids{a, b, c}));
  EXPECT_EQ(gridsOf(VectorField(Vec3f{})), VectorGrids{});
  EXPECT_NEAR(field.differenceStep(), 0.1f, 1e-6f);
}

TEST(GridField, ReadsPackedGridsWithinTheirRounding) {
  const auto grid = denseGrid({-2, -1, 0}, {3, 2, 2}, scatter, turned(), -0.5f);
  const auto packed = std::make_shared<const PackedGrid>(*grid);
  Points exact, rounded;
  for (std::size_t i = 0; i < 2000; ++i) {
    const Vec3f q = randomPoints(1, {-15, -7, 1}, {7, 7, 15}, unsigned(i)).point(0);
    exact.add(turned()(q)), rounded.add(turned()(q));
  }
  for (const Interpolation interpolation : {Interpolation::trilinear, Interpolation::tricubic}) {
    exact.evaluate(gridField(grid, interpolation));
    rounded.evaluate(gridField(packed, interpolation));
    // scatter lies within [-1, 1], and so do bricks: half a code, times (5/4)^3 for the weights of
    // Catmull-Rom, and float rounding. Slopes take twice that per voxel of 0.1.
    const float step = 2.0f / 131070.0f * 1.96f + 1e-6f;
    for (std::size_t i = 0; i < exact.size(); ++i) {
      ASSERT_NEAR(rounded.value[i], exact.value[i], step);
      ASSERT_LE(length(rounded.gradient(i) - exact.gradient(i)), 2 * step * std::sqrt(3.0f) / 0.1f);
    }
  }
}

TEST(GridField, TakesRangesFromAnotherGrid) {
  const auto grid = denseGrid({0, 0, 0}, {2, 1, 1}, [](const Vec3i& v) { return float(v.x); });
  const ScalarField field = withRangesOf(*grid, dot(position(), VectorField(Vec3f{4, 0, 0})));
  EXPECT_EQ(field({1.5f, 2, 2}), 6.0f);
  // Samples of the first brick, with its border: 0 outside, then 0 to 9.
  EXPECT_EQ(field.range({{1, 1, 1}, {2, 2, 2}}), gridField(grid).range({{1, 1, 1}, {2, 2, 2}}));
  EXPECT_EQ(field.restrictedTo({{1, 1, 1}, {2, 2, 2}})({1.5f, 2, 2}), 6.0f);
}

TEST(GridField, RefusesNoGrid) {
  EXPECT_THROW(gridField(std::shared_ptr<const BrickGrid>()), Error);
  EXPECT_THROW(gridField(std::shared_ptr<const PackedGrid>()), Error);
  EXPECT_THROW(gridField(VectorGrids{}), Error);
}

}  // namespace
}  // namespace nephele

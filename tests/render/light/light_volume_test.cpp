#include "nephele/render/light/light_volume.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/render/scene/lights.h"
#include "tests/support/density.h"
#include "tests/support/each_target.h"

namespace nephele {
namespace {

using test::ball;
using test::densityGrid;
using test::slab;
using test::voxels;

// Length of the way from p to the surface of a ball about the origin.
double wayOut(const Vec3d& p, const Vec3d& towards, double radius) {
  const double b = dot(p, towards);
  return -b + std::sqrt(b * b + radius * radius - dot(p, p));
}

TEST(LightVolume, MeasuresTheDensityBetweenAPointAndTheLight) {
  const float h = 0.04f;
  const RenderVolume volume(ball(1.0f, h, 2.0f));
  // Along axes, in planes, and at the steepest shear.
  for (const Vec3f& towards : {Vec3f{0, 1, 0}, Vec3f{0, 0, -3}, Vec3f{-1, 0, 0}, Vec3f{1, 1, 1},
                               Vec3f{-1, -1, 0.999f}, Vec3f{0.2f, -0.9f, 0.3f}, directionTowards(63, 44)}) {
    const LightVolume light(volume, towards);
    double worst = 0;
    for (int i = 0; i != 400; ++i) {
      const Vec3f p = Vec3f{std::sin(i * 1.3f), std::sin(i * 2.1f + 1), std::cos(i * 0.7f)} * 0.52f;
      const double exact = 2.0 * wayOut(Vec3d(p), normalize(Vec3d(towards)), 1.0);
      worst = std::max(worst, std::fabs(light.columnDensity(p) - exact));
    }
    // Closed form; a voxel's error at the edge of the ball is the discretisation's own.
    EXPECT_LT(worst, 2.0 * 0.5 * h) << towards.x << " " << towards.y << " " << towards.z;
  }
}

TEST(LightVolume, MeasuresTheWayThroughASlab) {
  // 11 voxels of density 1.5. A trapezoid errs by spacing^2 / 8 times the kink of the slope, and a face has
  // two kinks of one per voxel; on the most slanted way samples are 0.375 voxels apart in depth: 0.06 voxels.
  const RenderVolume volume(slab(1.1f, 4.0f, 0.1f, 1.5f));
  for (const float cosine : {1.0f, 0.8f, 0.6f}) {
    const Vec3f towards{std::sqrt(1 - cosine * cosine), 0, cosine};
    const LightVolume light(volume, towards);
    for (const float z : {-0.42f, -0.1f, 0.0f, 0.33f})
      EXPECT_NEAR(light.columnDensity({0.013f, -0.021f, z}), 1.5f * (0.55f - z) / cosine, 1.5f * 0.1f * 0.06f)
          << z << " " << cosine;
  }
}

TEST(LightVolume, InterpolatesBentColumnsAcrossALightAlongAnAxis) {
  // Columns of equal density: each is that, times the length of the way to the upper end, half a voxel of
  // which is the ramp to zero. Between them sqrt(c^2 + 2 a c) is linear.
  const auto densityAt = [](int x, int y) { return 0.5 + 0.5 * std::sin(2.3 * x + 1.7 * y * y); };
  const RenderVolume volume(densityGrid(voxels(1), {-9, -9, -20}, {9, 9, 20}, [&](const Vec3f& p) {
    return float(densityAt(int(std::lround(p.x)), int(std::lround(p.y))));
  }));
  const LightVolume light(volume, {0, 0, 1});
  for (int i = 0; i != 200; ++i) {
    const double x = 6 * std::sin(i * 1.3), y = 6 * std::sin(i * 2.1 + 1);
    const int z = i % 16 - 10, u = int(std::floor(x)), v = int(std::floor(y));
    const double fx = x - u, fy = y - v;
    const double a = light.bend();
    const auto bent = [&](int at, int over) {
      const double column = densityAt(at, over) * (20.5 - z);
      return std::sqrt(column * column + 2 * a * column);
    };
    const double mixed = (1 - fy) * ((1 - fx) * bent(u, v) + fx * bent(u + 1, v)) +
                         fy * ((1 - fx) * bent(u, v + 1) + fx * bent(u + 1, v + 1));
    EXPECT_NEAR(light.columnDensity({float(x), float(y), float(z)}), std::sqrt(mixed * mixed + a * a) - a,
                1e-4)
        << i;
    EXPECT_NEAR(light.columnDensity({float(u), float(v), float(z)}), densityAt(u, v) * (20.5 - z), 1e-4) << i;
  }
}

TEST(LightVolume, CountsDensityAboveTheMostAsThat) {
  // The same as a volume of that density where no voxel has less.
  const RenderVolume dense(slab(1.1f, 4.0f, 0.1f, 1.5f)), thin(slab(1.1f, 4.0f, 0.1f, 0.4f));
  for (const Vec3f& towards : {Vec3f{0, 0, 1}, Vec3f{0.6f, 0, 0.8f}, Vec3f{-0.3f, 0.4f, 0.6f}}) {
    const LightVolume capped(dense, towards, {.most = 0.4f}), light(thin, towards);
    for (const float z : {-0.4f, 0.0f, 0.3f, 0.5f}) {
      const Vec3f p{0.013f, -0.021f, z};
      EXPECT_NEAR(capped.columnDensity(p), light.columnDensity(p), 1e-6f) << z;
    }
  }
}

TEST(LightVolume, BricksAgreeOnTheNodesTheyShare) {
  const auto grid = densityGrid(voxels(1), {-14, -14, -14}, {17, 15, 16}, [](const Vec3f& p) {
    return std::fmax(0.0f, std::sin(0.5f * p.x) * std::cos(0.4f * p.y) + std::sin(0.3f * p.z));
  });
  const RenderVolume volume(grid);
  constexpr int n = LightVolume::kWidth;
  for (const Vec3f& towards : {Vec3f{0.3f, 0.8f, 0.4f}, Vec3f{-1, 0.9f, -0.8f}}) {
    const LightVolume light(volume, towards);
    const Vec3i count = light.brickCount();
    const auto pool = [&](int i, int j, int k) {
      return std::size_t(light.table()[std::size_t((k * count.y + j) * count.x + i)]);
    };
    const auto value = [&](std::size_t brick, int i, int j, int k) {
      return light.values()[brick * LightVolume::kVolume + std::size_t((k * n + j) * n + i)];
    };
    int shared = 0;
    for (int k = 0; k != count.z - 1; ++k)
      for (int j = 0; j != count.y - 1; ++j)
        for (int i = 0; i != count.x - 1; ++i) {
          const std::size_t brick = pool(i, j, k), right = pool(i + 1, j, k), above = pool(i, j + 1, k),
                            next = pool(i, j, k + 1);
          if (!brick) continue;
          for (int a = 0; a != n; ++a)
            for (int b = 0; b != n; ++b) {
              ASSERT_EQ(value(brick, 8, a, b), right ? value(right, 0, a, b) : value(brick, 8, a, b));
              ASSERT_EQ(value(brick, a, 8, b), above ? value(above, a, 0, b) : value(brick, a, 8, b));
              ASSERT_EQ(value(brick, a, b, 8), next ? value(next, a, b, 0) : value(brick, a, b, 8));
              shared += right + above + next > 0;
            }
        }
    EXPECT_GT(shared, 1000);
  }
}

TEST(LightVolume, FollowsRotatedAndStretchedGrids) {
  // The same ball on voxels that are turned, longer than wide, and far from the origin.
  const Vec3f centre{100, -50, 30};
  Affine map{Mat3f::rotation({1, 2, 3}, 0.7f), centre};
  for (int row = 0; row != 3; ++row)
    map.linear(row, 0) *= 0.04f, map.linear(row, 1) *= 0.06f, map.linear(row, 2) *= 0.05f;
  const auto grid = densityGrid(map, {-28, -20, -23}, {28, 20, 23}, [&](const Vec3f& p) {
    const float inside = (1 - length(p - centre)) / 0.05f + 0.5f;
    return std::fmin(std::fmax(inside, 0.0f), 1.0f);
  });
  const RenderVolume volume(grid);
  for (const Vec3f& towards : {Vec3f{0, 1, 0}, Vec3f{1, -1, 0.5f}}) {
    const LightVolume light(volume, towards);
    for (int i = 0; i != 200; ++i) {
      const Vec3f p = Vec3f{std::sin(i * 1.3f), std::sin(i * 2.1f + 1), std::cos(i * 0.7f)} * 0.5f;
      EXPECT_NEAR(light.columnDensity(centre + p), wayOut(Vec3d(p), normalize(Vec3d(towards)), 1.0), 0.02)
          << i;
    }
  }
}

TEST(LightVolume, CrossesEmptyGaps) {
  // Two slabs of 5 voxels with 40 empty ones between them: bricks in the gap are not stored.
  const auto grid = densityGrid(voxels(0.1f), {-60, -60, -25}, {60, 60, 25}, [](const Vec3f& p) {
    return std::fabs(std::fabs(p.z) - 2.2f) < 0.25f ? 1.0f : 0.0f;
  });
  const RenderVolume volume(grid);
  for (const Vec3f& towards : {Vec3f{0, 0, 1}, Vec3f{0.6f, 0, 0.8f}, Vec3f{0, 0.6f, -0.8f}}) {
    const LightVolume light(volume, towards);
    const float below = towards.z > 0 ? -2.2f : 2.2f;
    EXPECT_NEAR(light.columnDensity({0, 0, below}), 0.75f / std::fabs(towards.z), 2e-3f);
    EXPECT_NEAR(light.columnDensity({0, 0, -below}), 0.25f / std::fabs(towards.z), 2e-3f);
  }
}

TEST(LightVolume, IsTheSameBitForBitWithEveryInstructionSet) {
  // Every lane does the same sums in the same order.
  const RenderVolume volume(ball(1.0f, 0.1f, 2.0f));
  const LightVolume widest(volume, {0.4f, -0.8f, 0.3f});
  test::forEachTarget([&] {
    const LightVolume other(volume, {0.4f, -0.8f, 0.3f});
    EXPECT_TRUE(widest.values() == other.values());
  });
}

// Beyond the dark column nothing is told apart; up to it every node is what it is without.
TEST(LightVolume, LeavesOutWhatIsDark) {
  const RenderVolume volume(ball(1, 0.02f));
  for (const Vec3f& towards : {Vec3f{0, 0, 1}, Vec3f{0.4f, -0.8f, 0.3f}}) {
    const LightVolume all(volume, towards);
    const LightVolume lit(volume, towards, LightVolume::Options{.dark = 0.2f});
    // Of the ball, 1 - 3/4 t + t^3 / 16 lies deeper than t: 0.4 behind the 0.85 in which t and bricks that
    // are not known to be full end. Bricks around the ball count, too.
    EXPECT_LT(lit.values().size(), 0.9 * double(all.values().size()));
    int dark = 0;
    for (int i = 0; i != 2000; ++i) {
      const Vec3f p = Vec3f{std::sin(i * 1.3f), std::sin(i * 2.1f + 1), std::cos(i * 0.7f)} * (i / 2000.0f);
      const float whole = all.columnDensity(p), column = lit.columnDensity(p);
      if (column == whole) continue;
      ++dark;
      // A look-up may mix a node of a dark brick with one that it shares with a lit one.
      EXPECT_GE(column, 0.199f) << i;
      EXPECT_GE(whole, 0.19f) << i;
    }
    EXPECT_GT(dark, 200);
  }
  EXPECT_THROW(LightVolume(volume, {0, 0, 1}, LightVolume::Options{.dark = 0}), Error);
}

TEST(LightVolume, KnowsWhereColumnsAreLongForSure) {
  // The column at every place of a box is at least what is said of its corners, but for the mean error that
  // nodes are freed of (a ninth of what a step of density 2 adds), and some boxes of a ball 100 voxels wide
  // are known to be dark.
  const RenderVolume volume(ball(1.0f, 0.02f));
  constexpr float kDark = 0.2f, kFreed = 5e-3f;
  const LightVolume light(volume, {0.3f, 1, 0.2f}, {.dark = kDark});
  int dark = 0;
  for (int i = 0; i != 300; ++i) {
    const Vec3f low = Vec3f{std::sin(i * 1.3f), std::sin(i * 2.1f + 1), std::cos(i * 0.7f)} * 0.9f;
    std::array<Vec3f, 8> corners;
    for (int k = 0; k != 8; ++k)
      corners[std::size_t(k)] = low + Vec3f{float(k & 1), float(k >> 1 & 1), float(k >> 2)} * 0.1f;
    const float least = light.leastColumnDensity(corners);
    dark += least > 0;
    for (const Vec3f& p :
         {low, low + Vec3f{0.05f, 0.05f, 0.05f}, low + Vec3f{0.1f, 0.02f, 0.07f}, corners[7]})
      EXPECT_GE(light.columnDensity(p), least - kFreed);
  }
  EXPECT_GT(dark, 10);
  EXPECT_EQ(LightVolume(volume, {0, 1, 0}).leastColumnDensity(std::array<Vec3f, 1>{}), 0);
}

TEST(LightVolume, RefusesALightFromNowhere) {
  const RenderVolume volume(ball(1.0f, 0.5f));
  EXPECT_THROW(LightVolume(volume, {0, 0, 0}), Error);
  EXPECT_THROW(LightVolume(volume, {NAN, 0, 1}), Error);
}

TEST(LightVolume, IsEmptyForAnEmptyVolume) {
  const RenderVolume volume(densityGrid(voxels(1), {0, 0, 0}, {3, 3, 3}, [](const Vec3f&) { return 0.0f; }));
  EXPECT_EQ(LightVolume(volume, {0, 1, 0}).columnDensity({1, 1, 1}), 0.0f);
}

TEST(LightVolume, StaysWithinItsEstimate) {
  const RenderVolume volume(ball(1.0f, 0.05f));
  for (const Vec3f& towards : {Vec3f{0, 1, 0}, Vec3f{1, 1, 1}, Vec3f{-1, 0.5f, 0.9f}})
    for (const LightVolume::Options& options : {LightVolume::Options{}, {.coded = true}})
      EXPECT_LE(double(LightVolume(volume, towards, options).memoryBytes()),
                LightVolume::estimateBytes(volume, options));
}

TEST(LightVolume, CodesTheSameWhileItWorksAndAfterwards) {
  const RenderVolume volume(ball(1.0f, 0.05f));
  for (const float dark : {0.3f, INFINITY})
    for (const Vec3f& towards : {Vec3f{0, 1, 0}, Vec3f{-0.3f, -0.9f, 0.5f}, Vec3f{0.9f, 0.2f, -0.4f}}) {
      LightVolume after(volume, towards, LightVolume::Options{.dark = dark});
      const LightVolume floats = after, during(volume, towards, {.dark = dark, .coded = true});
      after.code();
      const std::size_t nodes = std::size_t(CodedBricks::kNodes);
      EXPECT_TRUE(during.values().empty());
      ASSERT_EQ(during.table().size(), floats.table().size());
      const std::int32_t lastShared = dark < INFINITY ? 1 : 0;
      std::size_t left = 0;
      for (std::size_t place = 0; place != after.table().size(); ++place) {
        // Of those that take memory, such of one value do not while bricks are worked out.
        const std::int32_t pool = floats.table()[place], own = during.table()[place];
        if (pool > lastShared) {
          const float* values = floats.values().data() + std::size_t(pool) * nodes;
          const auto [least, most] = std::minmax_element(values, values + nodes);
          const bool isEmpty = *least == 0 && *most == 0;
          ASSERT_EQ(own, *least > detail::bentColumn(dark, floats.bend()) ? 1
                         : isEmpty                                        ? 0
                                                                          : std::max(own, lastShared + 1))
              << place;
          left += own <= lastShared;
          if (own <= lastShared) continue;
        } else {
          ASSERT_EQ(own, pool) << place;
        }
        const CodedBricks::Entry &a = after.coded().entries()[place], &b = during.coded().entries()[place];
        ASSERT_EQ(a.unit, b.unit) << place;
        ASSERT_TRUE(std::equal(after.coded().codes() + a.first, after.coded().codes() + a.first + nodes,
                               during.coded().codes() + b.first))
            << place;
      }
      EXPECT_GT(left, dark < INFINITY ? 5u : 0u);
      EXPECT_LT(during.memoryBytes(), after.memoryBytes());
      // Half a unit of a brick's largest column, at most 2.
      for (int i = 0; i != 500; ++i) {
        const Vec3f p = Vec3f{std::sin(i * 1.3f), std::sin(i * 2.1f + 1), std::cos(i * 0.7f)} * (i / 500.0f);
        const float coded = std::min(during.columnDensity(p), dark);
        ASSERT_NEAR(coded, std::min(floats.columnDensity(p), dark), 2 * 0.51 / 57343) << i;
      }
    }
}

TEST(LightVolume, AddsTheShadowOfThingsToWhatIsBehindThem) {
  // Stretched and turned, so that no axis is another's. The ball stands half in the density.
  Affine map{Mat3f::rotation({1, 2, 3}, 0.7f), {5, 0, 0}};
  for (int row = 0; row != 3; ++row)
    map.linear(row, 0) *= 0.04f, map.linear(row, 1) *= 0.06f, map.linear(row, 2) *= 0.05f;
  const RenderVolume volume(
      densityGrid(map, {-20, -16, -18}, {20, 16, 18}, [](const Vec3f&) { return 0.5f; }));
  const Vec3d centre{5.05, 0.1, 0.05};
  const double radius = 0.35;
  const Box box{Vec3f(centre) - Vec3f{1, 1, 1} * 0.35f, Vec3f(centre) + Vec3f{1, 1, 1} * 0.35f};
  for (const Vec3f& towards : {Vec3f{0, 2, 0}, Vec3f{0, 0, -3}, Vec3f{1, 1, 1}, Vec3f{-0.2f, -0.9f, 0.3f}}) {
    const LightVolume bare(volume, towards);
    LightVolume shaded = bare;
    shaded.addShade(
        [&](const Ray& ray) { return test::distanceToBall(ray.origin, ray.direction, centre, radius); }, box,
        towards, 0.1f);
    int lit = 0, dark = 0;
    for (int i = 0; i != 4000; ++i) {
      const Vec3f p =
          Vec3f{5, 0, 0} + Vec3f{std::sin(i * 1.3f), std::sin(i * 2.1f + 1), std::cos(i * 0.7f)} * 0.6f;
      const float added = shaded.columnDensity(p) - bare.columnDensity(p);
      // What a ray from p meets on its way to the light, for balls larger and smaller by a cell of
      // the sheared lattice: the square root of 6 voxels of 0.06.
      const auto isHidden = [&](double r) {
        const Vec3d way = normalize(Vec3d(towards));
        return length(Vec3d(p) - centre) < r || std::isfinite(test::distanceToBall(Vec3d(p), way, centre, r));
      };
      if (!isHidden(radius + 0.15)) {
        EXPECT_EQ(added, 0.0f) << i;
        ++lit;
      } else if (isHidden(radius - 0.15)) {
        EXPECT_NEAR(added, detail::kDark * 0.1f, 1e-4f) << i;
        ++dark;
      } else {
        EXPECT_GE(added, -1e-5f);
        EXPECT_LE(added, detail::kDark * 0.1f + 1e-4f);
      }
    }
    EXPECT_GT(lit, 500);
    EXPECT_GT(dark, 50);
  }
}

}  // namespace
}  // namespace nephele

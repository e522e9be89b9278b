// Dots on grids: mass, place, size, smear, colour, order.
#include "nephele/levelset/cloud/dot_volume.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <limits>
#include <random>

#include "nephele/levelset/io/vdb_io.h"

namespace nephele::test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

/// Mass, centroid and variance along each axis of what a volume holds, within `low` to `high` voxels.
struct Moments {
  double mass = 0;
  Vec3d center{}, variance{};
  int voxels = 0;
};

Moments momentsOf(const DotVolume& volume, double voxelSize, int low, int high) {
  Moments m;
  Vec3d first{}, second{};
  for (int x = low; x <= high; ++x)
    for (int y = low; y <= high; ++y)
      for (int z = low; z <= high; ++z) {
        const double density = double(volume.density({x, y, z}));
        if (density == 0) continue;
        ++m.voxels;
        const Vec3d p = Vec3d(Vec3i{x, y, z}) * voxelSize;
        m.mass += density;
        first += p * density;
        second += p * p * density;
      }
  m.center = first / m.mass;
  m.variance = second / m.mass - m.center * m.center;
  m.mass *= voxelSize * voxelSize * voxelSize;
  return m;
}

Dots randomDots(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> place(-2, 2), share(0, 1);
  Dots dots;
  for (std::size_t i = 0; i < count; ++i) {
    dots.positions.push_back({place(random), place(random), place(random)});
    dots.masses.push_back(share(random));
    dots.radii.push_back(0.3f * share(random) * share(random));
    dots.colors.push_back({share(random), share(random), share(random)});
    dots.velocities.push_back({place(random), place(random), place(random)});
  }
  return dots;
}

TEST(DotVolume, SmallDotHasTrilinearWeights) {
  // By hand: shares of 1/4, 1/2 and 3/4 of a voxel beyond voxel (1, -2, 0), times 3 / 0.5^3.
  DotVolume volume({.voxelSize = 0.5f});
  const Vec3f p{0.625f, -0.75f, 0.375f};
  const float mass = 3;
  volume.add({.positions = {&p, 1}, .masses = {&mass, 1}});
  for (int x = 0; x < 2; ++x)
    for (int y = 0; y < 2; ++y)
      for (int z = 0; z < 2; ++z)
        EXPECT_FLOAT_EQ(volume.density({1 + x, -2 + y, z}),
                        24 * (x ? 0.25f : 0.75f) * 0.5f * (z ? 0.75f : 0.25f));
  EXPECT_EQ(momentsOf(volume, 0.5, -20, 20).voxels, 8);
  EXPECT_EQ(volume.dotCount(), 1u);
  EXPECT_EQ(volume.mass(), 3);
}

TEST(DotVolume, KeepsMassAndPlaceOfADotOfAnySize) {
  // Trilinear weights and symmetric kernels keep both exactly; what is left are roundings of single
  // precision.
  std::mt19937 random(5);
  std::uniform_real_distribution<float> place(-1, 1);
  for (const float radius : {0.0f, 1e-6f, 0.05f, 0.1f, 0.11f, 0.25f, 0.4f, 1.3f})
    for (int i = 0; i < 5; ++i) {
      const Vec3f p{place(random), place(random), place(random)};
      const float mass = 0.37f;
      DotVolume volume({.voxelSize = 0.1f});
      volume.add({.positions = {&p, 1}, .masses = {&mass, 1}, .radii = {&radius, 1}});
      const Moments m = momentsOf(volume, double(0.1f), -30, 30);
      EXPECT_NEAR(m.mass, double(mass), 1e-6) << radius;
      for (int a = 0; a < 3; ++a) EXPECT_NEAR(m.center[a], double(p[a]), 1e-6) << radius;
    }
}

TEST(DotVolume, LargeDotIsAsWideAsASpline) {
  // A cubic B-spline of support [-r, r] has the variance r^2 / 12; the trilinear weights add f (1 - f), here
  // 0.
  const Vec3f p{0, 0, 0};
  for (const float radius : {4.0f, 8.0f, 20.0f}) {
    DotVolume volume({.voxelSize = 1, .radius = radius});
    volume.add({.positions = {&p, 1}});
    const Moments m = momentsOf(volume, 1, -25, 25);
    for (int a = 0; a < 3; ++a) EXPECT_NEAR(m.variance[a] / double(radius * radius / 12), 1, 0.001) << radius;
    EXPECT_FLOAT_EQ(volume.density({1, 2, 3}), volume.density({-3, 1, -2}));
  }
}

TEST(DotVolume, GrowsSmoothlyOutOfASmallDot) {
  // Just above a voxel's radius the blur is still next to nothing.
  const Vec3f p{0.3f, 0.4f, 0.45f};
  DotVolume small({.voxelSize = 1, .radius = 1}), larger({.voxelSize = 1, .radius = 1.01f});
  small.add({.positions = {&p, 1}});
  larger.add({.positions = {&p, 1}});
  for (int x = -3; x <= 3; ++x)
    for (int y = -3; y <= 3; ++y)
      for (int z = -3; z <= 3; ++z) EXPECT_NEAR(small.density({x, y, z}), larger.density({x, y, z}), 1e-4);
}

TEST(DotVolume, TotalMassIsThatOfAllDots) {
  Dots dots = randomDots(20000, 2);
  DotVolume volume({.voxelSize = 0.07f, .shutterOpen = -0.1f, .shutterClose = 0.2f});
  volume.add(dots);
  double sum = 0;
  for (const float m : dots.masses) sum += double(m);
  EXPECT_DOUBLE_EQ(volume.mass(), sum);
  EXPECT_NEAR(momentsOf(volume, double(0.07f), -50, 50).mass / sum, 1, 1e-6);
}

TEST(DotVolume, DensityDoesNotDependOnTheVoxelSize) {
  // 30 dots per voxel in a unit cube: density 1 in it at any voxel size, but for chance, 1 / sqrt(64 * 30).
  std::mt19937 random(1);
  std::uniform_real_distribution<float> place(0, 1);
  Dots dots;
  for (int i = 0; i < 240000; ++i) dots.positions.push_back({place(random), place(random), place(random)});
  dots.masses.assign(dots.size(), 1.0f / float(dots.size()));
  for (const float voxel : {0.05f, 0.1f}) {
    DotVolume volume({.voxelSize = voxel});
    volume.add(dots);
    double sum = 0;
    const int middle = int(std::lround(0.5f / voxel));
    for (int x = -2; x < 2; ++x)
      for (int y = -2; y < 2; ++y)
        for (int z = -2; z < 2; ++z) sum += double(volume.density({middle + x, middle + y, middle + z})) / 64;
    EXPECT_NEAR(sum, 1, 0.07) << voxel;
  }
}

TEST(DotVolume, SmearKeepsMassAndMiddleAndHasItsLength) {
  // A line of length L has the variance L^2 / 12 along itself. Weights of voxels add at most 1/4 voxel^2 per
  // axis, and at a right angle to the line that is all.
  const Vec3f p{0.13f, -0.21f, 0.37f}, v{30, 0, 0};
  DotVolume along({.voxelSize = 1, .shutterOpen = -0.2f, .shutterClose = 0.6f});
  along.add({.positions = {&p, 1}, .velocities = {&v, 1}});
  const Moments m = momentsOf(along, 1, -40, 40);
  EXPECT_NEAR(m.mass, 1, 1e-5);
  EXPECT_NEAR(m.center.x, 0.13 + 30 * 0.2, 1e-4);
  EXPECT_NEAR(m.center.y, -0.21, 1e-5);
  EXPECT_NEAR(m.variance.x, 24.0 * 24 / 12, 0.25);
  EXPECT_LE(m.variance.y, 0.25);
  // From 0.13 - 6 to 0.13 + 18, and the voxels around.
  EXPECT_EQ(along.density({-7, 0, 0}), 0);
  EXPECT_GT(along.density({-5, 0, 0}), 0);
  EXPECT_GT(along.density({18, 0, 0}), 0);
  EXPECT_EQ(along.density({20, 0, 0}), 0);
  // Evenly dense along the way.
  for (int x = -3; x < 16; ++x)
    EXPECT_NEAR(along.density({x, 0, 0}) / along.density({x + 1, 0, 0}), 1, 0.05) << x;

  const Vec3f aslant{6, 8, -5};
  DotVolume volume({.voxelSize = 1, .shutterClose = 2});
  volume.add({.positions = {&p, 1}, .velocities = {&aslant, 1}});
  const Moments n = momentsOf(volume, 1, -40, 40);
  EXPECT_NEAR(n.mass, 1, 1e-5);
  for (int a = 0; a < 3; ++a) {
    EXPECT_NEAR(n.center[a], double(p[a] + aslant[a]), 1e-4);
    EXPECT_NEAR(n.variance[a], std::pow(2 * double(aslant[a]), 2) / 12, 0.25);
  }
}

TEST(DotVolume, DotsAtRestAreNotSmeared) {
  const Vec3f p[2] = {{0.5f, 0, 0}, {3, 3, 3}}, v[2] = {{0, 0, 0}, {1e-30f, 0, 0}};
  DotVolume still({.voxelSize = 1}), smeared({.voxelSize = 1, .shutterOpen = -1, .shutterClose = 1});
  still.add({.positions = p});
  smeared.add({.positions = p, .velocities = v});
  for (int x = -2; x <= 5; ++x)
    for (int y = -2; y <= 5; ++y) EXPECT_FLOAT_EQ(still.density({x, y, y}), smeared.density({x, y, y}));
}

TEST(DotVolume, ColourIsTheMeanByMass) {
  const Vec3f p[2] = {{0, 0, 0}, {0, 0, 0}}, colors[2] = {{1, 0, 0}, {0, 1, 0.5f}};
  const float masses[2] = {1, 3};
  DotVolume volume({.voxelSize = 1, .withColor = true});
  volume.add({.positions = p, .masses = masses, .colors = colors});
  EXPECT_EQ(volume.density({0, 0, 0}), 4);
  EXPECT_EQ(volume.color({0, 0, 0}), (Vec3f{0.25f, 0.75f, 0.375f}));
  EXPECT_EQ(volume.color({5, 0, 0}), Vec3f{});
  const VoxelGrid<Vec3f> grid = volume.colorGrid();
  EXPECT_FLOAT_EQ(grid.at({0, 0, 0}).y, 0.75f);
  // Beside it, in the same brick, there is colour to interpolate with.
  EXPECT_FLOAT_EQ(grid.at({1, 0, 0}).y, 0.75f);
  EXPECT_EQ(grid.at({-1, 0, 0}), Vec3f{});
}

TEST(DotVolume, ColourDoesNotChangeTheDensity) {
  const Dots dots = randomDots(3000, 8);
  DotVolume with({.voxelSize = 0.1f, .withColor = true}), without({.voxelSize = 0.1f});
  with.add(dots);
  without.add(dots);
  EXPECT_EQ(toBricks(with.densityGrid())->values(), toBricks(without.densityGrid())->values());
}

TEST(DotVolume, IsTheSameAtAnyThreadCountAndInAnyParts) {
  const Dots dots = randomDots(8000, 4);
  const DotVolumeOptions options{
      .voxelSize = 0.05f, .shutterOpen = -0.5f, .shutterClose = 0.5f, .withColor = true};
  const auto grown = [&](std::size_t threads, std::size_t part) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    DotVolume volume(options);
    for (std::size_t i = 0; i < dots.size(); i += part)
      volume.add(DotSpans(dots).part(i, std::min(part, dots.size() - i)));
    const auto blue = vectorComponents(toVdb(volume.colorGrid(), {"Cd"}))[2];
    return std::pair(toBricks(volume.densityGrid())->values(), toBricks(blue)->values());
  };
  const auto one = grown(1, dots.size());
  EXPECT_EQ(one, grown(4, dots.size()));
  EXPECT_EQ(one, grown(3, 1777));
}

TEST(DotVolume, WritesFogOfTheSameValues) {
  const Dots dots = randomDots(500, 6);
  DotVolume volume({.voxelSize = 0.1f});
  volume.add(dots);
  const VdbGrid grid = toVdb(volume.densityGrid(), {"smoke", VdbGridInfo::Class::fogVolume, true});
  const VdbGridInfo info = describe(grid);
  EXPECT_EQ(info.name, "smoke");
  EXPECT_EQ(info.gridClass, VdbGridInfo::Class::fogVolume);
  EXPECT_TRUE(info.halfFloat);
  EXPECT_EQ(info.background, 0);
  EXPECT_FLOAT_EQ(info.voxelSize.y, 0.1f);
  const auto bricks = toBricks(grid);
  int active = 0;
  for (int x = -40; x <= 40; ++x)
    for (int y = -40; y <= 40; ++y)
      for (int z = -40; z <= 40; ++z) {
        ASSERT_EQ(bricks->at({x, y, z}), volume.density({x, y, z}));
        active += volume.density({x, y, z}) > 0;
      }
  EXPECT_EQ(info.activeVoxels, std::uint64_t(active));
}

TEST(DotVolume, NothingAddedIsAnEmptyGrid) {
  DotVolume volume({.voxelSize = 1, .withColor = true});
  volume.add(Dots{});
  EXPECT_EQ(volume.brickCount(), 0u);
  EXPECT_EQ(describe(toVdb(volume.densityGrid(), {"density"})).activeVoxels, 0u);
  EXPECT_EQ(describe(toVdb(volume.colorGrid(), {"Cd"})).activeVoxels, 0u);
}

TEST(DotVolume, FarApartDotsCostTheTableBetweenThemOnly) {
  DotVolume volume({.voxelSize = 1});
  const Vec3f p[2] = {{-1000.25f, 0, 0}, {1000.25f, 900, 5}};
  volume.add({.positions = {p, 1}});
  volume.add({.positions = {p + 1, 1}});
  EXPECT_EQ(volume.density({-1000, 0, 0}), 0.75f);
  EXPECT_EQ(volume.density({1000, 900, 5}), 0.75f);
  EXPECT_LE(volume.brickCount(), 8u);
}

TEST(DotVolume, LandsInTheRightVoxelFarFromTheOrigin) {
  // At 1e5 single precision resolves 2^-7. In voxels of 0.01 these are 0.78 voxels apart, and the place of
  // each, computed here in double precision, tells the two voxels along x that share it; the other axes are
  // at 0.
  constexpr float kVoxel = 0.01f;
  for (int i = 0; i < 40; ++i) {
    const Vec3f p{1e5f + float(i) / 128, 0, 0};
    DotVolume volume({.voxelSize = kVoxel});
    volume.add({.positions = {&p, 1}});
    const double q = double(p.x) / double(kVoxel), share = q - std::floor(q);
    const int voxel = int(std::floor(q));
    const double all = 1 / (double(kVoxel) * double(kVoxel) * double(kVoxel));
    EXPECT_NEAR(double(volume.density({voxel, 0, 0})) / all, 1 - share, 1e-5) << i;
    EXPECT_NEAR(double(volume.density({voxel + 1, 0, 0})) / all, share, 1e-5) << i;
  }
}

TEST(DotVolume, SmearsEvenlyFarFromTheOrigin) {
  // A smear of 2 units over whole voxels of 1/128: every voxel between its ends has the same share of the
  // mass.
  constexpr float kVoxel = 1.0f / 128;
  const Vec3f p{1e5f, 0, 0}, v{2, 0, 0};
  DotVolume volume({.voxelSize = kVoxel, .shutterClose = 1});
  volume.add({.positions = {&p, 1}, .velocities = {&v, 1}});
  const double each = 1.0 / 256 * std::pow(128.0, 3);
  for (int i = 1; i < 256; ++i)
    EXPECT_NEAR(double(volume.density({12800000 + i, 0, 0})) / each, 1.0, 1e-4) << i;
}

TEST(DotVolume, CostsLittleForTheRoomBetweenDots) {
  // Two dots at the ends of 10^8 bricks.
  DotVolume volume({.voxelSize = 1});
  const Vec3f p[2] = {{0, 0, 0}, {3600, 3600, 3600}};
  volume.add({.positions = p});
  EXPECT_LE(volume.brickCount(), 2u);
  EXPECT_LT(volume.memoryBytes(), std::size_t(4) << 20);
}

TEST(DotVolume, RefusesWhatIsNoDot) {
  const auto said = [](const auto& body) {
    try {
      body();
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("nothing");
  };
  const auto refused = [&](const Dots& dots, const DotVolumeOptions& options, const std::string& text) {
    DotVolume volume(options);
    const std::string message = said([&] { volume.add(dots); });
    EXPECT_NE(message.find(text), std::string::npos) << message;
    EXPECT_EQ(volume.brickCount(), 0u);
    EXPECT_EQ(volume.dotCount(), 0u);
  };
  const Vec3f zero{};
  const std::vector<Vec3f> two{zero, zero};
  refused({.positions = {zero, {0, kNan, 0}}}, {.voxelSize = 1}, "dot 1 has the position 0,nan,0");
  refused({.positions = {{kInf, 0, 0}}}, {.voxelSize = 1}, "dot 0 has the position inf,0,0");
  refused({.positions = two, .masses = {1, -1}}, {.voxelSize = 1}, "dot 1 has the mass -1");
  refused({.positions = two, .masses = {kNan, 1}}, {.voxelSize = 1}, "dot 0 has the mass nan");
  refused({.positions = two, .masses = {1}}, {.voxelSize = 1}, "masses must be empty or as many as the 2");
  refused({.positions = two, .radii = {0, 65}}, {.voxelSize = 1},
          "dot 1 has the radius 65, allowed: 0 to 64");
  refused({.positions = two, .radii = {0, -1}}, {.voxelSize = 1}, "dot 1 has the radius -1");
  refused({.positions = two, .colors = {zero, {kNan, 0, 0}}}, {.voxelSize = 1}, "dot 1 has the colour");
  refused({.positions = two, .velocities = {zero, {kInf, 0, 0}}}, {.voxelSize = 1}, "dot 1 has the velocity");
  refused({.positions = two, .velocities = {zero, {1e6f, 0, 0}}}, {.voxelSize = 1, .shutterClose = 1},
          "smeared over 1e+06 voxels, allowed: up to 16384");
  refused({.positions = {{1e10f, 0, 0}}}, {.voxelSize = 1}, "voxels from the origin");
  refused({.positions = {{-1e6f, -1e6f, -1e6f}, {1e6f, 1e6f, 1e6f}}}, {.voxelSize = 1},
          "more than can be held");
  EXPECT_NE(said([] { DotVolume({}); }).find("voxels may be from 1e-12"), std::string::npos);
  EXPECT_NE(said([] { DotVolume({.voxelSize = kNan}); }).find("voxels may be from 1e-12"), std::string::npos);
  EXPECT_NE(said([] { DotVolume({.voxelSize = 1, .radius = 65}); }).find("radius must be"),
            std::string::npos);
  EXPECT_NE(said([] { DotVolume({.voxelSize = 1, .shutterOpen = 1}); }).find("shutter"), std::string::npos);
}

TEST(DotVolume, StopsWhenCancelled) {
  class Stop : public Progress {
    bool cancelled() const override { return true; }
  };
  DotVolume volume({.voxelSize = 0.1f});
  EXPECT_THROW(volume.add(randomDots(10, 1), Stop()), Cancelled);
}

TEST(DotVolume, EstimateIsAboveWhatIsHeld) {
  const Dots dots = randomDots(50000, 9);
  for (const bool color : {false, true}) {
    DotVolume volume({.voxelSize = 0.02f, .radius = 0, .withColor = color});
    Dots small = dots;
    small.radii.clear();
    volume.add(small);
    const double estimate =
        estimatedDotVolumeBytes({{-2, -2, -2}, {2, 2, 2}}, double(volume.brickCount()), double(dots.size()),
                                {.voxelSize = 0.02f, .withColor = color});
    EXPECT_GE(estimate, 0.8 * double(volume.memoryBytes()));
    EXPECT_LE(estimate, 2 * double(volume.memoryBytes()));
  }
}

}  // namespace
}  // namespace nephele::test

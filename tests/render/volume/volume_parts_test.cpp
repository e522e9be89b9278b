#include "nephele/render/volume/volume_parts.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <array>
#include <cmath>
#include <limits>

#include "nephele/modeling/base/error.h"
#include "nephele/render/march/raymarch.h"
#include "nephele/render/scene/black_body.h"
#include "nephele/render/volume/trilinear.h"
#include "tests/support/density.h"

namespace nephele {
namespace {

using test::ball;
using test::densityGrid;
using test::voxels;

float billows(const Vec3f& p) {
  return length(p) < 1.2f ? std::fmax(0.0f, std::sin(5 * p.x) * std::cos(4 * p.y) + std::sin(6 * p.z)) : 0;
}

std::shared_ptr<BrickGrid> where(const std::function<bool(const Vec3f&)>& inside, float factor = 1) {
  return densityGrid(voxels(0.1f), {-14, -14, -14}, {14, 14, 14},
                     [&](const Vec3f& p) { return inside(p) ? factor * billows(p) : 0.0f; });
}

VolumePart part(std::shared_ptr<const BrickGrid> density, float share = 1) {
  VolumePart result;
  result.density = std::move(density);
  result.share = share;
  return result;
}

Image look(const RenderVolume& volume) {
  const Camera camera = Camera::lookingAt({3, 2, 5}, {0, 0, 0}, {0, 1, 0}, {24, 16, 40});
  Medium medium;
  medium.extinction = 4;
  return renderImage(volume, medium, {{{"sun", {0.5f, 0.7f, 0.5f}, {3, 3, 3}}}, {0.2f, 0.3f, 0.4f}}, camera)
      .image;
}

float difference(const Image& a, const Image& b) {
  float most = 0;
  for (const char* name : {"R", "G", "B", "A"})
    for (std::size_t i = 0; i != a.channel(name).values.size(); ++i)
      most = std::max(most, std::fabs(a.channel(name).values[i] - b.channel(name).values[i]));
  return most;
}

// Bit for bit, at every voxel of the box that both are in.
void expectSameDensity(const RenderVolume& a, const RenderVolume& b) {
  for (int z = -20; z <= 20; ++z)
    for (int y = -20; y <= 20; ++y)
      for (int x = -20; x <= 20; ++x) ASSERT_EQ(a.density().at({x, y, z}), b.density().at({x, y, z}));
}

TEST(VolumeParts, OnePartIsReturnedAsItIs) {
  const auto grid = ball(1, 0.1f);
  EXPECT_EQ(&combine({part(grid)}).density(), grid.get());
}

TEST(VolumeParts, TwoHalvesAreTheWhole) {
  const auto whole = where([](const Vec3f&) { return true; });
  const RenderVolume combined = combine({part(where([](const Vec3f& p) { return p.x < 0.3f; })),
                                         part(where([](const Vec3f& p) { return !(p.x < 0.3f); }))});
  expectSameDensity(combined, RenderVolume(whole));
  EXPECT_EQ(difference(look(combined), look(RenderVolume(whole))), 0.0f);
}

TEST(VolumeParts, TwiceTheSameIsTwiceTheDensity) {
  const auto all = [](const Vec3f&) { return true; };
  const RenderVolume combined = combine({part(where(all)), part(where(all))}), twice(where(all, 2));
  expectSameDensity(combined, twice);
  expectSameDensity(combine({part(where(all), 2)}), twice);
  EXPECT_EQ(difference(look(combined), look(twice)), 0.0f);
}

TEST(VolumeParts, OrderDoesNotMatter) {
  const auto a = part(ball(1, 0.1f, 0.7f)), b = part(ball(0.6f, 0.07f, 0.4f), 1.5f),
             c = part(where([](const Vec3f&p) { return p.y > 0; }));
  const Image first = look(combine({a, b, c})), second = look(combine({c, b, a}));
  // Sums of three differ by their rounding.
  EXPECT_LT(difference(first, second), 1e-5f);
}

TEST(VolumeParts, OverlappingSlabsAddTheirOpticalDepths) {
  // Voxel sizes 0.1 and 0.0625, both slabs 2 thick and centred: exp(-k (a 2 + b 2)).
  const auto slabOf = [](float h, float value) {
    const int n = int(3 / h), m = int(1.5f / h);
    return densityGrid(voxels(h), {-n, -n, -m}, {n, n, m}, [=](const Vec3f& p) {
      return value * std::fmin(1.0f, std::fmax(0.0f, (1 - std::fabs(p.z)) / h + 0.5f));
    });
  };
  const RenderVolume volume = combine({part(slabOf(0.1f, 0.7f)), part(slabOf(0.0625f, 0.4f), 0.5f)});
  EXPECT_FLOAT_EQ(volume.density().voxelSize(), 0.0625f);
  const Camera camera = Camera::lookingAt({0, 0, 9}, {0, 0, 0}, {0, 1, 0}, {1, 1, 0.001f});
  Medium medium;
  medium.extinction = 0.8f;
  const float alpha = renderImage(volume, medium, {}, camera).image.at("A", 0, 0);
  EXPECT_NEAR(1 - alpha, std::exp(-0.8f * (0.7f + 0.2f) * 2), 2e-3f);
}

TEST(VolumeParts, TurnedAndStretchedGridsStandWhereTheyAre) {
  // A ball in a grid that is turned, stretched to voxels of 0.08 x 0.1 x 0.05 and moved: the mass is that of
  // the ball, 4/3 pi r^3 value, and its centre at the ball's.
  const float c = std::cos(0.5f), s = std::sin(0.5f);
  Mat3f turn = Mat3f::identity();
  turn(0, 0) = c, turn(0, 1) = -s, turn(1, 0) = s, turn(1, 1) = c;
  Mat3f stretch = Mat3f::scaling(1);
  stretch(0, 0) = 0.08f, stretch(1, 1) = 0.1f, stretch(2, 2) = 0.05f;
  const Vec3f centre{0.3f, -0.2f, 0.5f};
  const auto turned =
      densityGrid({turn * stretch, centre}, {-20, -20, -30}, {20, 20, 30}, [&](const Vec3f& p) {
        return 2 * std::fmin(1.0f, std::fmax(0.0f, (0.9f - length(p - centre)) / 0.1f + 0.5f));
      });
  const RenderVolume volume = combine({part(turned), part(ball(0.2f, 0.05f, 1e-6f))});
  ASSERT_FLOAT_EQ(volume.density().voxelSize(), 0.05f);
  double mass = 0;
  Vec3d moment{};
  for (int z = -40; z <= 40; ++z)
    for (int y = -40; y <= 40; ++y)
      for (int x = -40; x <= 40; ++x) {
        const double value = double(volume.density().at({x, y, z}));
        mass += value;
        moment += Vec3d(volume.density().indexToWorld()(Vec3f(Vec3i{x, y, z}))) * value;
      }
  EXPECT_NEAR(mass * 0.05 * 0.05 * 0.05, 2 * 4.0 / 3 * 3.14159265 * 0.9 * 0.9 * 0.9, 0.05);
  for (int axis = 0; axis != 3; ++axis) EXPECT_NEAR(moment[axis] / mass, double(centre[axis]), 2e-3);
}

TEST(VolumeParts, EndWhereTheyDidOnVoxelsThatDoNotDivideTheirOwn) {
  // The lower half of an oblique edge of one voxel, on voxels of 0.0643 in all phases: its mean density is
  // that of the grid itself.
  const auto ramp = densityGrid(voxels(0.1f), {-14, -14, -14}, {14, 14, 14}, [](const Vec3f& p) {
    return std::clamp(0.5f + (p.x + 0.37f * p.y) / 0.1f, 0.0f, 1.0f);
  });
  const RenderVolume volume = combine({part(ramp), part(ball(0.2f, 0.0643f), 0)});
  ASSERT_FLOAT_EQ(volume.density().voxelSize(), 0.0643f);
  const auto before = [](const BrickGrid& grid) {
    double sum = 0;
    int count = 0;
    for (float y = -0.9f; y < 0.9f; y += 0.013f)
      for (float x = -0.3f; x < 0; x += 0.005f, ++count)
        sum += double(sampleGrid(grid, Vec3d(grid.worldToIndex()(Vec3f{x - 0.37f * y, y, 0}))));
    return sum / count;
  };
  EXPECT_NEAR(before(volume.density()) / before(*ramp), 1, 0.02);
  // Nothing rings.
  for (const Interval& range : volume.density().ranges()) {
    EXPECT_GE(range.min, 0);
    EXPECT_LE(range.max, 1);
  }
}

TEST(VolumeParts, ColoursMixByTheirShareOfTheDensity) {
  // Density 1 of red and 3 of blue at the same place: colour (1, 0, 3) / 4.
  VolumePart red = part(ball(1, 0.1f)), blue = part(ball(1, 0.1f), 3);
  red.albedo = {1, 0, 0};
  const auto one =
      densityGrid(voxels(0.1f), {-14, -14, -14}, {14, 14, 14}, [](const Vec3f&) { return 9.0f; });
  const auto none = densityGrid(voxels(0.1f), {0, 0, 0}, {1, 1, 1}, [](const Vec3f&) { return -1.0f; });
  // Beyond 1 and below 0 colours are clamped.
  blue.colour = {none, none, one};
  const RenderVolume volume = combine({red, blue});
  ASSERT_TRUE(volume.hasColour());
  const Vec3f expected{0.25f, 0, 0.75f};
  for (int c = 0; c != 3; ++c) {
    EXPECT_FLOAT_EQ(volume.colour().scattering[std::size_t(c)]->at({0, 0, 0}), 4 * expected[c]);
    EXPECT_NEAR(volume.meanColour()[c], expected[c], 1e-5f);
  }
}

TEST(VolumeParts, GlowByColourAndByTemperature) {
  VolumePart fire = part(ball(1, 0.1f));
  const auto warm = ball(0.5f, 0.1f, 0.75f);
  fire.temperature = warm;
  fire.temperatureScale = 2000;
  fire.emissionScale = 3;
  const RenderVolume hot = combine({fire});
  const Vec3f expected = blackBody(1500) * 3;
  for (int c = 0; c != 3; ++c) {
    const BrickGrid& grid = *hot.colour().emission[std::size_t(c)];
    // Within the table's steps.
    EXPECT_NEAR(grid.at({0, 0, 0}), expected[c], 1e-3f * expected[c] + 1e-6f);
    EXPECT_EQ(grid.at({8, 0, 0}), 0.0f);
  }
  fire.temperature = nullptr;
  fire.emission = {warm, warm, ball(0.5f, 0.1f, 0.5f)};
  fire.density = nullptr;
  const RenderVolume flame = combine({fire});
  EXPECT_FLOAT_EQ(flame.colour().emission[0]->at({0, 0, 0}), 2.25f);
  EXPECT_FLOAT_EQ(flame.colour().emission[2]->at({0, 0, 0}), 1.5f);
  EXPECT_EQ(flame.maxDensity(), 0.0f);
  EXPECT_FALSE(flame.isEmpty());
}

TEST(VolumeParts, VelocitiesBlurWhatMovesAndKeepItsMass) {
  // A ball that moves by 0.6 = 6 voxels along x while the shutter is open, from -0.25 to 0.75 frames: the
  // mass stays, the middle is at 0.25 * 0.6, and the variance along x grows by 0.6^2 / 12.
  const auto still = ball(0.5f, 0.1f);
  const auto wind = [](float value) {
    return densityGrid(voxels(0.2f), {-10, -10, -10}, {10, 10, 10}, [=](const Vec3f&) { return value; });
  };
  VolumePart moving = part(still);
  moving.velocity = {wind(0.6f), wind(0), wind(0)};
  moving.shutter = {-0.25, 0.75};
  const auto moments = [](const RenderVolume& volume) {
    double mass = 0, middle = 0, square = 0;
    for (int z = -20; z <= 20; ++z)
      for (int y = -20; y <= 20; ++y)
        for (int x = -20; x <= 20; ++x) {
          const double value = double(volume.density().at({x, y, z}));
          mass += value, middle += value * 0.1 * x, square += value * 0.01 * x * x;
        }
    middle /= mass;
    return std::array<double, 3>{mass, middle, square / mass - middle * middle};
  };
  const auto before = moments(RenderVolume(still)), after = moments(combine({moving}));
  EXPECT_NEAR(after[0] / before[0], 1, 1e-4);
  EXPECT_NEAR(after[1], 0.15, 1e-4);
  // Interpolation between voxels adds up to a quarter of a voxel's square.
  EXPECT_NEAR(after[2] - before[2], 0.03, 0.0025);
  // Nothing moves while no shutter is open at the time of the grids.
  moving.shutter = {};
  expectSameDensity(combine({moving}), RenderVolume(still));
}

TEST(VolumeParts, AreTheSameAtAnyNumberOfThreads) {
  const std::vector<VolumePart> parts{part(ball(1, 0.1f, 0.7f)), part(ball(1.3f, 0.07f, 0.4f), 1.5f)};
  const RenderVolume all = combine(parts);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const RenderVolume alone = combine(parts);
  EXPECT_EQ(all.density().table(), alone.density().table());
  EXPECT_EQ(all.density().values(), alone.density().values());
}

TEST(VolumeParts, EmptyPartsAddNothing) {
  const auto nothing = densityGrid(voxels(0.1f), {0, 0, 0}, {9, 9, 9}, [](const Vec3f&) { return -1.0f; });
  EXPECT_TRUE(combine({part(nothing), part(nothing)}).isEmpty());
  expectSameDensity(combine({part(ball(1, 0.1f)), part(nothing)}), RenderVolume(ball(1, 0.1f)));
  EXPECT_TRUE(combine({part(ball(1, 0.1f), 0)}).isEmpty());
}

TEST(VolumeParts, MemoryIsEstimatedFromAbove) {
  const std::vector<VolumePart> parts{part(ball(1, 0.1f, 0.7f)), part(ball(1.3f, 0.07f, 0.4f), 1.5f)};
  const double estimate = estimateCombinedBytes(parts);
  const double held = double(combine(parts).density().memoryBytes());
  EXPECT_GE(estimate, 0.99 * held);
  EXPECT_LE(estimate, 4 * held);
}

TEST(VolumeParts, RefusesWhatHasNoMeaning) {
  const auto grid = ball(0.5f, 0.1f);
  EXPECT_THROW(combine({}), Error);
  EXPECT_THROW(combine({VolumePart{}}), Error);
  EXPECT_THROW(combine({part(grid, -1)}), Error);
  EXPECT_THROW(combine({part(grid, std::numeric_limits<float>::infinity())}), Error);
  VolumePart bad = part(grid);
  bad.albedo = {2, 0, 0};
  EXPECT_THROW(combine({bad}), Error);
  bad = part(grid);
  bad.colour = {grid, nullptr, nullptr};
  EXPECT_THROW(combine({bad}), Error);
  bad = part(grid);
  bad.temperature = ball(0.5f, 0.1f, 900);
  EXPECT_THROW(combine({bad}), Error);
  bad.shutter = {1, 0};
  EXPECT_THROW(combine({bad}), Error);
  bad.shutter = {};
  bad.temperatureScale = 1;
  EXPECT_NO_THROW(combine({bad}));
  const auto unbounded = std::make_shared<BrickGrid>(Lattice{}, BrickBox{}, 1.0f);
  EXPECT_THROW(combine({part(grid), part(unbounded)}), Error);
  const auto broken = densityGrid(voxels(1), {0, 0, 0}, {3, 3, 3}, [](const Vec3f&) { return NAN; });
  EXPECT_THROW(combine({part(grid), part(broken)}), Error);
  // Two specks, 10^5 bricks apart each way.
  const auto far = densityGrid({Mat3f::scaling(0.1f), {1e5f, 1e5f, 1e5f}}, {0, 0, 0}, {3, 3, 3},
                               [](const Vec3f&) { return 1.0f; });
  EXPECT_THROW(combine({part(grid), part(far)}), Error);
}

}  // namespace
}  // namespace nephele

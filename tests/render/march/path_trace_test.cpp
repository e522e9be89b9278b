#include "nephele/render/march/path_trace.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/error.h"
#include "nephele/render/march/raymarch.h"
#include "tests/support/density.h"
#include "tests/support/test_data.h"

namespace nephele {
namespace {

using test::ball;
using test::densityGrid;
using test::slab;
using test::voxels;

constexpr float kFourPi = 4 * kPi;

// A camera with `pixels` nearly parallel pixels that looks from `position` at `target`.
Camera needle(const Vec3f& position, const Vec3f& target, int pixels = 1) {
  return Camera::lookingAt(position, target, std::fabs(position.y) > 4 ? Vec3f{1, 0, 0} : Vec3f{0, 1, 0},
                           {pixels, pixels, 0.001f});
}

Medium medium(float extinction, float albedo = 1.0f, const Phase& phase = {}) {
  return {extinction, {albedo, albedo, albedo}, phase};
}

Lights sun(const Vec3f& towards, float irradiance = 1.0f) {
  return {{{"sun", towards, Vec3f{1, 1, 1} * irradiance}}, {}};
}

PathOptions paths(int count, int scatterings = 0) {
  PathOptions options;
  options.samplesPerPixel = count;
  options.maxScatterings = scatterings;
  return options;
}

struct Estimate {
  double mean, standardError;
};

// Mean over the pixels of a channel, and its standard error from their spread.
Estimate estimate(const Image& image, const std::string& name) {
  const std::vector<float>& values = image.channel(name).values;
  double sum = 0, squares = 0;
  for (const float value : values) sum += double(value), squares += double(value) * double(value);
  const double n = double(values.size()), mean = sum / n;
  return {mean, std::sqrt(std::max(0.0, squares / n - mean * mean) / (n - 1))};
}

// A cloud with soft and hard parts across 32 voxels.
std::shared_ptr<BrickGrid> smallCloud() {
  return densityGrid(voxels(0.0625f), {-24, -24, -24}, {24, 24, 24}, [](const Vec3f& p) {
    const float bumps = 0.3f * std::sin(5 * p.x) * std::sin(4 * p.y) * std::sin(6 * p.z);
    return std::fmin(std::fmax((1 + bumps - length(p)) / 0.3f, 0.0f), 1.0f);
  });
}

TEST(PathTrace, FurnaceIsAsBrightAsItsSkyWhereItIsOpaque) {
  // Nothing absorbs, and light is the same everywhere: radiance = alpha * sky for every single path, so the
  // only error is rounding.
  for (const char* phase : {"isotropic", "hg:0.8", "mie:10"})
    for (const float extinction : {1.0f, 20.0f}) {
      const RenderVolume volume(smallCloud());
      const Camera camera = Camera::framing(volume.outline(), 30, 20, {16, 12, 35});
      const Lights sky{{}, {0.5f, 1, 2}};
      const Image image =
          pathTraceImage(volume, medium(extinction, 1, Phase::parse(phase)), sky, camera, paths(16)).image;
      for (int y = 0; y != image.height; ++y)
        for (int x = 0; x != image.width; ++x) {
          ASSERT_NEAR(image.at("R", x, y), 0.5f * image.at("A", x, y), 1e-6f);
          ASSERT_NEAR(image.at("G", x, y), image.at("A", x, y), 1e-6f);
          ASSERT_NEAR(image.at("B", x, y), 2 * image.at("A", x, y), 2e-6f);
        }
      EXPECT_EQ(image.at("A", 0, 0), 0.0f);
      EXPECT_GT(image.at("A", 8, 6), 0.5f);
    }
}

TEST(PathTrace, SlabTransmitsByBeersLaw) {
  // alpha = 1 - exp(-sigma thickness / cos), from 25600 paths; five standard errors. The slab ramps to zero
  // half a voxel around its faces, which leaves its thickness as it is.
  const RenderVolume volume(slab(2.1f, 6.0f, 0.1f, 0.5f));
  for (const float sigma : {0.1f, 1.0f, 4.0f})
    for (const Vec3f& from : {Vec3f{0, 0, 9}, Vec3f{5, 0, 8.660254f}}) {
      const double depth = 0.5 * double(sigma) * 2.1 * 10 / (from.x > 0 ? 8.660254 : 10);
      const Estimate alpha = estimate(
          pathTraceImage(volume, medium(sigma), {}, needle(from, {0, 0, 0}, 16), paths(100)).image, "A");
      EXPECT_NEAR(alpha.mean, 1 - std::exp(-depth), 5 * alpha.standardError) << sigma << " " << from.x;
      EXPECT_LT(alpha.standardError, 0.004);
    }
}

TEST(PathTrace, SphereTransmitsByItsChord) {
  const RenderVolume volume(ball(1.0f, 0.05f));
  for (const float offset : {0.0f, 0.6f}) {
    const double chord = 2 * std::sqrt(1 - double(offset) * double(offset));
    const Estimate alpha = estimate(
        pathTraceImage(volume, medium(0.7f), {}, needle({offset, 0, 9}, {offset, 0, 0}, 16), paths(100))
            .image,
        "A");
    // Half a percent for the ball's voxels.
    EXPECT_NEAR(alpha.mean, 1 - std::exp(-0.7 * chord), 5 * alpha.standardError + 0.005) << offset;
  }
}

TEST(PathTrace, SlabScattersOnceAsInTheClosedForm) {
  // Sun on the viewer's side at mu0: L = albedo E p (1 - exp(-tau (1 + 1 / mu0))) / (1 + 1 / mu0), p the
  // phase function at the angle between them.
  const RenderVolume volume(slab(2.1f, 8.0f, 0.1f));
  for (const char* text : {"isotropic", "hg:-0.5", "rayleigh"})
    for (const float mu : {1.0f, 0.6f}) {
      const Phase phase = Phase::parse(text);
      const double tau = 2.1 * 1.5, k = 1 + 1 / double(mu);
      const double exact = 0.9 * 2 * double(phase(-mu)) * (1 - std::exp(-tau * k)) / k;
      const Estimate red =
          estimate(pathTraceImage(volume, medium(1.5f, 0.9f, phase), sun({std::sqrt(1 - mu * mu), 0, mu}, 2),
                                  needle({0, 0, 9}, {0, 0, 0}, 16), paths(100, 1))
                       .image,
                   "R");
      EXPECT_NEAR(red.mean, exact, 5 * red.standardError) << text << " " << mu;
      EXPECT_LT(red.standardError, 0.01 * exact);
    }
}

TEST(PathTrace, SlabScattersSkylightOnceAsIntegrated) {
  // Isotropic, one scattering of a sky of radiance 1: L = albedo integral over z of exp(-z) S(z) dz, S the
  // mean over directions of what reaches z: (E2(z) + E2(tau - z)) / 2, here with E2 from its integral.
  const RenderVolume volume(slab(2.1f, 30.0f, 0.3f));
  const double tau = 2.1 * 1.2;
  const auto e2 = [](double x) {
    double sum = 0;
    for (int i = 0; i != 400; ++i) sum += std::exp(-x * 400 / (i + 0.5)) / 400;
    return sum;
  };
  double exact = 0;
  for (int i = 0; i != 400; ++i) {
    const double z = (i + 0.5) / 400 * tau;
    exact += std::exp(-z) * (e2(z) + e2(tau - z)) / 2 * tau / 400;
  }
  const Estimate red = estimate(pathTraceImage(volume, medium(1.2f, 0.8f), {{}, {1, 1, 1}},
                                               needle({0, 0, 90}, {0, 0, 0}, 16), paths(100, 1))
                                    .image,
                                "R");
  // The slab ends 14 thicknesses away, 2 % of what a horizontal path sees.
  EXPECT_NEAR(red.mean, 0.8 * exact, 5 * red.standardError + 0.002 * exact);
}

TEST(PathTrace, HalfSpaceScattersAsChandrasekharFound) {
  // Isotropic half space, light and view head on: E / (4 pi) albedo / 2 H(1)^2, H(1) from Chandrasekhar's
  // table XI. The slab lets exp(-30) through.
  const RenderVolume volume(slab(6.3f, 40.0f, 0.3f));
  const struct {
    float albedo;
    double h;
  } cases[] = {{0.5f, 1.2586}, {0.9f, 1.8501}};
  for (const auto& c : cases) {
    const Estimate red = estimate(pathTraceImage(volume, medium(5.0f, c.albedo), sun({0, 0, 1}, kFourPi),
                                                 needle({0, 0, 90}, {0, 0, 0}, 16), paths(200))
                                      .image,
                                  "R");
    const double exact = double(c.albedo) / 2 * c.h * c.h;
    // The face ramps within an optical depth of 1.5, which changes nothing in a flat layer.
    EXPECT_NEAR(red.mean, exact, 5 * red.standardError) << c.albedo;
    EXPECT_LT(red.standardError, 0.01 * exact);
  }
}

// Every block of 8 x 8 pixels that is not a corner differs by no more than 1 % and five standard errors of
// its 64 pixels, which are estimated from their differences.
void expectEqualBlocks(const Image& marched, const Image& traced, double mostNoise) {
  for (int by = 0; by + 8 <= marched.height; by += 8)
    for (int bx = 0; bx + 8 <= marched.width; bx += 8) {
      double a = 0, b = 0, squares = 0, error = 0;
      for (int y = by; y != by + 8; ++y)
        for (int x = bx; x != bx + 8; ++x) {
          const double difference = double(traced.at("R", x, y) - marched.at("R", x, y));
          a += double(marched.at("R", x, y));
          b += double(traced.at("R", x, y));
          error += difference;
          squares += difference * difference;
        }
      if (a < 1) continue;
      EXPECT_NEAR(b / a, 1, 0.01 + 5 * std::sqrt(squares - error * error / 64) / a) << bx << " " << by;
      EXPECT_LT(5 * std::sqrt(squares) / a, mostNoise);
    }
}

TEST(PathTrace, MarcherOfOneOctaveAgreesWithinOnePercentPerBlock) {
  const RenderVolume volume(smallCloud());
  const Camera camera = Camera::framing(volume.outline(), 25, 15, {32, 24, 35});
  const Medium cloud = medium(3.0f, 0.95f, Phase::henyeyGreenstein(0.3f));
  const Lights lights = sun({1, 0.7f, 0.4f}, 5);
  RenderOptions once;
  once.octaves.count = 1;
  once.samples = 64;
  const Image marched = renderImage(volume, cloud, lights, camera, once).image;
  expectEqualBlocks(marched, pathTraceImage(volume, cloud, lights, camera, paths(2500, 1)).image, 0.03);
}

TEST(PathTrace, MarcherWithFinerShadowsAgreesOnACloudOfOpaqueVoxels) {
  const std::string path = test::sharedData("volumes/wdas_cloud_sixteenth_fog.vdb");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const RenderVolume volume(toBricks(readScalarGrid(path)));
  const Camera camera = Camera::framing(volume.outline(), 25, 15, {32, 24, 35});
  // An optical depth of 1 across a voxel.
  const Medium cloud = medium(0.3f, 0.95f, Phase::henyeyGreenstein(0.3f));
  Lights lights = sun({1, 0.7f, 0.4f}, 5);
  lights.shadowDetail = 2;
  RenderOptions once;
  once.octaves.count = 1;
  once.samples = 256;
  const Image marched = renderImage(volume, cloud, lights, camera, once).image;
  const Image traced = pathTraceImage(volume, cloud, lights, camera, paths(2500, 1)).image;
  expectEqualBlocks(marched, traced, 0.03);
  // With a node per voxel the picture is 1 % too dark. The reference's own error is below 0.1 %.
  EXPECT_NEAR(estimate(marched, "R").mean / estimate(traced, "R").mean, 1, 0.005);
}

TEST(PathTrace, ColoursLightByTheAlbedo) {
  // One scattering is proportional to the albedo, for suns and sky.
  const RenderVolume volume(ball(1.0f, 0.1f));
  Medium coloured = medium(2.0f);
  coloured.albedo = {1.0f, 0.5f, 0.25f};
  Lights lights = sun({-1, 0.2f, 1}, 2);
  lights.sky = {1, 1, 1};
  PathOptions options = paths(50, 1);
  options.aovs = {"Z", "light", "transmittance"};
  const Image image =
      pathTraceImage(volume, coloured, lights, Camera::framing(volume.outline(), 0, 0, {8, 8, 35}), options)
          .image;
  const double red = estimate(image, "R").mean;
  EXPECT_NEAR(estimate(image, "G").mean / red, 0.5, 1e-5);
  EXPECT_NEAR(estimate(image, "B").mean / red, 0.25, 1e-5);
  EXPECT_NEAR(estimate(image, "light_sun.R").mean + estimate(image, "light_sky.R").mean, red, 1e-5 * red);
  EXPECT_GT(estimate(image, "light_sky.R").mean, 0.05 * red);
  EXPECT_NEAR(estimate(image, "transmittance.B").mean, 1 - estimate(image, "A").mean, 1e-6);
}

TEST(PathTrace, RussianRouletteKeepsTheMean) {
  // A low albedo plays at once; at most one scattering less leaves nothing to choose. With few scatterings
  // the two halves of a furnace of albedo 0.5 are known: a path that scatters n times weighs 0.5^n.
  const RenderVolume volume(ball(1.0f, 0.1f));
  const Camera camera = needle({0, 0, 9}, {0, 0, 0}, 16);
  double expected = 0, weight = 1;
  for (int n = 1; n != 12; ++n) {
    // Paths of albedo 1 that scatter exactly n times, from those that scatter at most n and n - 1 times.
    const double share =
        estimate(pathTraceImage(volume, medium(1.5f), {{}, {1, 1, 1}}, camera, paths(40, n)).image, "R")
            .mean -
        (n == 1
             ? 0
             : estimate(pathTraceImage(volume, medium(1.5f), {{}, {1, 1, 1}}, camera, paths(40, n - 1)).image,
                        "R")
                   .mean);
    weight *= 0.5;
    expected += weight * share;
  }
  const Estimate red =
      estimate(pathTraceImage(volume, medium(1.5f, 0.5f), {{}, {1, 1, 1}}, camera, paths(40)).image, "R");
  EXPECT_NEAR(red.mean, expected, 5 * red.standardError);
}

// A picture with everything in it.
RenderResult portrait(int count, std::uint64_t first = 0, std::uint64_t seed = 0) {
  const RenderVolume volume(smallCloud());
  PathOptions options = paths(count);
  options.firstSample = first;
  options.seed = seed;
  options.aovs = {"Z", "transmittance", "light"};
  const Lights lights{{{"sun", {1, 1, 0.5f}, {3, 2.9f, 2.8f}}, {"moon", {-1, 1, 0}, {1, 1, 1}}},
                      {0.1f, 0.2f, 0.3f}};
  return pathTraceImage(volume, medium(20.0f, 0.95f, Phase::henyeyGreenstein(0.4f)), lights,
                        Camera::framing(volume.outline(), 20, 10, {24, 20, 30}), options);
}

TEST(PathTrace, IsTheSameAtAnyNumberOfThreads) {
  const RenderResult many = portrait(4);
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
  const RenderResult one = portrait(4);
  EXPECT_EQ(many.samples, one.samples);
  for (std::size_t c = 0; c != many.image.channels.size(); ++c)
    EXPECT_EQ(many.image.channels[c].values, one.image.channels[c].values) << many.image.channels[c].name;
}

TEST(PathTrace, AddsUpSampleBySample) {
  // The mean of six paths is that of the first two and the next four.
  const Image all = portrait(6).image, head = portrait(2).image, tail = portrait(4, 2).image;
  for (const char* name : {"R", "A", "light_moon.B", "light_sky.G"})
    for (std::size_t i = 0; i != all.channel(name).values.size(); ++i)
      ASSERT_NEAR(all.channel(name).values[i],
                  (head.channel(name).values[i] + 2 * tail.channel(name).values[i]) / 3, 1e-5f)
          << name;
  EXPECT_NE(head.channel("R").values, portrait(2, 0, 1).image.channel("R").values);
}

TEST(PathTrace, MeasuresTheMarchersDepth) {
  const RenderVolume volume(smallCloud());
  const Camera camera = Camera::framing(volume.outline(), 20, 10, {24, 20, 30});
  const Image marched = renderImage(volume, medium(20.0f), {}, camera).image;
  EXPECT_EQ(pathTraceImage(volume, medium(20.0f), {}, camera, paths(1)).image.channel("Z").values,
            marched.channel("Z").values);
}

TEST(PathTrace, IsBlackWithoutLights) {
  const RenderVolume volume(ball(1.0f, 0.1f));
  const Image image = pathTraceImage(volume, medium(5), {}, needle({0, 0, 9}, {0, 0, 0}), paths(20)).image;
  EXPECT_EQ(image.at("R", 0, 0), 0.0f);
  EXPECT_GT(image.at("A", 0, 0), 0.9f);
}

TEST(PathTrace, MakesAnEmptyPictureOfAnEmptyVolume) {
  const RenderVolume volume(densityGrid(voxels(1), {0, 0, 0}, {5, 5, 5}, [](const Vec3f&) { return 0.0f; }));
  PathOptions options = paths(3);
  options.aovs = {"Z", "light", "transmittance"};
  const RenderResult result = pathTraceImage(volume, {}, sun({0, 1, 0}),
                                             Camera::framing(volume.outline(), 0, 0, {8, 4, 30}), options);
  for (const char* name : {"R", "G", "B", "A", "light_sun.G"})
    for (const float value : result.image.channel(name).values) EXPECT_EQ(value, 0.0f);
  for (const float value : result.image.channel("transmittance.R").values) EXPECT_EQ(value, 1.0f);
  for (const float depth : result.image.channel("Z").values)
    EXPECT_EQ(depth, std::numeric_limits<float>::infinity());
  EXPECT_EQ(result.samples, 0u);
}

TEST(PathTrace, EndsWhateverTheExtinction) {
  const RenderVolume volume(ball(1.0f, 0.25f));
  const Image image =
      pathTraceImage(volume, medium(1e30f, 0.9f), sun({0, 0, 1}), needle({0, 0, 9}, {0, 0, 0}), paths(4))
          .image;
  EXPECT_EQ(image.at("A", 0, 0), 1.0f);
  EXPECT_TRUE(std::isfinite(image.at("R", 0, 0)));
}

TEST(PathTrace, RefusesBadOptions) {
  const RenderVolume volume(ball(1.0f, 0.25f));
  const Camera camera = needle({0, 0, 9}, {0, 0, 0});
  const auto tryWith = [&](const Medium& m, const Lights& l, const PathOptions& o) {
    pathTraceImage(volume, m, l, camera, o);
  };
  EXPECT_THROW(tryWith(medium(-1), {}, {}), Error);
  EXPECT_THROW(tryWith(medium(NAN), {}, {}), Error);
  EXPECT_THROW(tryWith(medium(1, 1.5f), {}, {}), Error);
  EXPECT_THROW(tryWith(medium(1), {{}, {-1, 0, 0}}, {}), Error);
  EXPECT_THROW(tryWith(medium(1), sun({0, 0, 0}), {}), Error);
  EXPECT_THROW(tryWith(medium(1), sun({NAN, 0, 1}), {}), Error);
  EXPECT_THROW(tryWith(medium(1), {}, paths(0)), Error);
  EXPECT_THROW(tryWith(medium(1), {}, paths((1 << 20) + 1)), Error);
  EXPECT_THROW(tryWith(medium(1), {}, paths(1, -1)), Error);
  PathOptions options;
  options.aovs = {"depth"};
  EXPECT_THROW(tryWith(medium(1), {}, options), Error);
  options.aovs = {"Z", "Z"};
  EXPECT_THROW(tryWith(medium(1), {}, options), Error);
}

}  // namespace
}  // namespace nephele

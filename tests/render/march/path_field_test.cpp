// Path traced pictures of fields, without a grid in between.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "nephele/levelset/grid/bake.h"
#include "nephele/modeling/field/function_field.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/noise/noise.h"
#include "nephele/modeling/shape/combinations.h"
#include "nephele/modeling/shape/shapes.h"
#include "nephele/render/march/path_trace.h"
#include "nephele/render/march/raymarch.h"
#include "nephele/render/volume/field_volume.h"
#include "tests/support/path_pictures.h"
#include "tests/support/test_meshes.h"

namespace nephele {
namespace {

using test::estimate;
using test::Estimate;

const Box kBox{{-1.5f, -1.5f, -1.5f}, {1.5f, 1.5f, 1.5f}};

Medium medium(float extinction, float albedo = 1.0f, const Phase& phase = {}) {
  return {extinction, {albedo, albedo, albedo}, phase};
}

PathOptions paths(int count, int scatterings = 0) {
  PathOptions options;
  options.samplesPerPixel = count;
  options.maxScatterings = scatterings;
  options.aovs = {};
  return options;
}

// A bumpy ball with an edge of a twentieth.
ScalarField bumpy() {
  FractalSumOptions bumps;
  bumps.octaves = 3;
  bumps.frequency = 2;
  return smoothstep(-0.01f, 0.04f, sphere({0, 0, 0}, 0.8f) + fractalSum(bumps) * 0.15f);
}

RenderVolume baked(const ScalarField& density, float voxelSize) {
  BakeOptions baking;
  baking.voxelSize = voxelSize;
  baking.box = kBox;
  baking.background = 0.0f;
  return RenderVolume(bakeGrid(density, baking));
}

TEST(PathField, TransmitsByTheChordOfABall) {
  // alpha = 1 - exp(-extinction * chord), five standard errors. A density of 1 in a ball, of which the bounds
  // settle all but the cells at its edge; and one that nothing is known of but that it lies within 0 and 2.
  const ScalarField known = mask(sphere({0, 0, 0}, 1), 1e-4f);
  const ScalarField unknown =
      functionField([](const Vec3f& p) { return length(p) < 1 ? 1.0f : 0.0f; }, {.range = [](const Box&) {
                      return Interval{0, 2};
                    }});
  for (const ScalarField& density : {known, unknown}) {
    const RenderVolume volume = gridlessVolume(density, kBox, 0.1f);
    for (const float offset : {0.0f, 0.6f}) {
      const double chord = 2 * std::sqrt(1 - double(offset) * double(offset));
      const Camera camera = Camera::lookingAt({offset, 0, 9}, {offset, 0, 0}, {0, 1, 0}, {16, 16, 0.001f});
      const Estimate alpha =
          estimate(pathTraceImage(volume, medium(0.7f), {}, camera, paths(100)).image, "A");
      EXPECT_NEAR(alpha.mean, 1 - std::exp(-0.7 * chord), 5 * alpha.standardError) << offset;
      EXPECT_LT(alpha.standardError, 0.004);
    }
  }
}

TEST(PathField, FurnaceIsAsBrightAsItsSky) {
  // As of grids: every single path, up to rounding.
  const RenderVolume volume = gridlessVolume(bumpy(), kBox, 0.1f);
  const Camera camera = Camera::framing(volume.outline(), 30, 20, {16, 12, 35});
  for (const float extinction : {2.0f, 40.0f}) {
    const Image image = pathTraceImage(volume, medium(extinction, 1, Phase::henyeyGreenstein(0.5f)),
                                       {{}, {0.5f, 1, 2}}, camera, paths(16))
                            .image;
    for (int y = 0; y != image.height; ++y)
      for (int x = 0; x != image.width; ++x) {
        ASSERT_NEAR(image.at("R", x, y), 0.5f * image.at("A", x, y), 1e-6f);
        ASSERT_NEAR(image.at("B", x, y), 2 * image.at("A", x, y), 2e-6f);
      }
    EXPECT_GT(image.at("A", 8, 6), 0.5f);
  }
}

TEST(PathField, GridsOfTheFieldConvergeToIt) {
  // Light, opacity and noise alike; the difference of the means falls with the voxels, and is within five
  // standard errors in the end.
  const ScalarField density = bumpy();
  const RenderVolume field = gridlessVolume(density, kBox, 0.1f);
  const Camera camera = Camera::framing(field.outline(), 25, 15, {24, 18, 45});
  const Lights lights{{{"sun", {1, 0.7f, 0.4f}, {5, 5, 5}}}, {0.3f, 0.3f, 0.3f}};
  const Medium cloud = medium(8, 0.95f, Phase::henyeyGreenstein(0.5f));
  const PathOptions options = paths(250);
  const Image exact = pathTraceImage(field, cloud, lights, camera, options).image;
  double before[2] = {1, 1};
  for (const float voxelSize : {0.2f, 0.1f, 0.025f}) {
    const Image image = pathTraceImage(baked(density, voxelSize), cloud, lights, camera, options).image;
    for (int c = 0; c != 2; ++c) {
      const char* name = c ? "R" : "A";
      Image difference = image;
      std::vector<float>& values = difference.channels[0].values;
      for (std::size_t i = 0; i != values.size(); ++i)
        values[i] = image.channel(name).values[i] - exact.channel(name).values[i];
      const Estimate off = estimate(difference, "R");
      const double scale = estimate(exact, name).mean;
      EXPECT_LT(std::fabs(off.mean), before[c] * scale + 2 * off.standardError) << name << voxelSize;
      before[c] = std::fabs(off.mean) / scale;
      if (voxelSize < 0.05f) {
        EXPECT_LT(std::fabs(off.mean), 5 * off.standardError) << name;
        EXPECT_LT(off.standardError, 0.01 * scale) << name;
      }
    }
  }
}

TEST(PathField, ColoursOfTheExtinctionAreTransmittedAsOfGrids) {
  // A slab of optical depths 2, 1 and 0.2: exp of minus these, five standard errors.
  const ScalarField density = functionField(
      [](const Vec3f& p) { return std::fabs(p.z) < 0.5f ? 1.0f : 0.0f; }, {.range = [](const Box& box) {
        const bool some = box.max.z >= -0.5f && box.min.z <= 0.5f,
                   all = box.max.z < 0.5f && box.min.z > -0.5f;
        return Interval{all ? 1.0f : 0.0f, some ? 1.0f : 0.0f};
      }});
  const RenderVolume volume = gridlessVolume(density, kBox, 0.1f);
  Medium coloured = medium(2);
  coloured.extinctionColour = {1, 0.5f, 0.1f};
  PathOptions options = paths(200);
  options.aovs = {"transmittance"};
  const Camera camera = Camera::lookingAt({0, 0, 9}, {0, 0, 0}, {0, 1, 0}, {16, 16, 0.001f});
  const Image image = pathTraceImage(volume, coloured, {}, camera, options).image;
  for (const auto& [name, depth] :
       {std::pair{"transmittance.R", 2.0}, {"transmittance.G", 1.0}, {"transmittance.B", 0.2}}) {
    const Estimate left = estimate(image, name);
    EXPECT_NEAR(left.mean, std::exp(-depth), 5 * left.standardError) << name;
    EXPECT_LT(left.standardError, 0.01) << name;
  }
}

TEST(PathField, MarchedFieldsOfOneOctaveAgree) {
  const RenderVolume volume = gridlessVolume(bumpy(), kBox, 0.03f);
  const Camera camera = Camera::framing(volume.outline(), 25, 15, {32, 24, 45});
  const Lights lights{{{"sun", {1, 0.7f, 0.4f}, {5, 5, 5}}}, {}};
  const Medium cloud = medium(3, 0.95f, Phase::henyeyGreenstein(0.3f));
  RenderOptions once;
  once.octaves.count = 1;
  once.samples = 64;
  once.aovs = {};
  const Image marched = renderImage(volume, cloud, lights, camera, once).image;
  const Image traced = pathTraceImage(volume, cloud, lights, camera, paths(1000, 1)).image;
  EXPECT_LT(test::worstBlock(marched, traced, "A", 0.02f), 0.005);
  // The marcher's light is on voxels.
  EXPECT_LT(test::worstBlock(marched, traced, "R", 0.02f), 0.015);
}

TEST(PathField, IsTheSameAtAnyNumberOfThreads) {
  const RenderVolume volume = gridlessVolume(bumpy(), kBox, 0.1f);
  const Camera camera = Camera::framing(volume.outline(), 25, 15, {24, 18, 45});
  const Lights lights{{{"sun", {1, 0.7f, 0.4f}, {5, 4, 3}}}, {0.3f, 0.3f, 0.3f}};
  PathOptions options = paths(8);
  options.deep.emplace();
  options.surfaces = std::make_shared<const Surfaces>(
      std::vector<SurfaceObject>{{test::icosphere(0.5, 2, {1, 0.3f, 0.4f}), {0.5f, 0.5f, 0.5f}}});
  const auto picture = [&] { return pathTraceImage(volume, medium(10), lights, camera, options); };
  const RenderResult many = picture();
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
  const RenderResult one = picture();
  EXPECT_EQ(many.samples, one.samples);
  for (std::size_t c = 0; c != many.image.channels.size(); ++c)
    EXPECT_EQ(many.image.channels[c].values, one.image.channels[c].values) << many.image.channels[c].name;
  EXPECT_EQ(many.deep->sampleCount(), one.deep->sampleCount());
}

TEST(PathField, EndsWhateverTheExtinction) {
  const RenderVolume volume = gridlessVolume(bumpy(), kBox, 0.1f);
  const Camera camera = Camera::framing(volume.outline(), 25, 15, {8, 6, 45});
  const Image image =
      pathTraceImage(volume, medium(1e30f, 0.9f), {{{"sun", {0, 0, 1}}}, {}}, camera, paths(4)).image;
  EXPECT_EQ(image.at("A", 4, 3), 1.0f);
  EXPECT_TRUE(std::isfinite(image.at("R", 4, 3)));
}

}  // namespace
}  // namespace nephele

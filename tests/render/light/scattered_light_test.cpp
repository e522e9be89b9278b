#include "nephele/render/light/scattered_light.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "nephele/modeling/base/error.h"
#include "tests/support/density.h"

namespace nephele {
namespace {

using test::ball;
using test::densityGrid;
using test::slab;
using test::voxels;

TEST(Scattering, HasAnIsotropicEquivalentThatTransportsAsMuch) {
  // What a scattering medium lets diffuse depends on absorption s (1 - a) and transport extinction s (1 - a
  // g) alone: both stay.
  const Scattering medium{2.0f, 0.9f, 0.6f}, even = medium.isotropic();
  EXPECT_FLOAT_EQ(even.extinction, 2.0f * (1 - 0.9f * 0.6f));
  EXPECT_NEAR(even.extinction * (1 - even.albedo), 0.2f, 1e-6f);
  EXPECT_EQ(even.meanCosine, 0.0f);
  EXPECT_EQ((Scattering{2.0f, 0.9f, -0.6f}.isotropic().extinction), 2.0f);
}

TEST(ScatteredLight, SeesTheWholeSkyWhereNothingAbsorbs) {
  // The furnace: J = 1 everywhere, whatever the depth.
  const RenderVolume volume(ball(1.0f, 0.1f));
  for (const float extinction : {1e-3f, 1.0f, 30.0f, 1e4f}) {
    const ScatteredLight light(volume, {extinction, 1.0f, 0.4f}, nullptr);
    for (const float value : light.values()) ASSERT_NEAR(value, 1.0f, 2e-3f) << extinction;
  }
}

TEST(ScatteredLight, SeesWhatABallLetsThrough) {
  // Without scattering every direction passes radius * density from the middle: exp(-1.2). A cell is 0.06
  // deep.
  const RenderVolume volume(ball(1.0f, 0.05f));
  const ScatteredLight light(volume, {1.2f, 0.0f, 0.0f}, nullptr);
  EXPECT_NEAR(light.at({0, 0, 0}), std::exp(-1.2f), 0.01f);
  // Nearer to the surface it is brighter, on all sides alike.
  const float up = light.at({0, 0.8f, 0});
  EXPECT_GT(up, light.at({0, 0, 0}) + 0.1f);
  for (const Vec3f& p : {Vec3f{0.8f, 0, 0}, Vec3f{0, -0.8f, 0}, Vec3f{0, 0, -0.8f}, Vec3f{0.57f, 0.57f, 0}})
    EXPECT_NEAR(light.at(p), up, 0.02f);
}

TEST(ScatteredLight, OfASunInAThinBallIsScatteredOnce) {
  // A ball of optical depth 0.02 across: in its middle, J = integral over all points of albedo extinction /
  // (4 pi r^2) / (4 pi) = albedo extinction radius / (4 pi).
  const RenderVolume volume(ball(1.0f, 0.1f));
  const LightVolume sun(volume, {0.3f, 0.8f, 0.4f});
  const ScatteredLight light(volume, {0.01f, 0.8f, 0.0f}, &sun);
  EXPECT_NEAR(light.at({0, 0, 0}) / (0.8f * 0.01f / (4 * 3.14159265f)), 1, 0.03);
}

TEST(ScatteredLight, FallsInASlabAsDiffusionDoes) {
  // Deep in a wide slab that does not absorb, the scattered light of a sun falls linearly to 0 at 0.71 free
  // paths outside of the far side (Milne's problem). Depth 20, looked at from 8 to 16.
  const RenderVolume volume(slab(4.0f, 12.0f, 0.2f));
  const LightVolume sun(volume, {0, 0, 1});
  const ScatteredLight light(volume, {5.0f, 1.0f, 0.0f}, &sun);
  const auto at = [&](float depth) { return light.at({0, 0, 2 - depth / 5}); };
  const float slope = (at(8) - at(16)) / 8;
  EXPECT_GT(slope, 0);
  EXPECT_NEAR(at(12) / (at(8) - 4 * slope), 1, 0.02);
  EXPECT_NEAR(16 + at(16) / slope, 20.71f, 1.0f);
}

TEST(ScatteredLight, GoesOnThroughForwardScatterers) {
  // The same light, mean cosine 0.75 in a four times denser slab.
  const RenderVolume volume(slab(4.0f, 12.0f, 0.2f));
  const LightVolume sun(volume, {0, 0, 1});
  const ScatteredLight even(volume, {2.0f, 1.0f, 0.0f}, &sun), forward(volume, {8.0f, 1.0f, 0.75f}, &sun);
  for (const float z : {-1.5f, 0.0f, 1.5f}) EXPECT_NEAR(forward.at({0, 0, z}), even.at({0, 0, z}), 1e-4f);
}

TEST(ScatteredLight, IsTheSameAtAnyNumberOfThreads) {
  const RenderVolume volume(ball(1.0f, 0.06f));
  const LightVolume sun(volume, {1, 1, 0});
  const ScatteredLight many(volume, {20.0f, 0.95f, 0.3f}, &sun);
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
  const ScatteredLight one(volume, {20.0f, 0.95f, 0.3f}, &sun);
  EXPECT_EQ(many.values(), one.values());
}

TEST(ScatteredLight, IsTheSameAtAnotherVoxelSize) {
  // Lattices of 5, 10 and 20 cells across a ball 5 free paths wide.
  const RenderVolume fine(ball(1.0f, 0.05f)), coarse(ball(1.0f, 0.1f));
  const LightVolume fineSun(fine, {0, 1, 0}), coarseSun(coarse, {0, 1, 0});
  const ScatteredLight a(fine, {2.5f, 0.98f, 0}, &fineSun), b(coarse, {2.5f, 0.98f, 0}, &coarseSun);
  for (const Vec3f& p : {Vec3f{0, 0, 0}, Vec3f{0, 0.6f, 0}, Vec3f{0.5f, -0.5f, 0.2f}})
    EXPECT_NEAR(a.at(p) / b.at(p), 1, 0.03);
}

TEST(ScatteredLight, EstimatesItsMemory) {
  const RenderVolume volume(ball(1.0f, 0.02f));
  const ScatteredLight light(volume, {2.5f, 0.98f, 0}, nullptr);
  const ScatteredLight::Bytes bytes = ScatteredLight::estimateBytes(volume);
  EXPECT_LE(double(light.values().size() * sizeof(float)), bytes.kept);
  EXPECT_GT(bytes.working, bytes.kept);
  EXPECT_LE(std::max({light.size().x, light.size().y, light.size().z}), 128);
}

TEST(ScatteredLight, IsTheSkyItselfInAnEmptyVolume) {
  const RenderVolume volume(densityGrid(voxels(1), {0, 0, 0}, {3, 3, 3}, [](const Vec3f&) { return 0.0f; }));
  EXPECT_EQ(ScatteredLight(volume, {1, 1, 0}, nullptr).at({1, 1, 1}), 1.0f);
}

TEST(ScatteredLight, RefusesUselessOptions) {
  const RenderVolume volume(ball(1.0f, 0.5f));
  ScatteredLight::Options options;
  options.directions = 2;
  EXPECT_THROW(ScatteredLight(volume, {1, 1, 0}, nullptr, options), Error);
  for (const Scattering& scattering : {Scattering{-1.0f, 0.5f, 0.0f}, Scattering{NAN, 0.5f, 0.0f},
                                       Scattering{1.0f, 1.5f, 0.0f}, Scattering{1.0f, 1.0f, 1.0f}})
    EXPECT_THROW(ScatteredLight(volume, scattering, nullptr), Error);
}

}  // namespace
}  // namespace nephele

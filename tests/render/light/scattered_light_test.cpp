#include "nephele/render/light/scattered_light.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>

#include "nephele/modeling/base/error.h"
#include "tests/support/density.h"
#include "tests/support/each_target.h"

namespace nephele {
namespace {

using test::ball;
using test::densityGrid;
using test::slab;
using test::voxels;

Scattering scattering(float extinction, float albedo, float g = 0) {
  return {extinction, albedo, legendreMoments(Phase::henyeyGreenstein(g))};
}

TEST(ScatteredLight, SeesTheWholeSkyWhereNothingAbsorbs) {
  // The furnace: the mean is 1 everywhere, and so is what is sent anywhere, whatever the depth.
  const RenderVolume volume(ball(1.0f, 0.1f));
  for (const float extinction : {1e-3f, 1.0f, 30.0f, 1e4f}) {
    const ScatteredLight light(volume, scattering(extinction, 1.0f, 0.6f), ScatteredSource::evenSky());
    for (const Vec3f& p : {Vec3f{0, 0, 0}, Vec3f{0.9f, 0, 0}, Vec3f{0.3f, -0.5f, 0.4f}})
      EXPECT_NEAR(light.meanAt(p), 1.0f, 2e-3f) << extinction;
    const std::vector<float> sent = light.towards({Vec3f{0, 1, 5}, {}});
    const Vec3f middle = light.worldToLattice()({0, 0, 0});
    const Vec3i node{int(middle.x), int(middle.y), int(middle.z)};
    EXPECT_NEAR(sent[std::size_t((node.z * light.size().y + node.y) * light.size().x + node.x)], 1.0f, 3e-3f)
        << extinction;
  }
}

TEST(ScatteredLight, SeesWhatABallLetsThrough) {
  // Without scattering every direction passes radius * density from the middle: exp(-1.2). A cell is 0.06
  // deep.
  const RenderVolume volume(ball(1.0f, 0.05f));
  const ScatteredLight light(volume, scattering(1.2f, 0), ScatteredSource::evenSky());
  EXPECT_NEAR(light.meanAt({0, 0, 0}), std::exp(-1.2f), 0.01f);
  // Nearer to the surface it is brighter, on all sides alike.
  const float up = light.meanAt({0, 0.8f, 0});
  EXPECT_GT(up, light.meanAt({0, 0, 0}) + 0.1f);
  for (const Vec3f& p : {Vec3f{0.8f, 0, 0}, Vec3f{0, -0.8f, 0}, Vec3f{0, 0, -0.8f}, Vec3f{0.57f, 0.57f, 0}})
    EXPECT_NEAR(light.meanAt(p), up, 0.02f);
}

TEST(ScatteredLight, OfASunInAThinBallIsScatteredOnce) {
  // A ball of optical depth 0.02 across: in its middle, J = integral over all points of albedo extinction /
  // (4 pi r^2) / (4 pi) = albedo extinction radius / (4 pi).
  const RenderVolume volume(ball(1.0f, 0.1f));
  const Vec3f towards{0.3f, 0.8f, 0.4f};
  const LightVolume sun(volume, towards);
  const ScatteredLight light(volume, scattering(0.01f, 0.8f), ScatteredSource::of(sun, towards));
  EXPECT_NEAR(light.meanAt({0, 0, 0}) / (0.8f * 0.01f / (4 * 3.14159265f)), 1, 0.03);
}

TEST(ScatteredLight, FallsInASlabAsDiffusionDoes) {
  // Deep in a wide slab that does not absorb, the scattered light of a sun falls linearly to 0 at 0.71 free
  // paths outside of the far side (Milne's problem). Depth 20, looked at from 8 to 16.
  const RenderVolume volume(slab(4.0f, 12.0f, 0.2f));
  const LightVolume sun(volume, {0, 0, 1});
  const ScatteredLight light(volume, scattering(5.0f, 1), ScatteredSource::of(sun, {0, 0, 1}));
  const auto at = [&](float depth) { return light.meanAt({0, 0, 2 - depth / 5}); };
  const float slope = (at(8) - at(16)) / 8;
  EXPECT_GT(slope, 0);
  EXPECT_NEAR(at(12) / (at(8) - 4 * slope), 1, 0.02);
  EXPECT_NEAR(16 + at(16) / slope, 20.71f, 1.0f);
}

TEST(ScatteredLight, GoesOnThroughForwardScatterers) {
  // In a slab that does not absorb, what is diffuse depends on extinction (1 - g) alone, and falls as
  // steeply. That is exact far from the faces only: these are 8 transport lengths apart.
  const RenderVolume volume(slab(4.0f, 12.0f, 0.2f));
  const LightVolume sun(volume, {0, 0, 1});
  const ScatteredSource source = ScatteredSource::of(sun, {0, 0, 1});
  const ScatteredLight even(volume, scattering(2.0f, 1), source),
      forward(volume, scattering(8.0f, 1, 0.75f), source);
  const auto slope = [](const ScatteredLight& light) {
    return light.meanAt({0, 0, -0.4f}) - light.meanAt({0, 0, -1.2f});
  };
  EXPECT_NEAR(slope(forward) / slope(even), 1, 0.08);
}

TEST(ScatteredLight, IsTheSameAtAnyNumberOfThreads) {
  const RenderVolume volume(ball(1.0f, 0.06f));
  const LightVolume sun(volume, {1, 1, 0});
  const ScatteredSource source = ScatteredSource::of(sun, {1, 1, 0});
  const ScatteredLight many(volume, scattering(20.0f, 0.95f, 0.8f), source);
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
  const ScatteredLight one(volume, scattering(20.0f, 0.95f, 0.8f), source);
  EXPECT_EQ(many.mean(), one.mean());
  EXPECT_EQ(many.towards({{}, Vec3f{0, 1, 0}}), one.towards({{}, Vec3f{0, 1, 0}}));
  EXPECT_EQ(many.sweeps(), one.sweeps());
}

TEST(ScatteredLight, GoesToTheEyeTogetherAsItDoesAlone) {
  const RenderVolume volume(ball(1.0f, 0.1f));
  const Vec3f towards{0.3f, 0.8f, 0.4f};
  const LightVolume sun(volume, towards);
  const Scattering cloud = scattering(20.0f, 0.98f, 0.85f);
  // The third stands in another medium, and the last is the fourth of one.
  const ScatteredLight lights[] = {
      {volume, cloud, ScatteredSource::of(sun, towards)},
      {volume, cloud, ScatteredSource::evenSky()},
      {volume, scattering(5.0f, 0.9f), ScatteredSource::evenSky()},
      {volume, cloud, ScatteredSource::evenSky()},
      {volume, cloud, ScatteredSource::of(sun, towards)},
  };
  std::vector<const ScatteredLight*> all;
  for (const ScatteredLight& light : lights) all.push_back(&light);
  const Viewpoint viewpoint{Vec3f{0, 1, 5}, {}};
  const auto best = ScatteredLight::towards(all, viewpoint);
  test::forEachTarget([&] {
    const auto together = ScatteredLight::towards(all, viewpoint);
    for (std::size_t k = 0; k != all.size(); ++k) {
      EXPECT_EQ(together[k], all[k]->towards(viewpoint)) << k;
      // A line may end a step earlier, where a hundredth of it is left, by the rounding of another target.
      const float most = *std::ranges::max_element(best[k]);
      EXPECT_GT(most, 0.01f);
      for (std::size_t i = 0; i != best[k].size(); ++i)
        ASSERT_NEAR(together[k][i], best[k][i], 0.01f * most) << k << " " << i;
    }
  });
}

TEST(ScatteredLight, OfOtherAlbedosGoesToTheEyeTogetherAsItDoesAlone) {
  const RenderVolume volume(ball(1.0f, 0.1f));
  const Vec3f towards{0.3f, 0.8f, 0.4f};
  const LightVolume sun(volume, towards);
  // As where objects cast shadows: cells so deep are all thinned alike, up to the same depth.
  ScatteredSource source = ScatteredSource::of(sun, towards);
  source.thinned = nullptr;
  std::vector<ScatteredLight> lights;
  for (const float albedo : {0.5f, 0.625f, 0.75f, 0.875f, 1.0f})
    lights.emplace_back(volume, scattering(200.0f, albedo, 0.85f), source);
  std::vector<const ScatteredLight*> all;
  for (const ScatteredLight& light : lights) all.push_back(&light);
  const Viewpoint viewpoint{Vec3f{0, 1, 5}, {}};
  const auto together = ScatteredLight::towards(all, viewpoint);
  for (std::size_t k = 0; k != all.size(); ++k) EXPECT_EQ(together[k], all[k]->towards(viewpoint)) << k;
}

TEST(ScatteredLight, EndsWithinItsTolerance) {
  // A sweep leaves about as much to change as it has changed, one and a half times that with what is
  // extrapolated from it: sixty sweeps change no more of all light, and little of it where it is dark.
  const RenderVolume volume(ball(1.0f, 0.06f));
  const LightVolume sun(volume, {1, 1, 0});
  const ScatteredSource source = ScatteredSource::of(sun, {1, 1, 0});
  const ScatteredLight light(volume, scattering(40.0f, 0.999f, 0.3f), source);
  ScatteredLight::Options exact;
  exact.sweeps = 60;
  exact.tolerance = 1e-6f;
  const ScatteredLight limit(volume, scattering(40.0f, 0.999f, 0.3f), source, exact);
  EXPECT_LT(light.residual(), ScatteredLight::Options{}.tolerance);
  EXPECT_LE(light.sweeps(), 8);
  const std::vector<float> mean = light.mean(), exactMean = limit.mean();
  double change = 0, whole = 0;
  for (std::size_t i = 0; i != mean.size(); ++i) {
    change += std::fabs(double(mean[i]) - double(exactMean[i]));
    whole += double(exactMean[i]);
  }
  EXPECT_LT(change, 2 * double(ScatteredLight::Options{}.tolerance) * whole);
  for (const Vec3f& p : {Vec3f{0.5f, 0.5f, 0}, Vec3f{0, 0, 0}, Vec3f{-0.6f, -0.6f, 0}})
    EXPECT_NEAR(light.meanAt(p) / limit.meanAt(p), 1, 0.025) << p.x;
}

TEST(ScatteredLight, TakesFinerCellsWhereTheyAreDeep) {
  // A ball of density 2, 34 voxels wide, on cells that are half a voxel wide at most: of an optical depth of
  // 0.06 times the extinction.
  const RenderVolume volume(ball(1.0f, 0.06f));
  const ScatteredLight::Options usual;
  EXPECT_EQ(usual.suitedTo(volume, scattering(2.0f, 0.9f, 0.0f)).longestSide, usual.longestSide);
  const int finer = usual.suitedTo(volume, scattering(2000.0f, 0.9f, 0.0f)).longestSide;
  EXPECT_GT(finer, usual.longestSide);
  EXPECT_LT(finer, 3 * usual.longestSide / 2);
}

TEST(ScatteredLight, TakesMoreDirectionsWhereLightKeepsItsWay) {
  const RenderVolume volume(ball(1.0f, 0.06f));
  const ScatteredLight::Options usual;
  EXPECT_EQ(usual.suitedTo(volume, scattering(2.0f, 0.9f, 0.85f)).order, 8);
  EXPECT_EQ(usual.suitedTo(volume, scattering(200.0f, 0.9f, 0.85f)).order, usual.order);
  EXPECT_EQ(usual.suitedTo(volume, scattering(2.0f, 0.9f, 0.3f)).order, usual.order);
}

TEST(ScatteredLight, ConvergesQuicklyWhereForwardScatteringCoversManyCells) {
  const RenderVolume volume(ball(1.0f, 0.06f));
  const LightVolume sun(volume, {1, 1, 0});
  for (const float extinction : {3.0f, 30.0f, 300.0f, 3000.0f}) {
    const ScatteredLight light(volume, scattering(extinction, 0.9999f, 0.85f),
                               ScatteredSource::of(sun, {1, 1, 0}));
    EXPECT_LE(light.sweeps(), 10) << extinction;
  }
}

TEST(ScatteredLight, IsTheSameAtAnotherVoxelSize) {
  // Lattices of 5, 10 and 20 cells across a ball 5 free paths wide.
  const RenderVolume fine(ball(1.0f, 0.05f)), coarse(ball(1.0f, 0.1f));
  const LightVolume fineSun(fine, {0, 1, 0}), coarseSun(coarse, {0, 1, 0});
  const ScatteredLight a(fine, scattering(2.5f, 0.98f), ScatteredSource::of(fineSun, {0, 1, 0})),
      b(coarse, scattering(2.5f, 0.98f), ScatteredSource::of(coarseSun, {0, 1, 0}));
  for (const Vec3f& p : {Vec3f{0, 0, 0}, Vec3f{0, 0.6f, 0}, Vec3f{0.5f, -0.5f, 0.2f}})
    EXPECT_NEAR(a.meanAt(p) / b.meanAt(p), 1, 0.03);
}

TEST(ScatteredLight, EstimatesItsMemory) {
  const RenderVolume volume(ball(1.0f, 0.02f));
  const ScatteredLight light(volume, scattering(2.5f, 0.98f), ScatteredSource::evenSky());
  const ScatteredLight::Bytes bytes = ScatteredLight::estimateBytes(volume, {});
  EXPECT_LE(double(light.mean().size() * sizeof(float)), bytes.kept);
  EXPECT_GT(bytes.working, bytes.kept);
  EXPECT_LE(std::max({light.size().x, light.size().y, light.size().z}), 135);
}

TEST(ScatteredLight, IsTheSkyItselfInAnEmptyVolume) {
  const RenderVolume volume(densityGrid(voxels(1), {0, 0, 0}, {3, 3, 3}, [](const Vec3f&) { return 0.0f; }));
  EXPECT_NEAR(ScatteredLight(volume, {}, ScatteredSource::evenSky()).meanAt({1, 1, 1}), 1.0f, 1e-6f);
}

TEST(ScatteredLight, RefusesUselessOptions) {
  const RenderVolume volume(ball(1.0f, 0.5f));
  ScatteredLight::Options options;
  options.order = 2;
  EXPECT_THROW(ScatteredLight(volume, {}, ScatteredSource::evenSky(), options), Error);
  for (const Scattering& bad :
       {Scattering{-1.0f, 0.5f}, Scattering{NAN, 0.5f}, Scattering{1.0f, 1.5f}, Scattering{1.0f, 1.0f, {}}})
    EXPECT_THROW(ScatteredLight(volume, bad, ScatteredSource::evenSky()), Error);
}

TEST(ScatteredLight, KeepsAsManyMomentsAsThePhaseFunctionHas) {
  const ScatteredLight::Options options{.order = 6};
  EXPECT_EQ(options.degree(legendreMoments(Phase())), 0);
  EXPECT_EQ(options.degree(legendreMoments(Phase::rayleigh())), 0);
  EXPECT_EQ(options.degree(legendreMoments(Phase::henyeyGreenstein(0.3f))), 1);
  EXPECT_EQ(options.degree(legendreMoments(Phase::henyeyGreenstein(0.85f))), 3);
  EXPECT_EQ((ScatteredLight::Options{.order = 4}.degree(legendreMoments(Phase::henyeyGreenstein(0.85f)))), 2);
}

}  // namespace
}  // namespace nephele

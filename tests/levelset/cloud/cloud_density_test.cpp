// From level set to density, against closed forms on a sphere.
#include "nephele/levelset/cloud/cloud_density.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "nephele/levelset/cloud/cloud.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/cloud/density_profile.h"
#include "nephele/modeling/shape/shapes.h"

namespace nephele::test {
namespace {

constexpr float kRadius = 0.5f, kVoxel = 0.02f;
const Box kBox{{-kRadius, -kRadius, -kRadius}, {kRadius, kRadius, kRadius}};

/// A sphere with one layer of this amplitude.
GriddedCumulo ball(float amplitude, float edge) {
  const std::vector<CumuloLayer> layers =
      cumuloLayers({.layers = 1, .amplitude = amplitude, .frequency = 6, .seed = 3});
  return griddedCumulo(sphere({}, kRadius), layers, {.voxelSize = kVoxel, .box = kBox, .edge = edge / 2});
}

std::shared_ptr<const BrickGrid> densityOf(const GriddedCumulo& cloud, const CloudDensityOptions& options) {
  return toBricks(cloudDensity(cloud, options));
}

/// Calls check(point, value) at every voxel of the box of `cloud`.
template <class Check>
void forVoxels(const GriddedCumulo& cloud, const BrickGrid& grid, const Check& check) {
  const int n = int(cloud.box.max.x / kVoxel) + 1;
  for (int k = -n; k <= n; ++k)
    for (int j = -n; j <= n; ++j)
      for (int i = -n; i <= n; ++i) {
        check(Vec3f{float(i), float(j), float(k)} * kVoxel, grid.at({i, j, k}));
        if (testing::Test::HasFatalFailure()) return;
      }
}

TEST(CloudDensity, RisesOverTheEdgeAsAsked) {
  const float edge = 0.3f;
  const GriddedCumulo cloud = ball(0, edge);
  for (const std::optional<float> exponent :
       {std::optional<float>(), std::optional(1.0f), std::optional(2.5f)}) {
    const auto grid =
        densityOf(cloud, {.voxelSize = kVoxel, .edgeThickness = edge, .edgeExponent = exponent});
    forVoxels(cloud, *grid, [&](const Vec3f& p, float value) {
      const double t = std::clamp(double(kRadius - length(p)) / edge + 0.5, 0.0, 1.0);
      const double expected = exponent ? std::pow(t, double(*exponent)) : t * t * (3 - 2 * t);
      ASSERT_NEAR(value, expected, 1e-4) << p.x << " " << p.y << " " << p.z;
    });
  }
}

TEST(CloudDensity, HoldsTheDisplacementOverAllOfAThickEdge) {
  // The edge reaches 7.5 voxels in, beyond the 3 that a layer keeps by itself.
  const float edge = 0.3f, amplitude = 0.01f;
  const GriddedCumulo cloud = ball(amplitude, edge);
  const ScalarField noise =
      cumuloLayers({.layers = 1, .amplitude = amplitude, .frequency = 6, .seed = 3})[0].noise;
  // One layer on a sphere: l = R - |x| + a |N(R x / |x|)|. Towards the centre waves crowd, so that the
  // layer's grid, made for the surface, holds them less well.
  std::size_t deep = 0;
  for (int i = 0; i < 400; ++i) {
    const float turn = 2.4f * float(i), up = -0.95f + 1.9f * float(i) / 400, side = std::sqrt(1 - up * up);
    const Vec3f direction{side * std::cos(turn), up, side * std::sin(turn)};
    const float displacement = amplitude * std::abs(noise(direction * kRadius));
    for (const float depth : {0.02f, 0.06f, 0.09f, 0.12f, 0.15f}) {
      if (depth > 0.15f - displacement) continue;
      ASSERT_NEAR(cloud.surface(direction * (kRadius - depth)), depth + displacement, 0.2f * amplitude);
      deep += depth > 0.065f;
    }
  }
  EXPECT_GT(deep, 500u);
}

TEST(CloudDensity, IsMultipliedByTheFactorEverywhere) {
  const GriddedCumulo cloud = ball(0.02f, 0.04f);
  const auto plain = densityOf(cloud, {.voxelSize = kVoxel, .edgeThickness = 0.04f});
  const ScalarField factor =
      densityFactor({.low = -0.5f,
                     .high = 0.5f,
                     .interiorNoise = 0.5f,
                     .interiorFrequency = 3,
                     .flatBase = DensityProfile::FlatBase{.height = -0.3f, .softness = 0.1f},
                     .heightProfile = {{0.5f, 1}, {1, 0.4f}}});
  const auto shaped = densityOf(cloud, {.voxelSize = kVoxel, .edgeThickness = 0.04f, .factor = factor});
  forVoxels(cloud, *shaped, [&](const Vec3f& p, float value) {
    const Vec3i voxel{int(std::lround(p.x / kVoxel)), int(std::lround(p.y / kVoxel)),
                      int(std::lround(p.z / kVoxel))};
    ASSERT_NEAR(value, plain->at(voxel) * factor(p), 1e-6f) << p.x << " " << p.y << " " << p.z;
  });
}

TEST(CloudDensity, KeepsTilesWhereTheFactorIsOneNumber) {
  const GriddedCumulo cloud = ball(0, 0.04f);
  const auto voxels = [&](const ScalarField& factor) {
    return cloudDensity(cloud, {.voxelSize = kVoxel / 2, .edgeThickness = 0.04f, .factor = factor})
        .memoryBytes();
  };
  const auto plain = voxels(1.0f);
  // A constant costs nothing; half of the cloud cut away costs less than the whole.
  EXPECT_EQ(voxels(0.25f), plain);
  EXPECT_LT(voxels(densityFactor({.flatBase = DensityProfile::FlatBase{.height = 0, .softness = 0.02f}})),
            plain);
}

TEST(CloudDensity, RefusesNegativeFactorsAndExponents) {
  const GriddedCumulo cloud = ball(0, 0.04f);
  EXPECT_THROW(cloudDensity(cloud, {.voxelSize = kVoxel, .edgeThickness = 0.04f, .edgeExponent = 0.0f}),
               Error);
  EXPECT_THROW(cloudDensity(cloud, {.voxelSize = kVoxel, .edgeThickness = 0.04f, .factor = -0.5f}), Error);
  EXPECT_THROW(
      cloudDensity(cloud, {.voxelSize = kVoxel, .edgeThickness = 0.04f, .factor = plane({}, {0, 1, 0})}),
      Error);
}

TEST(CloudShapeMesh, HasTheSizeAskedForAndStandsOnTheGround) {
  const Mesh mesh = cloudShapeMesh({.species = CloudSpecies::humilis, .seed = 5, .size = 300});
  const Box box = boundingBox(mesh);
  EXPECT_NEAR(box.longestSide(), 300, 9);
  EXPECT_NEAR(box.min.y, 0, 300.0f / 96);
  EXPECT_GT(signedVolume(mesh), 0);
}

}  // namespace
}  // namespace nephele::test

// Layers of any noise whose parameters vary in space, on grids.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <map>
#include <random>

#include "nephele/levelset/cloud/cloud.h"
#include "nephele/levelset/cloud/cloud_density.h"
#include "nephele/levelset/cloud/layers_on_grids.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/cloud/density_profile.h"
#include "nephele/modeling/field/function_field.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/shape/shapes.h"
#include "tests/support/check_field.h"
#include "tests/support/test_data.h"
#include "tests/support/test_meshes.h"

namespace nephele {
namespace {

const Box kTorusBox{{-1.25f, -0.25f, -1.25f}, {1.25f, 0.25f, 1.25f}};

/// 0 below `low`, `value` above `high`, along x.
ScalarField rampAlongX(float low, float high, float value) {
  return ramp(plane({}, {1, 0, 0}), {{low, 0}, {high, value}});
}

/// The same value everywhere, as a field that knows so.
ScalarField field(float value) {
  return functionField([=](const Vec3f&) { return value; },
                       {.range = [=](const Box&) { return Interval::of(value); }});
}

/// Points of `box` at which `level` is inside `band`.
test::Points pointsInBand(const ScalarField& level, const Interval& band, const Box& box, std::size_t count) {
  std::mt19937 random(1);
  test::Points kept;
  while (kept.size() < count) {
    const test::Points drawn = test::randomPoints(box, 4096, random);
    const auto values = test::evaluate(level, drawn);
    for (std::size_t i = 0; i < drawn.size() && kept.size() < count; ++i) {
      if (!band.contains(values.data[0][i])) continue;
      kept.x.push_back(drawn.x[i]);
      kept.y.push_back(drawn.y[i]);
      kept.z.push_back(drawn.z[i]);
    }
  }
  return kept;
}

std::vector<float> valuesAt(const ScalarField& f, const test::Points& points) {
  return test::evaluate(f, points).data[0];
}

float percentile(std::vector<float> values, double share) {
  const auto nth = values.begin() + std::ptrdiff_t(share * double(values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

NoiseOptions noiseOf(NoiseKind kind) {
  return {.kind = kind, .spectrum = {.lowest = 0.5f, .highest = 2, .tile = 8, .resolution = 64}};
}

TEST(CumuloFields, LayersAreLeftOutWhereTheirAmplitudeIsZero) {
  // The noise counts where it is asked for: on the left, farther from the ramp than a surface point of a
  // brick that the ramp concerns.
  std::atomic<int> left{0}, right{0};
  const auto layersOf = [&](const ScalarField& amplitude) {
    std::vector<CumuloLayer> layers = cumuloLayers({.layers = 3, .amplitude = amplitude, .frequency = 3});
    for (CumuloLayer& layer : layers) {
      const ScalarField noise = layer.noise;
      layer.noise = functionField(
          [&left, &right, noise](const Vec3f& p) {
            ++(p.x < -1.0f ? left : right);
            return noise(p);
          },
          {.range = [noise](const Box& box) { return noise.range(box); }});
    }
    return layers;
  };
  const float voxel = 0.02f, amplitude = 0.015f;
  const auto run = [&](const ScalarField& height) {
    left = right = 0;
    return griddedCumulo(torus(), layersOf(height), {.voxelSize = voxel, .box = kTorusBox});
  };
  const GriddedCumulo all = run(amplitude);
  EXPECT_GT(left, 10000);
  const GriddedCumulo half = run(rampAlongX(-0.05f, 0.05f, amplitude));
  EXPECT_EQ(left, 0);
  EXPECT_GT(right, 10000);
  for (int i = 0; i < 3; ++i) {
    const double share =
        double(half.layers[std::size_t(i)].activeVoxels) / double(all.layers[std::size_t(i)].activeVoxels);
    // Half of the torus, and bricks of up to 8 voxels of 1/27 that lie near the ramp.
    EXPECT_GT(share, 0.45) << i;
    EXPECT_LT(share, 0.62) << i;
  }
  // Nothing is missing: where the amplitude is whole, the cloud is that of constants, but for the rounding of
  // bricks that have another range of values.
  const test::Points points =
      pointsInBand(all.surface, {-2 * voxel, 2 * voxel}, {{0.2f, -0.5f, -1.5f}, {1.5f, 0.5f, 1.5f}}, 2000);
  const std::vector<float> a = valuesAt(half.surface, points), b = valuesAt(all.surface, points);
  for (std::size_t i = 0; i < points.size(); ++i) ASSERT_NEAR(a[i], b[i], 0.01f * voxel) << i;
}

TEST(CumuloFields, ConstantsAsFieldsGiveTheSameBits) {
  const float voxel = 0.025f;
  const CumuloFractal constants{
      .layers = 2, .amplitude = 0.02f, .frequency = 2, .roughness = 0.5f, .billow = 0.6f, .seed = 3};
  CumuloFractal fields = constants;
  fields.amplitude = field(0.02f);
  fields.frequency = field(2);
  fields.lacunarity = field(2.1f);
  fields.roughness = field(0.5f);
  fields.billow = field(0.6f);
  fields.billowScale = field(1);
  const GriddedCumulo a =
      griddedCumulo(torus(), cumuloLayers(constants), {.voxelSize = voxel, .box = kTorusBox});
  const GriddedCumulo b =
      griddedCumulo(torus(), cumuloLayers(fields), {.voxelSize = voxel, .box = kTorusBox});
  const auto x = toBricks(cloudDensity(a, {.voxelSize = voxel, .edgeThickness = 0.05f}));
  const auto y = toBricks(cloudDensity(b, {.voxelSize = voxel, .edgeThickness = field(0.05f)}));
  EXPECT_EQ(x->table(), y->table());
  EXPECT_EQ(x->values(), y->values());
}

TEST(CumuloFields, VaryingLayersAgreeWithTheProceduralForm) {
  const auto layers = cumuloLayers({.layers = 3,
                                    .amplitude = rampAlongX(-1, 1, 0.03f),
                                    .frequency = 2.0f + rampAlongX(-1, 1, 1),
                                    .lacunarity = 1.8f + rampAlongX(-1, 1, 0.4f),
                                    .roughness = 0.4f + rampAlongX(-1, 1, 0.1f),
                                    .billow = 1.0f - rampAlongX(-1, 1, 0.5f),
                                    .billowScale = 0.8f + rampAlongX(-1, 1, 0.4f)});
  const float voxel = 1 / (12 * layers[2].frequency);
  // The procedural form does not smooth the medial axis.
  const GriddedCumulo gridded =
      griddedCumulo(torus(), layers, {.voxelSize = voxel, .box = kTorusBox, .medialSmoothing = 0});
  const ScalarField procedural = cumulo(torus(), layers, {.voxelSize = voxel});
  const test::Points points = pointsInBand(gridded.surface, {-2 * voxel, 2 * voxel}, gridded.box, 400);
  const std::vector<float> a = valuesAt(gridded.surface, points), b = valuesAt(procedural, points);
  std::vector<float> difference;
  for (std::size_t i = 0; i < points.size(); ++i) difference.push_back(std::abs(a[i] - b[i]) / voxel);
  // The bars of ALGORITHMS 2.4 for constants, voxels.
  EXPECT_LE(percentile(difference, 0.5), 0.01f);
  EXPECT_LE(percentile(difference, 0.95), 0.1f);
  EXPECT_LE(percentile(difference, 0.99), 0.25f);
}

TEST(CumuloFields, LayersOfEveryNoiseAgreeWithTheProceduralForm) {
  for (const NoiseKind kind : noiseKinds()) {
    const bool hasCreases = kind == NoiseKind::worley || kind == NoiseKind::worleyDifference;
    const auto layers = cumuloLayers(
        {.layers = 2, .noise = noiseOf(kind), .amplitude = 0.03f, .frequency = 2.5f, .billow = 0.5f});
    const float voxel = 1 / (12 * layers[1].frequency);
    const GriddedCumulo gridded =
        griddedCumulo(torus(), layers, {.voxelSize = voxel, .box = kTorusBox, .medialSmoothing = 0});
    const ScalarField procedural = cumulo(torus(), layers, {.voxelSize = voxel});
    const test::Points points = pointsInBand(gridded.surface, {-2 * voxel, 2 * voxel}, gridded.box, 2000);
    const std::vector<float> a = valuesAt(gridded.surface, points), b = valuesAt(procedural, points);
    std::vector<float> difference;
    for (std::size_t i = 0; i < points.size(); ++i) difference.push_back(std::abs(a[i] - b[i]) / voxel);
    // The bars of ALGORITHMS 2.4; Worley noises have creases that no grid holds.
    EXPECT_LE(percentile(difference, 0.5), hasCreases ? 0.02f : 0.01f) << noiseName(kind);
    EXPECT_LE(percentile(difference, 0.95), hasCreases ? 0.15f : 0.1f) << noiseName(kind);
    EXPECT_LE(percentile(difference, 0.99), 0.25f) << noiseName(kind);
  }
}

TEST(CumuloFields, EdgesAreAsThickAsAskedWhereTheyAre) {
  const float voxel = 0.02f, radius = 0.5f;
  const ScalarField edge = 0.04f + rampAlongX(-0.4f, 0.4f, 0.16f);
  const auto layers = cumuloLayers({.layers = 1, .amplitude = 0.0f, .frequency = 6});
  const GriddedCumulo cloud = griddedCumulo(
      sphere({}, radius), layers,
      {.voxelSize = voxel, .box = {{-radius, -radius, -radius}, {radius, radius, radius}}, .edge = 0.1f});
  const auto grid = toBricks(cloudDensity(cloud, {.voxelSize = voxel, .edgeThickness = edge}));
  int inEdge = 0;
  for (int k = -32; k <= 32; ++k)
    for (int j = -32; j <= 32; ++j)
      for (int i = -32; i <= 32; ++i) {
        const Vec3f p = Vec3f{float(i), float(j), float(k)} * voxel;
        const double t = std::clamp(double(radius - length(p)) / edge(p) + 0.5, 0.0, 1.0);
        ASSERT_NEAR(grid->at({i, j, k}), t * t * (3 - 2 * t), 1e-4) << p.x << " " << p.y << " " << p.z;
        inEdge += t > 0 && t < 1;
      }
  EXPECT_GT(inEdge, 5000);
}

/// Keeps what it is told.
class Recorder final : public Progress {
 public:
  void begin(std::string_view stage) const override { stage_ = stage; }
  void advance(double fraction) const override { stages[stage_].push_back(fraction); }

  mutable std::map<std::string, std::vector<double>> stages;

 private:
  mutable std::string stage_;
};

TEST(CumuloFields, ProgressRisesFromLayerToLayer) {
  tbb::global_control oneThread(tbb::global_control::max_allowed_parallelism, 1);
  const Recorder progress;
  griddedCumulo(torus(), cumuloLayers({.layers = 2, .amplitude = 0.03f, .frequency = 4}),
                {.voxelSize = 0.02f, .box = kTorusBox}, progress);
  ASSERT_EQ(progress.stages.size(), 2u);
  for (const auto& [stage, fractions] : progress.stages) {
    EXPECT_GE(fractions.size(), 5u) << stage;
    EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end())) << stage;
    EXPECT_GE(fractions.back(), 0.8) << stage;
    EXPECT_LE(fractions.back(), 1) << stage;
  }
}

TEST(CumuloFields, MemoryIsEstimatedNearWhatWasMeasured) {
  const std::string path = test::sharedData("meshes/bunny_60k.obj");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const Mesh mesh = readMesh(path);
  const float longest = boundingBox(mesh).longestSide();
  struct Measured {
    int resolution, layers;
    double megabytes;
  };
  // Peak resident memory of `nephele cloud`, amplitude 2.5 %, frequency 4.4, edge 0.35 %.
  for (const Measured& m : {Measured{256, 4, 125},
                            {512, 3, 137},
                            {512, 4, 276},
                            {1024, 1, 285},
                            {1024, 4, 409},
                            {2048, 4, 1438}}) {
    CloudOptions options;
    options.layers =
        cumuloLayers({.layers = m.layers, .amplitude = 0.025f * longest, .frequency = 4.4f / longest});
    options.voxelSize = longest / float(m.resolution);
    options.edgeThickness = 0.0035f * longest;
    const double estimate = estimatedCloudBytes(mesh, options) / 1e6;
    EXPECT_GE(estimate, 0.9 * m.megabytes) << m.resolution << " " << m.layers;
    EXPECT_LE(estimate, 1.5 * m.megabytes) << m.resolution << " " << m.layers;
  }
}

TEST(CumuloFields, ThickEdgesAreInTheEstimateOfMemory) {
  const Mesh ball = test::icosphere(1, 4);
  constexpr double kVoxel = 0.1;
  for (const double edge : {20.0, 80.0, 320.0}) {
    const double estimate =
        estimatedCloudBytes(ball, {.layers = cumuloLayers({.layers = 1, .amplitude = 0.05f, .frequency = 2}),
                                   .voxelSize = float(kVoxel),
                                   .edgeThickness = float(edge)});
    // A float for each voxel of the ball that is half of the edge larger; the layers reach up to twice as
    // far.
    const double least = 4 * 4.0 / 3 * M_PI * std::pow((1 + edge / 2) / kVoxel, 3);
    EXPECT_GE(estimate, least) << edge;
    EXPECT_LE(estimate, 12 * least) << edge;
  }
}

TEST(CumuloFields, EdgesOutsideTheirRangeAreRefused) {
  const auto layers = cumuloLayers({.layers = 1, .amplitude = 0.01f, .frequency = 3});
  const GriddedCumulo cloud = griddedCumulo(torus(), layers, {.voxelSize = 0.05f, .box = kTorusBox});
  EXPECT_THROW(cloudDensity(cloud, {.voxelSize = 0.05f, .edgeThickness = 0.0f}), Error);
  EXPECT_THROW(cloudDensity(cloud, {.voxelSize = 0.05f, .edgeThickness = rampAlongX(-1, 1, 0.1f)}), Error);
  EXPECT_THROW(cloudDensity(cloud, {.voxelSize = 0.05f, .edgeThickness = INFINITY}), Error);
}

}  // namespace
}  // namespace nephele

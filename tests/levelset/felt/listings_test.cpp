#include "tests/levelset/felt/listings.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/modeling/base/random_stream.h"
#include "nephele/modeling/field/operations.h"

namespace nephele::felt {
namespace {

// What is expected is what the notes say of their scripts, in closed form.

std::vector<Vec3f> pointsWithin(float half, int count = 200) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> at(-half, half);
  std::vector<Vec3f> points;
  for (int i = 0; i < count; ++i) {
    const float x = at(random), y = at(random), z = at(random);
    points.push_back({x, y, z});
  }
  return points;
}

/// How far from the origin `level` is 0 in a direction, between two radii.
float radiusAlong(const ScalarField& level, const Vec3f& direction, float low, float high) {
  for (int i = 0; i < 40; ++i) {
    const float middle = (low + high) / 2;
    (level(direction * middle) > 0 ? low : high) = middle;
  }
  return low;
}

class FeltListings : public ::testing::Test {
 protected:
  void SetUp() override { NEPHELE_REQUIRE_SHARED_DATA(listingPath("01_distance")); }
};

TEST_F(FeltListings, DistanceAndItsGradient) {
  auto values = ran(listing("01_distance"));
  for (const Vec3f& p : pointsWithin(3)) {
    EXPECT_NEAR(values["r"].as<ScalarField>()(p), length(p), 1e-6f * length(p));
    EXPECT_NEAR(length(values["normal"].as<VectorField>()(p) - p / length(p)), 0, 1e-6f);
  }
}

TEST_F(FeltListings, NormalsInCachesAndOfCaches) {
  auto cached = ran(listing("02_caches"));
  auto ofCache = ran(listing("03_gradient_of_a_cache"));
  float apart = 0;
  for (const Vec3f& p : pointsWithin(1)) {
    if (length(p) < 0.5f) continue;
    const Vec3f a = cached["normalSampled"].as<VectorField>()(p),
                b = ofCache["normalSampled"].as<VectorField>()(p);
    EXPECT_NEAR(cached["rSampled"].as<ScalarField>()(p), length(p), 0.01f);
    EXPECT_NEAR(length(a - p / length(p)), 0, 0.01f);
    EXPECT_NEAR(length(b - p / length(p)), 0, 0.01f);
    apart = std::max(apart, length(a - b));
  }
  EXPECT_GT(apart, 1e-5f);
}

TEST_F(FeltListings, CumuloOnASphereIsTheNoiseOnItAlsoInCaches) {
  // r(n) = R + |N(R n)|; cells of half the wave / 8.
  constexpr float kCell = 1.0f / 32;
  const std::string given =
      "scalarfield N = 0.05 * perlin(2, seed = 3);\nscalarfield base = sphere((0,0,0), 1);\n";
  auto free = ran(listing("04_cumulo") + given + "scalarfield cloud = cumulo(base, [N], 3);");
  auto gridded = ran(listing("06_cumulo_with_domains") + given +
                     "domain d((-1.6,-1.6,-1.6), (3.2,3.2,3.2), 0.03125);\n"
                     "scalarfield cloud = cumulo(base, [N], 3, [d]);");
  for (const Vec3f& p : pointsWithin(1)) {
    const Vec3f n = p / length(p);
    const float expected = 1 + std::abs(free["N"].as<ScalarField>()(n));
    const float exact = radiusAlong(free["cloud"].as<ScalarField>(), n, 0.9f, 1.55f);
    EXPECT_NEAR(exact, expected, 0.01f * kCell);
    EXPECT_NEAR(radiusAlong(gridded["cloud"].as<ScalarField>(), n, 0.9f, 1.55f), exact, 0.25f * kCell);
  }
}

TEST_F(FeltListings, NoiseLayersFollowTheirParametersAlsoWhereTheseAreFields) {
  const std::string given = "func scalarfield favoriteNoiseField() { return perlin(1, seed = 3); }\n";
  auto values = ran(given + listing("05_noise_layers") +
                    "scalarfield noise = favoriteNoiseField();\n"
                    "scalarfield[] a = NoiseLayers(3, 1, 2.1, 4, 0.5);\nscalarfield x = identity().x;\n"
                    "scalarfield[] b = NoiseLayers(3, 1, 2 + 0.1 * x, 4 - x, 0.5 + 0.2 * x);\n"
                    "scalarfield a2 = a[2]; scalarfield b2 = b[2]; int n = size(a);");
  EXPECT_EQ(values["n"].as<std::int64_t>(), 3);
  const ScalarField& noise = values["noise"].as<ScalarField>();
  for (const Vec3f& p : pointsWithin(1)) {
    EXPECT_NEAR(values["a2"].as<ScalarField>()(p), noise(p * (4 * 2.1f * 2.1f)) * 0.25f, 1e-4f);
    const float jump = 2 + 0.1f * p.x, rough = 0.5f + 0.2f * p.x;
    EXPECT_NEAR(values["b2"].as<ScalarField>()(p), noise(p * ((4 - p.x) * jump * jump)) * rough * rough,
                1e-4f);
  }
}

TEST_F(FeltListings, NacelleTakesOneSphereToAnotherAlsoInCaches) {
  // Spheres as r^2, of which second order is exact; of distances Gamma is 0.
  const std::string given =
      "scalarfield Lr = 1 - identity() * identity(); scalarfield Lo = 1.69 - identity() * identity();\n"
      "vectorfield Xn = identity(); scalarfield L1 = Lr; domain dom((-1.5,-1.5,-1.5), (3,3,3), 0.04);\n";
  for (const std::string name : {"07_nacelle", "08_nacelle_with_caches"}) {
    auto values = ran(given + listing(name) + "scalarfield off = Lo - compose(Lr, Xnplus1);");
    for (const Vec3f& p : pointsWithin(1))
      EXPECT_NEAR(values["off"].as<ScalarField>()(p * (1.3f / length(p))), 0, 1e-3f) << name;
  }
}

TEST_F(FeltListings, ASphereIsCutIntoTwoClosedHalves) {
  auto values = ran("scalarfield l0 = sphere((0,0,0), 1); scalarfield knife = plane((0,0,0), (1,0,0));\n" +
                    listing("09_cut"));
  for (const char* name : {"cutInsideShape", "cutOutsideShape"}) {
    const MeshDiagnosis is = diagnose(values[name].as<std::shared_ptr<const Shape>>()->mesh);
    EXPECT_TRUE(is.manifold()) << name;
    EXPECT_NEAR(is.volume, 2 * 3.14159265 / 3, 0.01 * 2 * 3.14159265 / 3) << name;
  }
}

const std::string kFlow =
    "vectorfield velocity = 0.2 * curlnoise(\"perlin\", 1.2, 2); float dt = 0.05;\n"
    "scalarfield initialdensity = mask(sphere((0.2,0,0), 0.6), 0.3); scalarfield density = initialdensity;\n";

TEST_F(FeltListings, MapsCarryADensityAsStepsOfItDo) {
  auto steps = ran(kFlow + repeated(20, listing("15_advect_once")));
  auto maps = ran(kFlow + listing("16_map") + repeated(20, listing("17_map_advected")));
  float moved = 0;
  for (const Vec3f& p : pointsWithin(1)) {
    const float density = steps["density"].as<ScalarField>()(p);
    EXPECT_NEAR(maps["density"].as<ScalarField>()(p), density, 1e-5f);
    moved = std::max(moved, std::abs(density - maps["initialdensity"].as<ScalarField>()(p)));
  }
  EXPECT_GT(moved, 0.3f);
}

TEST_F(FeltListings, SelmaKeepsMapsWithinACell) {
  // The map on a grid beside the one without, in the same flow.
  constexpr float kCell = 2.0f / 32;
  auto values = ran("domain region((-1,-1,-1), (2,2,2), 2.0 / 32); vector gravity = (0,-1,0);\n" + kFlow +
                    listing("16_map") + "vectorfield free = identity();\n" +
                    repeated(10, "free = advect(free, velocity, dt);\n" + listing("18_selma")));
  float moved = 0;
  for (const Vec3f& p : pointsWithin(0.6f)) {
    const Vec3f onGrid = values["Xmap"].as<VectorField>()(p), free = values["free"].as<VectorField>()(p);
    EXPECT_LT(length(onGrid - free), kCell) << length(free - p);
    moved = std::max(moved, length(free - p));
  }
  EXPECT_GT(moved, 2 * kCell);
}

}  // namespace
}  // namespace nephele::felt

#include <gtest/gtest.h>

#include <cmath>

#include "nephele/modeling/field/calculus.h"
#include "nephele/modeling/field/operations.h"
#include "tests/levelset/felt/listings.h"

namespace nephele::felt {
namespace {

// Chapter 6 of the notes: flows that are driven by what they carry.

constexpr int kCells = 24, kSteps = 40;
constexpr float kHalf = 2, kCell = 2 * kHalf / kCells;
const std::string kRegion =
    "domain region((-2,-2,-2), (4,4,4), 4.0 / 24); float dt = 0.1; vector gravity = (0,-1,0);\n"
    "vectorfield velocity = vectorfield((0,0,0));\n";
const std::string kSources =
    "vector hotpoint = (0,-0.9,0); vector coldpoint = (0,0.9,0); scalarfield hot = 0; scalarfield cold = "
    "0;\n";

/// Sums over the samples of the region.
struct Moments {
  double mass = 0, height = 0, broken = 0, unmirrored = 0;

  explicit Moments(const ScalarField& f) {
    for (int z = 0; z <= kCells; ++z)
      for (int y = 0; y <= kCells; ++y)
        for (int x = 0; x <= kCells; ++x) {
          const Vec3f p = Vec3f{float(x), float(y), float(z)} * kCell - Vec3f{kHalf, kHalf, kHalf};
          const float value = f(p);
          mass += double(value);
          height += double(value) * double(p.y);
          const float steps = value / 0.1f;
          broken += double(std::abs(steps - std::round(steps)) > 1e-3f);
          unmirrored += double(std::abs(value - f({-p.x, p.y, p.z})));
        }
    height /= mass;
    unmirrored /= mass;
  }
};

class FeltFlows : public ::testing::Test {
 protected:
  void SetUp() override { NEPHELE_REQUIRE_SHARED_DATA(listingPath("10_buoyant_flow")); }
};

void expectNoDivergence(std::map<std::string, Value>& values) {
  const VectorField& velocity = values["velocity"].as<VectorField>();
  const ScalarField divergence = div(velocity);
  float fastest = 0, most = 0;
  for (int z = 0; z < kCells; ++z)
    for (int y = 0; y < kCells; ++y)
      for (int x = 0; x < kCells; ++x) {
        const Vec3f p = Vec3f{float(x), float(y), float(z)} * kCell - Vec3f{kHalf, kHalf, kHalf};
        fastest = std::max(fastest, length(velocity(p)));
        most = std::max(most, std::abs(divergence(p)));
      }
  EXPECT_GT(fastest, 0.1f);
  EXPECT_LT(most, 1e-4f * fastest / kCell);
}

TEST_F(FeltFlows, WhatIsLighterRisesAndTheFlowHasNoDivergence) {
  auto values = ran(kRegion + "scalarfield density = mask(sphere((0,-0.9,0), 0.6), 0.3);\n" +
                    "scalarcache densityCache(region); scalarfield before = density;\n" +
                    repeated(kSteps, listing("10_buoyant_flow")));
  expectNoDivergence(values);
  const Moments before(values["before"].as<ScalarField>()), after(values["density"].as<ScalarField>());
  EXPECT_GT(after.height, before.height + 0.3);
  EXPECT_NEAR(after.mass / before.mass, 1, 0.2);
}

TEST_F(FeltFlows, HotRisesColdSinksAndTheyMeet) {
  auto values = ran(listing("12_inject") + kRegion + kSources + repeated(kSteps, listing("11_hot_and_cold")));
  expectNoDivergence(values);
  const Moments hot(values["hot"].as<ScalarField>()), cold(values["cold"].as<ScalarField>());
  EXPECT_GT(hot.height, -0.8);
  EXPECT_LT(cold.height, 0.8);
  // What was poured in is 4/3 pi of volume times dt a step; semi-Lagrangian steps keep it roughly. The two
  // are mirrored in the plane between them.
  EXPECT_NEAR(hot.mass * kCell * kCell * kCell / (4.18879 * 0.1 * kSteps), 1, 0.5);
  EXPECT_NEAR(cold.mass / hot.mass, 1, 1e-3);
  EXPECT_NEAR(cold.height, -hot.height, 1e-3);
  const ScalarField both = min(values["hot"].as<ScalarField>(), values["cold"].as<ScalarField>());
  EXPECT_GT(Moments(both).mass, 1);
}

TEST_F(FeltFlows, WithoutGridsEdgesStaySharpAndSidesAlike) {
  // What was poured in as whole numbers of dt is carried along as such.
  constexpr int kFew = 12;
  auto gridless =
      ran(listing("12_inject") + kRegion + kSources + repeated(kFew, listing("13_hot_and_cold_gridless")));
  auto gridded = ran(listing("12_inject") + kRegion + kSources + repeated(kFew, listing("11_hot_and_cold")));
  expectNoDivergence(gridless);
  const Moments sharp(gridless["hot"].as<ScalarField>()), smeared(gridded["hot"].as<ScalarField>());
  EXPECT_EQ(sharp.broken, 0);
  EXPECT_GT(smeared.broken, 100);
  EXPECT_LT(sharp.unmirrored, 1e-3);
  EXPECT_LT(smeared.unmirrored, 1e-3);
}

// Hot and cold from opposite ends, equal and opposite: speeds are mirror images for 50 steps, within 1e-3 of
// the largest.
TEST_F(FeltFlows, WithoutGridsHotAndColdStayMirrorImages) {
  auto values = ran(listing("12_inject") +
                    "domain region((0,0,0), (10,10,10), 0.5); float dt = 0.25; vector gravity = (0,-1,0);\n"
                    "vectorfield velocity = (0,0,0); scalarfield hot = 0; scalarfield cold = 0;\n"
                    "vector hotpoint = (5,2.5,5); vector coldpoint = (5,7.5,5);\n" +
                    repeated(50, listing("13_hot_and_cold_gridless")));
  const auto& velocity = values["velocity"].as<VectorField>();
  float fastest = 0, most = 0;
  for (int z = 0; z <= 20; ++z)
    for (int y = 0; y <= 10; ++y)
      for (int x = 0; x <= 20; ++x) {
        const Vec3f p = Vec3f{float(x), float(y), float(z)} * 0.5f;
        const float here = length(velocity(p)), there = length(velocity({p.x, 10 - p.y, p.z}));
        fastest = std::max(fastest, here);
        most = std::max(most, std::abs(here - there));
      }
  EXPECT_GT(fastest, 0.5f);
  EXPECT_LT(most, 1e-3f * fastest);
}

TEST_F(FeltFlows, ObstaclesTurnBackWhatFlowsOutAsPrintedAndInWithTheSignMended) {
  const std::string given =
      "vectorfield velocity = curlnoise(\"perlin\", 1, 4); scalarfield object = sphere((0.013,0,0), 1);\n";
  const std::string printed = listing("14_obstacle");
  std::string mended = printed;
  const std::size_t at = mended.find("mask(normalU)");
  ASSERT_NE(at, std::string::npos);
  mended.insert(at + 5, "-");
  auto outward = ran(given + printed), inward = ran(given + mended);
  int turned = 0;
  for (int i = 0; i < 500; ++i) {
    const float a = float(i) * 2.4f, h = 2 * (float(i) + 0.5f) / 500 - 1, r = std::sqrt(1 - h * h);
    const Vec3f n{r * std::cos(a), h, r * std::sin(a)}, p = n * 0.99f + Vec3f{0.013f, 0, 0};
    const float outflow = dot(inward["velocity"].as<VectorField>()(p), n);
    EXPECT_GE(outflow, -1e-5f);
    EXPECT_LE(dot(outward["velocity"].as<VectorField>()(p), n), 1e-5f);
    turned += outflow > 0.01f;
  }
  EXPECT_GT(turned, 400);
}

}  // namespace
}  // namespace nephele::felt

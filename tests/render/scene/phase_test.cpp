#include "nephele/render/scene/phase.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/math.h"

namespace nephele {
namespace {

constexpr double kExactPi = 3.14159265358979323846;

struct Kind {
  std::string name;
  Phase phase;
};

std::vector<Kind> kinds() {
  std::vector<Kind> all;
  const auto add = [&](const std::string& text) { all.push_back({text, Phase::parse(text)}); };
  for (const char* text : {"isotropic",
                           "rayleigh",
                           "hg:-0.9",
                           "hg:-0.3",
                           "hg:0.0001",
                           "hg:0.3",
                           "hg:0.7",
                           "hg:0.95",
                           "hg:0.99",
                           "schlick:-0.8",
                           "schlick:0.005",
                           "schlick:0.02",
                           "schlick:0.5",
                           "schlick:0.99",
                           "two-lobe:0.8,-0.3,0.25",
                           "two-lobe:0.8,-0.3,0",
                           "two-lobe:-0.99,0.5,1",
                           "mie:0.01",
                           "mie:0.1",
                           "mie:0.3",
                           "mie:1",
                           "mie:1.5",
                           "mie:3",
                           "mie:5",
                           "mie:10",
                           "mie:20",
                           "mie:50"})
    add(text);
  for (const float g : {-0.6f, -5e-4f, 0.0f, 9e-4f, 1.1e-3f, 0.5f, 0.9f})
    for (const float alpha : {0.1f, 1.0f, 30.0f, 250.0f})
      all.push_back({"draine " + std::to_string(g) + " " + std::to_string(alpha), Phase::draine(g, alpha)});
  return all;
}

// Integral over the sphere, forward of cosine `from`, of phase(c) f(c): the midpoint rule in x, with c = 1 -
// 2 x^4 / (x^4 + (1 - x)^4), which is fine at both poles.
template <class F>
double overSphere(const Phase& phase, F&& f) {
  constexpr int steps = 20000;
  double sum = 0;
  for (int i = 0; i != steps; ++i) {
    const double x = (i + 0.5) / steps, y = 1 - x;
    const double a = x * x * x * x, b = y * y * y * y, s = a + b;
    const double c = (b - a) / s, slope = 8 * (x * x * x * b + y * y * y * a) / (s * s);
    sum += double(phase(float(c))) * f(c) * slope;
  }
  return sum * 2 * kExactPi / steps;
}

TEST(Phase, IntegratesToOne) {
  for (const Kind& kind : kinds())
    EXPECT_NEAR(overSphere(kind.phase, [](double) { return 1.0; }), 1.0, 3e-5) << kind.name;
}

TEST(Phase, KnowsItsMeanCosine) {
  for (const Kind& kind : kinds())
    EXPECT_NEAR(overSphere(kind.phase, [](double c) { return c; }), kind.phase.meanCosine(), 3e-5)
        << kind.name;
}

TEST(Phase, IsOneOverFourPiWhereIsotropic) {
  for (const float c : {-1.0f, 0.2f, 1.0f}) EXPECT_FLOAT_EQ(Phase()(c), 1 / (4 * kPi));
}

TEST(Phase, HasTheValuesOfItsFormulas) {
  for (const float c : {-1.0f, -0.4f, 0.0f, 0.7f, 1.0f}) {
    EXPECT_NEAR(Phase::rayleigh()(c) / (3 * (1 + c * c) / (16 * kPi)), 1, 1e-6f);
    EXPECT_NEAR(Phase::henyeyGreenstein(0.6f)(c) / (0.64f / (4 * kPi * std::pow(1.36f - 1.2f * c, 1.5f))), 1,
                1e-5f);
    EXPECT_NEAR(Phase::schlick(-0.5f)(c) / (0.75f / (4 * kPi * (1 + 0.5f * c) * (1 + 0.5f * c))), 1, 1e-5f);
    EXPECT_NEAR(Phase::twoLobe(0.6f, -0.2f, 0.3f)(c) /
                    (0.7f * Phase::henyeyGreenstein(0.6f)(c) + 0.3f * Phase::henyeyGreenstein(-0.2f)(c)),
                1, 1e-5f);
    // Draine's is Cornette and Shanks' at alpha = 1: 3 (1 - g^2) (1 + c^2) / (8 pi (2 + g^2) s^1.5).
    EXPECT_NEAR(Phase::draine(0.6f, 1)(c) /
                    (3 * 0.64f * (1 + c * c) / (8 * kPi * 2.36f * std::pow(1.36f - 1.2f * c, 1.5f))),
                1, 1e-5f);
  }
}

TEST(Phase, FitsMieAsPublished) {
  // From the talk's formulas at 20 micrometres, in double: g_HG 0.994610, g_D 0.593791, alpha 27.1137, w_D
  // 0.498159.
  const auto draine = [](float g, float alpha, float c) { return Phase::draine(g, alpha)(c); };
  for (const float c : {-1.0f, -0.3f, 0.5f, 0.9f}) {
    const float s = 1 + 0.994610f * 0.994610f - 2 * 0.994610f * c;
    const float peak = (1 - 0.994610f * 0.994610f) / (4 * kPi * std::pow(s, 1.5f));
    EXPECT_NEAR(Phase::mie(20)(c) / ((1 - 0.498159f) * peak + 0.498159f * draine(0.593791f, 27.1137f, c)), 1,
                1e-3f)
        << c;
  }
  // Mie's exact asymmetry of cloud droplets is 0.84 to 0.87 (Hansen and Travis 1974, figure 12, 10
  // micrometres and more at 0.55); the fit leaves out a part of the diffraction peak.
  for (const float d : {10.0f, 20.0f, 40.0f}) EXPECT_NEAR(Phase::mie(d).meanCosine(), 0.855f, 0.04f) << d;
  // As droplets vanish: Rayleigh's.
  for (const float c : {-1.0f, 0.0f, 0.6f}) EXPECT_NEAR(Phase::mie(0.002f)(c), Phase::rayleigh()(c), 2e-3f);
}

TEST(Phase, TheRangesOfTheMieFitNearlyMeet) {
  for (const float d : {0.1f, 1.5f, 5.0f})
    EXPECT_NEAR(Phase::mie(d * 0.9999f).meanCosine(), Phase::mie(d * 1.0001f).meanCosine(), 0.03f) << d;
}

TEST(Phase, DrawsCosinesOfItsOwnDistribution) {
  // The cosines of u2 = 0 .. 1 divide the sphere's integral evenly: between two of them lies their difference
  // in u2. Checked through lobes one by one, as u1 keeps to one lobe.
  for (const Kind& kind : kinds()) {
    double mean = 0;
    constexpr int lobes = 200, steps = 250;
    for (int i = 0; i != lobes; ++i)
      for (int j = 0; j != steps; ++j)
        mean += double(kind.phase.sampleCosine((float(i) + 0.5f) / lobes, (float(j) + 0.5f) / steps));
    // 1 / 200 of a lobe's share, whose means differ by at most 1.5, is how well u1 is resolved.
    EXPECT_NEAR(mean / (lobes * steps), kind.phase.meanCosine(), 5e-3) << kind.name;
  }
}

TEST(Phase, FillsAHistogramEvenly) {
  // Random pairs from a rank-1 lattice, against the integral of the density over each of 20 bins, whose edges
  // are graded towards the poles.
  constexpr int bins = 20, samples = 20000;
  for (const Kind& kind : kinds()) {
    std::vector<double> counts(bins), expected(bins);
    const auto binOf = [&](double c) {
      return std::min(bins - 1, int(std::acos(std::fmin(1.0, std::fmax(-1.0, c))) / kExactPi * bins));
    };
    for (int i = 0; i != samples; ++i) {
      const double u1 = std::fmod(0.7548776662466927 * i, 1.0), u2 = std::fmod(0.5698402909980532 * i, 1.0);
      counts[std::size_t(binOf(double(kind.phase.sampleCosine(float(u1), float(u2)))))] += 1.0 / samples;
    }
    for (int bin = 0; bin != bins; ++bin)
      expected[std::size_t(bin)] =
          overSphere(kind.phase, [&](double c) { return binOf(c) == bin ? 1.0 : 0.0; });
    for (int bin = 0; bin != bins; ++bin)
      EXPECT_NEAR(counts[std::size_t(bin)], expected[std::size_t(bin)], 2e-3) << kind.name << " bin " << bin;
  }
}

TEST(Phase, DrawsCosinesInOrderAndWithinBounds) {
  for (const Kind& kind : kinds())
    for (const float u1 : {0.0f, 0.999f}) {
      float before = -1;
      for (int i = 0; i <= 1000; ++i) {
        const float c = kind.phase.sampleCosine(u1, float(i) / 1000);
        ASSERT_GE(c, before) << kind.name << " " << i;
        ASSERT_LE(c, 1.0f) << kind.name;
        before = c;
      }
      EXPECT_NEAR(kind.phase.sampleCosine(u1, 0), -1, 1e-5f) << kind.name;
      EXPECT_NEAR(kind.phase.sampleCosine(u1, 1), 1, 1e-5f) << kind.name;
    }
}

TEST(Phase, FlattensTowardsIsotropic) {
  EXPECT_FLOAT_EQ(Phase::henyeyGreenstein(0.6f).flattened(0.5f).meanCosine(), 0.3f);
  for (const Kind& kind : kinds()) {
    for (const float c : {-0.9f, 0.1f, 1.0f}) {
      EXPECT_NEAR(kind.phase.flattened(1)(c), kind.phase(c), 1e-6f * kind.phase(c)) << kind.name;
      EXPECT_NEAR(kind.phase.flattened(0)(c), 1 / (4 * kPi), 1e-6f) << kind.name;
    }
    EXPECT_LE(std::fabs(kind.phase.flattened(0.5f).meanCosine()),
              std::fabs(kind.phase.meanCosine()) + 1e-6f + (kind.name.starts_with("two") ? 1.0f : 0.0f))
        << kind.name;
  }
}

TEST(Phase, ReadsItsForms) {
  EXPECT_EQ(Phase::parse("isotropic").meanCosine(), 0.0f);
  EXPECT_FLOAT_EQ(Phase::parse("hg:-0.25").meanCosine(), -0.25f);
  EXPECT_FLOAT_EQ(Phase::parse("two-lobe:0.8,-0.4,0.25").meanCosine(), 0.5f);
  EXPECT_EQ(Phase::parse("mie:12.5")(0.3f), Phase::mie(12.5f)(0.3f));
  for (const char* text : {"",
                           "hg",
                           "hg:",
                           "hg:1",
                           "hg:-1",
                           "hg:nan",
                           "hg:0.5x",
                           "hg:0.5,",
                           "Isotropic",
                           "mie",
                           "mie:0",
                           "mie:-3",
                           "mie:50.1",
                           "mie:inf",
                           "schlick:1",
                           "two-lobe:0.5,0.5",
                           "two-lobe:0.5,0.5,1.1",
                           "two-lobe:0.5;0.5;1",
                           "rayleigh:1",
                           "draine:0.5,1"})
    EXPECT_THROW(Phase::parse(text), Error) << text;
  try {
    Phase::parse("mie:80");
  } catch (const Error& error) {
    for (const char* part : {"mie:80", "hg:G", "schlick:K", "two-lobe:G1,G2,MIX", "mie:MICROMETRES", "50"})
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << part;
  }
}

}  // namespace
}  // namespace nephele

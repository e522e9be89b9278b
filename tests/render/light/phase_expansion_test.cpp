#include "nephele/render/light/phase_expansion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/math.h"

namespace nephele {
namespace {

double legendre(int degree, double c) {
  double before = 0, value = 1;
  for (int l = 0; l != degree; ++l) {
    const double next = ((2 * l + 1) * c * value - l * before) / (l + 1);
    before = value;
    value = next;
  }
  return value;
}

TEST(PhaseExpansion, OfHenyeyGreensteinIsPowersOfItsMeanCosine) {
  for (const float g : {0.0f, 0.3f, -0.6f, 0.85f, 0.95f, 0.99f}) {
    const std::vector<float> moments = legendreMoments(Phase::henyeyGreenstein(g));
    for (std::size_t l = 0; l != moments.size(); ++l)
      ASSERT_NEAR(moments[l], std::pow(double(g), double(l)), 2e-5) << g << " " << l;
    // All that are left out are small.
    EXPECT_LT(std::pow(std::fabs(g), 2.0 * double(moments.size())), 1.1e-5) << g;
  }
}

TEST(PhaseExpansion, OfOtherPhasesAddsUpToThem) {
  // Rayleigh: 1, 0, 1 / 10 exactly. The others by their mean cosine, and by the sum itself where it
  // converges.
  const std::vector<float> rayleigh = legendreMoments(Phase::rayleigh());
  EXPECT_NEAR(rayleigh[1], 0, 1e-6);
  EXPECT_NEAR(rayleigh[2], 0.1, 1e-6);
  for (const char* form : {"mie:20", "mie:3", "two-lobe:0.8,-0.4,0.3", "schlick:0.7"}) {
    const Phase phase = Phase::parse(form);
    const std::vector<float> moments = legendreMoments(phase);
    EXPECT_NEAR(moments[0], 1, 1e-6) << form;
    EXPECT_NEAR(moments[1], phase.meanCosine(), 1e-4) << form;
  }
  const Phase lobes = Phase::twoLobe(0.8f, -0.4f, 0.3f);
  const std::vector<float> moments = legendreMoments(lobes);
  for (const float c : {-1.0f, -0.3f, 0.5f, 0.9f}) {
    double sum = 0;
    for (std::size_t l = 0; l != moments.size(); ++l)
      sum += double(2 * l + 1) / (4 * double(kPi)) * double(moments[l]) * legendre(int(l), double(c));
    EXPECT_NEAR(sum / double(lobes(c)), 1, 0.05) << c;
  }
}

TEST(SmoothScattering, TakesThePeakAway) {
  // Wiscombe's delta-M by hand: f = g^(degree + 1), sigma (1 - a f), a (1 - f) / (1 - a f), (g^l - f) / (1 -
  // f).
  const float g = 0.85f, a = 0.9f;
  const SmoothScattering smooth(legendreMoments(Phase::henyeyGreenstein(g)), a, 3);
  const double f = std::pow(0.85, 4);
  EXPECT_NEAR(smooth.share, 1 - 0.9 * f, 1e-5);
  EXPECT_NEAR(smooth.albedo, 0.9 * (1 - f) / (1 - 0.9 * f), 1e-5);
  ASSERT_EQ(smooth.moments.size(), 4u);
  for (int l = 0; l != 4; ++l)
    EXPECT_NEAR(smooth.moments[std::size_t(l)], (std::pow(0.85, l) - f) / (1 - f), 1e-4) << l;
  // What is absorbed and what is transported stay.
  EXPECT_NEAR(smooth.share * (1 - smooth.albedo), 0.1, 1e-5);
  EXPECT_NEAR(smooth.share * (1 - smooth.albedo * smooth.moments[1]), 1 - 0.9 * 0.85, 1e-5);
  // Nothing is lost where nothing is absorbed.
  EXPECT_EQ(SmoothScattering(legendreMoments(Phase::henyeyGreenstein(g)), 1, 3).albedo, 1);
}

TEST(SmoothScattering, LeavesAPhaseFunctionWhateverItIsOf) {
  // Every mean of a Legendre polynomial is within -1 and 1, and solutions grow without end where one is not.
  for (const char* form : {"hg:-0.99", "hg:-0.6", "hg:0.99", "rayleigh", "two-lobe:0.99,-0.9,0.5", "mie:50"})
    for (int degree = 1; degree <= 5; ++degree) {
      const SmoothScattering smooth(legendreMoments(Phase::parse(form)), 1, degree);
      EXPECT_GT(smooth.share, 0) << form;
      for (const float moment : smooth.moments)
        EXPECT_LE(std::abs(moment), 1 + 1e-5f) << form << ", " << degree;
    }
}

TEST(ForwardLight, IsThePhaseFunctionItselfAtTheSurface) {
  for (const char* form : {"hg:0.85", "hg:0.3", "mie:20", "rayleigh", "two-lobe:0.9,-0.2,0.4"}) {
    const Phase phase = Phase::parse(form);
    const ForwardLight light(phase, legendreMoments(phase), 0.99f, 3, 4);
    for (const float c : {-1.0f, -0.2f, 0.6f, 1.0f}) {
      double sum = 0;
      for (int n = 0; n != light.count(); ++n) sum += double(light.weight(n, c));
      EXPECT_NEAR(sum / double(phase(c)), 1, 1e-3) << form << " " << c;
    }
  }
}

TEST(ForwardLight, IsTheSumOverAllScatterings) {
  // Against the sum over all moments, of a phase function of Henyey-Greenstein and of two lobes: within 2 %
  // of the light at that angle and depth, or of what the light is at the mean over all angles.
  for (const Phase& phase : {Phase::henyeyGreenstein(0.877f), Phase::twoLobe(0.85f, 0.2f, 0.3f)}) {
    const std::vector<float> moments = legendreMoments(phase);
    const ForwardLight light(phase, moments, 0.999f, 3, 6);
    for (const float depth : {0.0f, 0.5f, 2.0f, 4.0f, 8.0f})
      for (const float c : {-0.9f, 0.0f, 0.7f, 0.95f}) {
        double sum = 0;
        for (int n = 0; n != light.count(); ++n)
          sum += double(light.weight(n, c)) * std::exp(-double(depth) * double(light.attenuation(n)));
        const double expected = ForwardLight::exact(moments, 0.999f, 3, depth, c),
                     mean = std::exp(-double(depth) * double(light.attenuation(light.count() - 1))) /
                            (4 * double(kPi));
        EXPECT_NEAR(sum, expected, 0.02 * (std::fabs(expected) + mean)) << depth << " " << c;
      }
  }
}

TEST(ForwardLight, OfOneTermIsSingleScattering) {
  const Phase phase = Phase::henyeyGreenstein(0.85f);
  const ForwardLight light(phase);
  EXPECT_EQ(light.count(), 1);
  EXPECT_EQ(light.attenuation(0), 1);
  EXPECT_EQ(light.weight(0, 0.5f), phase(0.5f));
  EXPECT_THROW(ForwardLight(phase, {1.0f}, 1, 0, 0), Error);
}

}  // namespace
}  // namespace nephele

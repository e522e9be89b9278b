#include "render/phase.h"

#include <gtest/gtest.h>

#include <cmath>

#include "modeling/error.h"
#include "modeling/math.h"

namespace nephele {
namespace {

// Integral over the sphere of phase(c) f(c), by the midpoint rule in c.
template <class F>
double overSphere(const Phase& phase, F&& f) {
  constexpr int steps = 200000;
  double sum = 0;
  for (int i = 0; i != steps; ++i) {
    const double c = -1 + (2 * i + 1.0) / steps;
    sum += phase(float(c)) * f(c);
  }
  return sum * 2 * 3.14159265358979 * 2 / steps;
}

TEST(Phase, IntegratesToOneWithMeanCosineG) {
  for (const float g : {-0.9f, -0.3f, 0.0f, 0.3f, 0.7f, 0.95f}) {
    const Phase phase = Phase::henyeyGreenstein(g);
    EXPECT_NEAR(overSphere(phase, [](double) { return 1.0; }), 1.0, 1e-4) << g;
    EXPECT_NEAR(overSphere(phase, [](double c) { return c; }), g, 1e-4) << g;
  }
}

TEST(Phase, IsOneOverFourPiWhereIsotropic) {
  for (const float c : {-1.0f, 0.2f, 1.0f}) EXPECT_FLOAT_EQ(Phase()(c), 1 / (4 * kPi));
}

TEST(Phase, FlattensItsMeanCosine) {
  EXPECT_FLOAT_EQ(Phase::henyeyGreenstein(0.6f).flattened(0.5f).meanCosine(), 0.3f);
}

TEST(Phase, ReadsItsTwoForms) {
  EXPECT_EQ(Phase::parse("isotropic").meanCosine(), 0.0f);
  EXPECT_FLOAT_EQ(Phase::parse("hg:-0.25").meanCosine(), -0.25f);
  for (const char* text : {"", "hg", "hg:", "hg:1", "hg:-1", "hg:nan", "hg:0.5x", "mie:10", "Isotropic"})
    EXPECT_THROW(Phase::parse(text), Error) << text;
}

}  // namespace
}  // namespace nephele

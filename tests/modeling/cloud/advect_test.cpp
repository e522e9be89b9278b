// Gridless advection against closed forms.
#include "nephele/modeling/cloud/advect.h"

#include <gtest/gtest.h>

#include <limits>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/field/function_field.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"
#include "nephele/modeling/noise/noise.h"
#include "nephele/modeling/shape/shapes.h"
#include "tests/support/check_field.h"

namespace nephele::test {
namespace {

/// Turns about y by one radian per unit of time.
VectorField turning() {
  return functionField([](const Vec3f& p) { return Vec3f{p.z, 0.0f, -p.x}; });
}

/// A velocity with exact derivatives and ranges.
VectorField turbulence() {
  return vectorNoise({.frequency = 1.5f, .seed = 3}) * ScalarField(0.2f);
}

TEST(Advect, ShiftsByVelocityTimesTime) {
  const ScalarField ball = sphere({0, 0, 0}, 1);
  const ScalarField moved = advect(ball, VectorField(Vec3f{2, 0, -1}), {.dt = 0.25f, .steps = 3});
  // 3 steps of (0.5, 0, -0.25).
  EXPECT_FLOAT_EQ(moved({1.5f, 0, -0.75f}), 1.0f);
  EXPECT_FLOAT_EQ(moved({2.5f, 0, -0.75f}), 0.0f);
}

TEST(Advect, WithoutStepsIsTheFieldItself) {
  const ScalarField ball = sphere({0, 0, 0}, 1);
  EXPECT_EQ(advect(ball, turbulence(), {.steps = 0}).node(), ball.node());
}

TEST(Advect, NestsStepsAsEquation73Does) {
  const VectorField u = turbulence();
  const float dt = 0.3f;
  const auto euler = [&](const Vec3f& x) { return x - u(x) * dt; };
  const VectorField map = traceBack(u, {.dt = dt, .steps = 3, .rule = TraceRule::euler});
  for (const Vec3f x : {Vec3f{0.1f, 0.2f, 0.3f}, Vec3f{-1, 2, 0.7f}}) {
    const Vec3f expected = euler(euler(euler(x)));
    EXPECT_LT(length(map(x) - expected), 1e-6f);
  }
}

TEST(Advect, ReadsTheLastVelocityFirst) {
  // Where it was before the last step decides what the first velocity did: X = T_first(T_last(x)).
  const std::vector<VectorField> velocities{turning(), VectorField(Vec3f{1, 0, 0})};
  const Vec3f x = traceBack(velocities, {.dt = 1.0f, .rule = TraceRule::euler})({1, 0, 0});
  // (1,0,0) - (1,0,0) is the centre, which does not turn; in the other order it would not end there.
  EXPECT_LT(length(x), 1e-6f);
}

TEST(Advect, MidpointIsOfSecondOrder) {
  // A quarter turn in n steps: the error of each rule against the circle.
  const auto error = [](TraceRule rule, int steps) {
    const float dt = float(M_PI / 2 / steps);
    const Vec3f x = traceBack(turning(), {.dt = dt, .steps = steps, .rule = rule})({1, 0, 0});
    return double(length(x - Vec3f{0, 0, 1}));
  };
  EXPECT_NEAR(error(TraceRule::euler, 20) / error(TraceRule::euler, 40), 2.0, 0.15);
  EXPECT_NEAR(error(TraceRule::midpoint, 20) / error(TraceRule::midpoint, 40), 4.0, 0.3);
  EXPECT_LT(error(TraceRule::midpoint, 40), 1e-3);
}

/// Error of one step of a place that turns, which is as long as the turn.
double errorOfTurn(bool isCorrected, float dt) {
  const ScalarField x = component(position(), 0);
  const ScalarField moved =
      isCorrected ? macCormack(x, turning(), dt) : advect(x, turning(), {.dt = dt, .rule = TraceRule::euler});
  // The point (0, 0, 1) was at (-sin, 0, cos).
  const Vec3f now{0.3f, 0, 1};
  return std::abs(double(moved(now)) - (0.3 * std::cos(double(dt)) - std::sin(double(dt))));
}

TEST(Advect, MacCormackIsOfSecondOrder) {
  EXPECT_NEAR(errorOfTurn(false, 0.1f) / errorOfTurn(false, 0.05f), 4, 0.4);
  EXPECT_NEAR(errorOfTurn(true, 0.2f) / errorOfTurn(true, 0.1f), 8, 1);
}

TEST(Advect, MacCormackMakesNoNewValues) {
  const ScalarField step = mask(sphere({0, 0, 0}, 0.5f));
  const VectorField colour = vectorField(step, 2.0f * step, 0.0f);
  for (int i = 0; i < 500; ++i) {
    const Vec3f p{-1 + 0.004f * float(i), 0.1f, -0.2f};
    const float value = macCormack(step, turbulence(), 0.7f)(p);
    EXPECT_TRUE(value >= 0 && value <= 1) << value;
    EXPECT_EQ(macCormack(colour, turbulence(), 0.7f)(p).y, 2 * value);
  }
}

TEST(Advect, MacCormackOfAWindIsAShift) {
  const VectorField moved = macCormack(position(), VectorField(Vec3f{1, 0, 2}), 0.5f);
  EXPECT_LT(length(moved({1, 2, 3}) - Vec3f{0.5f, 2, 2}), 1e-6f);
}

TEST(Advect, KeepsThePromisesOfFields) {
  for (const TraceRule rule : {TraceRule::euler, TraceRule::midpoint}) {
    SCOPED_TRACE(int(rule));
    const Box box{{-1, -1, -1}, {1, 1, 1}};
    // A short step of the differences, since three steps of noise bend much.
    const CheckOptions check{.step = 5e-4f, .tolerance = 1e-2f};
    checkField(traceBack(turbulence(), {.dt = 0.4f, .steps = 3, .rule = rule}), box, check);
    checkField(advect(sphere({0, 0, 0}, 0.7f), turbulence(), {.dt = 0.4f, .steps = 2, .rule = rule}), box,
               check);
  }
}

TEST(Advect, CarriesColoursWithoutTurningThem) {
  const VectorField colour = functionField([](const Vec3f& p) { return Vec3f{p.x, 2, 0}; });
  const Vec3f value = advect(colour, turning(), {.dt = 0.1f, .steps = 5})({0, 0, 1});
  EXPECT_FLOAT_EQ(value.y, 2.0f);
  // Half a radian back about y from +z towards -x; sin(0.5) within the second order error of 5 steps.
  EXPECT_NEAR(std::abs(value.x), std::sin(0.5), 1e-3);
}

TEST(Advect, SaysThatItKnowsNothingWhereTheVelocityHasNoBounds) {
  const VectorField map = traceBack(turning(), {.dt = 0.1f});
  EXPECT_EQ(map.range({{0, 0, 0}, {1, 1, 1}})[0], Interval::everything());
}

TEST(Advect, RefusesBadSteps) {
  EXPECT_THROW(traceBack(turning(), {.dt = INFINITY}), Error);
  EXPECT_THROW(traceBack(turning(), {.dt = std::numeric_limits<float>::quiet_NaN()}), Error);
  EXPECT_THROW(traceBack(turning(), {.steps = -1}), Error);
}

TEST(Advect, EndsBetweenStepsWhenCancelled) {
  class Cancelling : public Progress {
   public:
    bool cancelled() const override { return ++asked_ > 1000; }

   private:
    mutable int asked_ = 0;
  };
  const VectorField far = traceBack(VectorField(Vec3f{1e-3f, 0, 0}), {.steps = 2000000000});
  const Cancelling progress;
  const CancelScope scope(&progress);
  EXPECT_THROW(far(Vec3f{1, 2, 3}), Cancelled);
}

}  // namespace
}  // namespace nephele::test

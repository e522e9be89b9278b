#include "apps/detail/time_left.h"

#include <gtest/gtest.h>

#include <cmath>

namespace nephele::apps {
namespace {

// Notes taken every tenth of a second of a stage that has done `work(t)` of itself after t of 7 seconds.
template <class Work>
double largestFactor(const Work& work, int* said = nullptr) {
  constexpr double kSeconds = 7;
  TimeLeft left;
  double most = 1;
  for (double t = 0.1; t < kSeconds; t += 0.1) {
    left.note(t, work(t / kSeconds));
    const auto seconds = left.seconds();
    if (!seconds) continue;
    if (said) ++*said;
    most = std::max({most, (*seconds + 0.5) / (kSeconds - t + 0.5), (kSeconds - t + 0.5) / (*seconds + 0.5)});
  }
  return most;
}

TEST(TimeLeft, IsExactWhereWorkIsEven) {
  int said = 0;
  EXPECT_NEAR(largestFactor([](double t) { return t; }, &said), 1, 1e-9);
  // From a tenth on.
  EXPECT_GE(said, 60);
}

TEST(TimeLeft, IsNeverFarOffWhereWorkStartsSlowly) {
  // A stage whose first two seconds do next to nothing: at 0.1 s its even share promised 7 s / 1e-4.
  const auto slow = [](double t) { return t < 0.3 ? 1e-4 * t : 3e-5 + (1 - 3e-5) * (t - 0.3) / 0.7; };
  EXPECT_LT(largestFactor(slow), 2);
  // Work that grows and work that falls with time.
  EXPECT_LT(largestFactor([](double t) { return t * t; }), 2);
  EXPECT_LT(largestFactor([](double t) { return std::sqrt(t); }), 2);
}

TEST(TimeLeft, SaysNothingOfAFewSteps) {
  TimeLeft left;
  EXPECT_FALSE(left.seconds());
  left.note(1, 0.5);
  EXPECT_FALSE(left.seconds());
  left.note(1, 0.5);
  EXPECT_FALSE(left.seconds());
}

TEST(TimeLeft, HoldsLongStages) {
  TimeLeft left;
  for (int i = 1; i <= 100000; ++i) left.note(0.1 * i, 1e-5 * i);
  ASSERT_TRUE(left.seconds());
  EXPECT_NEAR(*left.seconds(), 0, 1e-6);
}

}  // namespace
}  // namespace nephele::apps

#include "nephele/modeling/base/interval.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace nephele {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();

TEST(Interval, OperationsContainTheResultsOfFloats) {
  std::mt19937 random(1);
  std::normal_distribution<float> number(0, 3);
  const auto interval = [&] {
    const float a = number(random), b = number(random);
    return a < b ? Interval{a, b} : Interval{b, a};
  };
  const auto inside = [&](const Interval& r) {
    const float t = float(random() >> 8) * 0x1p-24f;
    return std::fmin(std::fmax(r.min + t * (r.max - r.min), r.min), r.max);
  };
  for (int i = 0; i < 2000; ++i) {
    const Interval a = interval(), b = interval();
    const Interval sum = a + b, difference = a - b, product = a * b, quotient = a / b, magnitude = abs(a);
    const Interval least = min(a, b), most = max(a, b), squared = square(a), root = sqrt(abs(a));
    for (int k = 0; k < 50; ++k) {
      const float x = k == 0   ? a.min
                      : k == 1 ? a.max
                               : inside(a),
                  y = k < 2    ? b.min
                      : k == 2 ? b.max
                               : inside(b);
      ASSERT_TRUE(sum.contains(x + y));
      ASSERT_TRUE(difference.contains(x - y));
      ASSERT_TRUE(product.contains(x * y));
      ASSERT_TRUE(product.contains(float(double(x) * y)));
      ASSERT_TRUE(quotient.contains(x / y));
      ASSERT_TRUE(magnitude.contains(std::abs(x)));
      ASSERT_TRUE(least.contains(std::fmin(x, y)));
      ASSERT_TRUE(most.contains(std::fmax(x, y)));
      ASSERT_TRUE(squared.contains(x * x));
      ASSERT_TRUE(root.contains(std::sqrt(std::abs(x))));
    }
  }
}

TEST(Interval, RoundsInexactResultsOutward) {
  const Interval third = Interval::of(1) / Interval::of(3);
  EXPECT_LT(double(third.min), 1.0 / 3);
  EXPECT_GT(double(third.max), 1.0 / 3);
}

TEST(Interval, KeepsExactResults) {
  EXPECT_EQ(Interval::of(0) * (Interval{-3, 5}), Interval::of(0));
  EXPECT_EQ((Interval{1, 2}) + Interval::of(1), (Interval{2, 3}));
  EXPECT_EQ(square(Interval{-3, 2}), (Interval{0, 9}));
}

TEST(Interval, GivesEverythingWhereNaNMayOccur) {
  const Interval all = Interval::everything(), up{0, kInf}, zero = Interval::of(0);
  EXPECT_EQ(up - up, all);
  EXPECT_EQ(up * zero, all);
  EXPECT_EQ(zero * all, all);
  EXPECT_EQ(up / up, all);
  EXPECT_EQ((Interval{1, 2}) / (Interval{-1, 1}), all);
  EXPECT_EQ(sqrt(Interval{-1, 4}), all);
  EXPECT_EQ(abs(all), all);
  EXPECT_EQ(square(all), all);
}

TEST(Interval, MinOfAnythingAndABoundIsBounded) {
  // min ignores NaN, so that a bounded operand bounds the result.
  EXPECT_EQ(min(Interval::everything(), Interval{0, 1}), (Interval{-kInf, 1}));
  EXPECT_EQ(max(Interval::everything(), Interval{0, 1}), (Interval{0, kInf}));
}

}  // namespace
}  // namespace nephele

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <vector>

#include "nephele/modeling/base/math.h"
#include "nephele/modeling/field/detail/field_kernels.h"
#include "tests/support/check_field.h"
#include "tests/support/each_target.h"

namespace nephele {
namespace {

using detail::Binary;
using detail::Parameters;
using detail::Unary;

constexpr float kInf = std::numeric_limits<float>::infinity();
const float kNaN = std::nanf("");

/// Arguments that break careless code.
std::vector<float> spicy() {
  std::vector<float> result = {0.0f,    -0.0f,   kInf,        -kInf,      kNaN,     1e-45f,   -1e-45f, 1e-38f,
                               -1e-38f, 3.4e38f, -3.4e38f,    1.0f,       -1.0f,    0.5f,     -0.5f,   2.0f,
                               3.0f,    -2.0f,   1e10f,       -1e10f,     88.72f,   88.73f,   89.0f,   -87.5f,
                               -103.5f, -104.5f, 0.99999994f, 1.0000001f, 38999.0f, 39001.0f, 1e6f};
  for (int i = -8; i <= 8; ++i) result.push_back(float(i) * kPi / 4);
  for (int i = 0; i < 200; ++i) result.push_back(std::ldexp(1.0f + 0.37f * float(i % 3), i - 100));
  for (int i = 0; i < 400; ++i) result.push_back(0.173f * float(i - 200));
  while (result.size() % 16) result.push_back(0.25f);
  return result;
}

/// A lane of any length, aligned as kernels ask for.
class Lane {
 public:
  explicit Lane(std::size_t size) : storage_(size + 16) {}
  explicit Lane(const std::vector<float>& values) : Lane(values.size()) {
    for (std::size_t i = 0; i < values.size(); ++i) data()[i] = values[i];
  }
  float* data() {
    const auto address = reinterpret_cast<std::uintptr_t>(storage_.data());
    return storage_.data() + (64 - address % 64) % 64 / sizeof(float);
  }
  float operator[](std::size_t i) { return data()[i]; }

 private:
  std::vector<float> storage_;
};

double ulps(float a, float truth) {
  const float next = std::nextafter(std::abs(truth), kInf);
  return std::abs(double(a) - truth) / (double(next) - std::abs(truth));
}

struct UnaryCase {
  const char* name;
  Unary op;
  Parameters p = {};
  /// Stated error; 0 asks for equal bits.
  double maxUlps = 0;
  double absolute = 0;
};

class UnaryKernel : public testing::TestWithParam<UnaryCase> {};
void PrintTo(const UnaryCase& c, std::ostream* out) {
  *out << c.name;
}

TEST_P(UnaryKernel, EqualsTheScalarTruth) {
  const UnaryCase& c = GetParam();
  const std::vector<float> arguments = spicy();
  Lane in(arguments), out(arguments.size());
  test::forEachTarget([&] {
    detail::apply(c.op, c.p, in.data(), out.data(), int(arguments.size()));
    for (std::size_t i = 0; i < arguments.size(); ++i) {
      const float truth = detail::scalarValue(c.op, c.p, arguments[i]);
      if (test::sameValue(out[i], truth)) continue;
      ASSERT_FALSE(std::isnan(out[i]) || std::isnan(truth))
          << arguments[i] << ": " << out[i] << ", not " << truth;
      ASSERT_TRUE(ulps(out[i], truth) <= c.maxUlps || std::abs(double(out[i]) - truth) <= c.absolute)
          << arguments[i] << ": " << out[i] << ", not " << truth;
    }
  });
}

TEST_P(UnaryKernel, GradientKernelGivesTheSameValueAndTheChainRule) {
  const UnaryCase& c = GetParam();
  const std::vector<float> arguments = spicy();
  const int n = int(arguments.size());
  Lane in(arguments), out(arguments.size()), value(arguments.size());
  Lane g0(arguments.size()), g1(arguments.size()), g2(arguments.size());
  float* const g[3] = {g0.data(), g1.data(), g2.data()};
  for (int i = 0; i < n; ++i) g[0][i] = 1, g[1][i] = -2, g[2][i] = 0;
  detail::apply(c.op, c.p, in.data(), value.data(), n);
  detail::applyGrad(c.op, c.p, in.data(), out.data(), g, n);
  for (int i = 0; i < n; ++i) {
    ASSERT_TRUE(test::sameValue(out[std::size_t(i)], value[std::size_t(i)])) << arguments[std::size_t(i)];
    if (!std::isfinite(g[0][i]) || std::abs(g[0][i]) > 1e38f) continue;
    ASSERT_FLOAT_EQ(g[1][i], -2 * g[0][i]);  // the order of factors may round
    ASSERT_EQ(g[2][i], 0);
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, UnaryKernel,
    testing::Values(UnaryCase{"negate", Unary::negate}, UnaryCase{"abs", Unary::absolute},
                    UnaryCase{"square", Unary::square}, UnaryCase{"sqrt", Unary::squareRoot},
                    UnaryCase{"exp", Unary::exponential, {}, 2}, UnaryCase{"log", Unary::logarithm, {}, 4},
                    UnaryCase{"sin", Unary::sine, {}, 3, 1e-7}, UnaryCase{"cos", Unary::cosine, {}, 3, 1e-7},
                    UnaryCase{"tan", Unary::tangent}, UnaryCase{"asin", Unary::arcSine},
                    UnaryCase{"acos", Unary::arcCosine}, UnaryCase{"atan", Unary::arcTangent},
                    UnaryCase{"floor", Unary::floor}, UnaryCase{"mask", Unary::mask},
                    UnaryCase{"clamp", Unary::clamp, {-0.5f, 2}},
                    UnaryCase{"smoothstep", Unary::smoothstep, {-1, 3}}),
    [](const auto& test) { return std::string(test.param.name); });

struct BinaryCase {
  const char* name;
  Binary op;
  Parameters p = {};
};

class BinaryKernel : public testing::TestWithParam<BinaryCase> {};
void PrintTo(const BinaryCase& c, std::ostream* out) {
  *out << c.name;
}

TEST_P(BinaryKernel, EqualsTheScalarTruthBitForBit) {
  const BinaryCase& c = GetParam();
  const std::vector<float> all = spicy();
  const std::size_t n = all.size();
  Lane b(all);
  test::forEachTarget([&] {
    for (std::size_t k = 0; k < 60; ++k) {
      Lane a(std::vector<float>(n, all[k])), out(n), out2(n);
      Lane ga[3] = {Lane(n), Lane(n), Lane(n)}, gb[3] = {Lane(n), Lane(n), Lane(n)};
      float* const pa[3] = {ga[0].data(), ga[1].data(), ga[2].data()};
      const float* const pb[3] = {gb[0].data(), gb[1].data(), gb[2].data()};
      detail::apply(c.op, c.p, a.data(), b.data(), out.data(), int(n));
      detail::applyGrad(c.op, c.p, a.data(), b.data(), out2.data(), pa, pb, int(n));
      for (std::size_t i = 0; i < n; ++i) {
        const float truth = detail::scalarValue(c.op, c.p, all[k], all[i]);
        ASSERT_TRUE(test::sameValue(out[i], truth))
            << all[k] << ", " << all[i] << ": " << out[i] << ", not " << truth;
        ASSERT_TRUE(test::sameValue(out2[i], truth)) << all[k] << ", " << all[i];
      }
    }
  });
}

INSTANTIATE_TEST_SUITE_P(
    All, BinaryKernel,
    testing::Values(BinaryCase{"add", Binary::add}, BinaryCase{"subtract", Binary::subtract},
                    BinaryCase{"multiply", Binary::multiply}, BinaryCase{"divide", Binary::divide},
                    BinaryCase{"min", Binary::minimum}, BinaryCase{"max", Binary::maximum},
                    BinaryCase{"pow", Binary::power}, BinaryCase{"atan2", Binary::arcTangent2},
                    BinaryCase{"blend", Binary::blend, {0.5f, 0}}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(Kernels, IgnoreNaNInMinAndMax) {
  EXPECT_EQ(detail::scalarValue(Binary::minimum, {}, kNaN, 1), 1);
  EXPECT_EQ(detail::scalarValue(Binary::minimum, {}, 1, kNaN), 1);
  EXPECT_EQ(detail::scalarValue(Binary::maximum, {}, kNaN, 1), 1);
  EXPECT_EQ(detail::scalarValue(Binary::maximum, {}, 1, kNaN), 1);
  EXPECT_EQ(detail::scalarValue(Unary::clamp, {-1, 1}, kNaN), -1);
  EXPECT_EQ(detail::scalarValue(Unary::mask, {}, kNaN), 0);
}

}  // namespace
}  // namespace nephele

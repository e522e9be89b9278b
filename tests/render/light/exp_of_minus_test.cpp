#include "nephele/render/light/exp_of_minus.h"

#include <gtest/gtest.h>

#include <cmath>

namespace nephele {
namespace {

TEST(ExpOfMinus, IsWithinItsErrorOfTheLibrarys) {
  EXPECT_EQ(detail::expOfMinus(0.0f), 1.0f);
  for (int i = 0; i <= 800000; ++i) {
    const float x = float(i) * 1e-4f;
    const double exact = std::exp(-double(x));
    ASSERT_LE(std::abs(double(detail::expOfMinus(x)) - exact), 1.2e-7 * (1 + double(x)) * exact) << x;
  }
}

}  // namespace
}  // namespace nephele

#include "nephele/render/light/detail/harmonics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "nephele/modeling/base/error.h"

namespace nephele {
namespace {

// The mean of x^a y^b z^c over the sphere: (a - 1)!! (b - 1)!! (c - 1)!! / (a + b + c + 1)!! where all are
// even.
double meanOfMonomial(int a, int b, int c) {
  if (a % 2 || b % 2 || c % 2) return 0;
  const auto odd = [](int n) {
    double product = 1;
    for (; n > 1; n -= 2) product *= n;
    return product;
  };
  return odd(a - 1) * odd(b - 1) * odd(c - 1) / odd(a + b + c + 1);
}

TEST(Harmonics, OrdinatesHaveTheMeansOfPolynomials) {
  // Sums over the directions against the closed form, up to the degree that each set is exact to.
  for (const auto& [order, degree] : {std::pair{4, 5}, {6, 7}, {8, 9}}) {
    const auto ordinates = detail::levelSymmetric(order);
    EXPECT_EQ(int(ordinates.size()), order * (order + 2));
    for (int a = 0; a <= degree; ++a)
      for (int b = 0; a + b <= degree; ++b)
        for (int c = 0; a + b + c <= degree; ++c) {
          double sum = 0;
          for (const auto& [way, weight] : ordinates)
            sum += double(weight) * std::pow(double(way.x), a) * std::pow(double(way.y), b) *
                   std::pow(double(way.z), c);
          EXPECT_NEAR(sum, meanOfMonomial(a, b, c), 2e-6) << order << ": " << a << " " << b << " " << c;
        }
  }
  EXPECT_THROW(detail::levelSymmetric(5), Error);
}

TEST(Harmonics, OrdinatesAreMirroredExactly) {
  for (const int order : {4, 6, 8}) {
    const auto ordinates = detail::levelSymmetric(order);
    for (const auto& ordinate : ordinates)
      for (int axis = 0; axis != 3; ++axis) {
        Vec3f mirrored = ordinate.way;
        mirrored[axis] = -mirrored[axis];
        EXPECT_TRUE(std::any_of(ordinates.begin(), ordinates.end(), [&](const detail::Ordinate& other) {
          return other.way == mirrored && other.weight == ordinate.weight;
        }));
      }
  }
}

TEST(Harmonics, AddUpToLegendresPolynomials) {
  // The addition theorem: the sum over degree l of y(a) y(b) is (2 l + 1) P_l(a . b).
  const Vec3f a = normalize(Vec3f{0.3f, -0.5f, 0.8f}), b = normalize(Vec3f{-0.7f, 0.2f, 0.4f});
  float ya[detail::kMostMoments], yb[detail::kMostMoments];
  detail::harmonics(a, detail::kMostDegree, ya);
  detail::harmonics(b, detail::kMostDegree, yb);
  const double c = double(dot(a, b));
  const double legendre[] = {1,
                             c,
                             (3 * c * c - 1) / 2,
                             (5 * c * c * c - 3 * c) / 2,
                             (35 * std::pow(c, 4) - 30 * c * c + 3) / 8,
                             (63 * std::pow(c, 5) - 70 * c * c * c + 15 * c) / 8};
  for (int l = 0; l <= detail::kMostDegree; ++l) {
    double sum = 0;
    for (int m = l * l; m != detail::momentCount(l); ++m) {
      EXPECT_EQ(detail::degreeOf(m), l);
      sum += double(ya[m]) * double(yb[m]);
    }
    EXPECT_NEAR(sum, (2 * l + 1) * legendre[l], 1e-5) << l;
  }
}

TEST(Harmonics, OfMirroredVectorsDifferInSignsAlone) {
  const Vec3f way = normalize(Vec3f{0.3f, -0.5f, 0.8f});
  float here[detail::kMostMoments], there[detail::kMostMoments];
  detail::harmonics(way, detail::kMostDegree, here);
  for (int axis = 0; axis != 3; ++axis) {
    Vec3f mirrored = way;
    mirrored[axis] = -mirrored[axis];
    detail::harmonics(mirrored, detail::kMostDegree, there);
    for (int m = 0; m != detail::kMostMoments; ++m) EXPECT_EQ(std::fabs(here[m]), std::fabs(there[m]));
  }
}

}  // namespace
}  // namespace nephele

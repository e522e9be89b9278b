#pragma once

#include <vector>

#include "nephele/modeling/base/math.h"

namespace nephele::detail {

/// Real spherical harmonics up to a degree, (degree + 1)^2 of them, whose mean square over the sphere is 1:
/// the first is 1, and the sum over those of degree l of y(a) y(b) is (2 l + 1) P_l(a . b).
inline constexpr int kMostDegree = 5, kMostMoments = (kMostDegree + 1) * (kMostDegree + 1);
constexpr int momentCount(int degree) {
  return (degree + 1) * (degree + 1);
}
/// Degree of a moment.
constexpr int degreeOf(int moment) {
  int degree = 0;
  while (momentCount(degree) <= moment) ++degree;
  return degree;
}
/// At a unit vector. Mirrored vectors have values that differ in their signs alone.
void harmonics(const Vec3f& way, int degree, float* out);

/// What the recurrences of harmonics up to kMostDegree multiply with. Of degree l and order m >= 0, at l l +
/// l + m: P(l + 1) = ofLast z P(l) - ofBefore P(l - 1) for Legendre's functions over sin^m, which begin with
/// `diagonal` of m, and what harmonics have them times.
struct HarmonicFactors {
  float diagonal[kMostDegree + 1];
  float ofLast[kMostMoments], ofBefore[kMostMoments], norm[kMostMoments];
};
const HarmonicFactors& harmonicFactors();

/// Whether value m of `harmonics` changes its sign with that of the vector along an axis.
bool isOdd(int m, int axis);

/// A direction and the share of the sphere that it stands for.
struct Ordinate {
  Vec3f way;
  float weight;
};

/// Carlson and Lathrop's level-symmetric set of an order of 4, 6 or 8: order (order + 2) directions, which
/// mirroring and exchanging axes leave as they are, and with which polynomials of a degree up to 5, 7 and 9
/// have the exact mean.
std::vector<Ordinate> levelSymmetric(int order);

}  // namespace nephele::detail

#pragma once

#include <Eigen/Core>
#include <cmath>

namespace nephele::detail {

/// The energy of a triangle per area, as a function of half = |J|^2 / 2 and d = det J.
struct RelaxationEnergy {
  bool isHarmonic;  ///< `half` alone.
  double epsilon, areaWeight, limit, tearWeight;

  /// chi and its first two derivatives.
  struct Barrier {
    double c, c1, c2;
  };
  Barrier barrier(double d) const {
    const double root = std::sqrt(epsilon * epsilon + d * d);
    // For negative d without cancellation.
    const double c = d >= 0 ? 0.5 * (d + root) : 0.5 * epsilon * epsilon / (root - d);
    return {c, c / root, 0.5 * epsilon * epsilon / (root * root * root)};
  }
  double top(double half, double d) const { return half + 0.5 * areaWeight * (d * d + 1); }
  double value(double half, double d) const {
    return isHarmonic ? half : limit * std::log1p(top(half, d) / barrier(d).c / limit);
  }
  /// Of a side whose square is `s` times that from which it resists.
  double tear(double s) const { return s > 1 ? tearWeight * (s - 1) * (s - 1) : 0.0; }
};

/// Second derivatives of a triangle's energy by the entries of J, by = (j00, j01, j10, j11): with
/// D by = (j11, -j10, -j01, j00) the derivative of det J,
///   identity I + turn D + area (D by) (D by)^T - mixed (by (D by)^T + (D by) by^T).
struct HessianTerms {
  double identity, turn, area, mixed;
};

/// The same without its negative directions, and without the one that the logarithm takes away, at J = `j`.
Eigen::Matrix4d heldHessian(const Eigen::Matrix2d& j, const HessianTerms& terms);

}  // namespace nephele::detail

// The Hessian of a triangle's energy without its negative directions.
//
// D has the eigenvalues 1 (rotations times scales) and -1 (reflections), each in a plane. J's parts in the
// two planes span what the rank-one terms touch: a matrix of 2 x 2. Across them there is an eigenvector in
// each plane.
#include "nephele/levelset/warp/detail/relaxation_energy.h"

#include <algorithm>
#include <array>

namespace nephele::detail {

using Eigen::Matrix2d;
using Matrix4 = Eigen::Matrix4d;
using Vector4 = Eigen::Vector4d;

Matrix4 heldHessian(const Matrix2d& j, const HessianTerms& terms) {
  constexpr double kHalf = 0.70710678118654752440;
  using Eigen::Vector2d;
  const auto unit = [](const Vector2d& v, double size) {
    return size > 0 ? Vector2d(v / size) : Vector2d(1, 0);
  };
  const Vector2d turned = kHalf * Vector2d(j(0, 0) + j(1, 1), j(0, 1) - j(1, 0)),
                 mirrored = kHalf * Vector2d(j(0, 0) - j(1, 1), j(0, 1) + j(1, 0));
  const double p = turned.norm(), m = mirrored.norm();
  const Vector2d up = unit(turned, p), um = unit(mirrored, m);
  const auto inTurns = [](double a, double b) {
    return Vector4(kHalf * a, kHalf * b, -kHalf * b, kHalf * a);
  };
  const auto inMirrors = [](double a, double b) {
    return Vector4(kHalf * a, kHalf * b, kHalf * b, -kHalf * a);
  };
  const Vector4 alongP = inTurns(up[0], up[1]), acrossP = inTurns(-up[1], up[0]),
                alongM = inMirrors(um[0], um[1]), acrossM = inMirrors(-um[1], um[0]);
  const double plus = terms.identity + terms.turn, minus = terms.identity - terms.turn;
  const double a = plus + (terms.area - 2 * terms.mixed) * p * p, b = -terms.area * p * m,
               c = minus + (terms.area + 2 * terms.mixed) * m * m;
  const double angle = 0.5 * std::atan2(2 * b, a - c), cosine = std::cos(angle), sine = std::sin(angle);
  const double middle = 0.5 * (a + c), radius = std::hypot(0.5 * (a - c), b);
  const std::array<double, 4> values{plus, minus, middle + radius, middle - radius};
  const std::array<Vector4, 4> vectors{acrossP, acrossM, cosine * alongP + sine * alongM,
                                       cosine * alongM - sine * alongP};
  constexpr double kLeast = 1e-3;
  const double least = kLeast * std::abs(*std::max_element(values.begin(), values.end()));
  Matrix4 result = Matrix4::Zero();
  for (std::size_t i = 0; i < 4; ++i)
    result += std::max(values[i], least) * vectors[i] * vectors[i].transpose();
  return result;
}

}  // namespace nephele::detail

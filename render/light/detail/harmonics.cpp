// Source: Lathrop and Carlson, "Discrete Ordinates Angular Quadrature of the Neutron Transport Equation"
// (LA-3186, 1965), LQ_n.
#include "nephele/render/light/detail/harmonics.h"

#include <cmath>

#include "nephele/modeling/base/error.h"

namespace nephele::detail {

const HarmonicFactors& harmonicFactors() {
  static const HarmonicFactors all = [] {
    HarmonicFactors factors{};
    float diagonal = 1, factorials = 1;
    for (int m = 0; m <= kMostDegree; ++m) {
      factors.diagonal[m] = diagonal;
      float ratio = factorials;
      for (int l = m; l <= kMostDegree; ++l) {
        const int at = l * l + l + m;
        factors.norm[at] = std::sqrt(float(2 * l + 1) * ratio * (m > 0 ? 2.0f : 1.0f));
        factors.ofLast[at] = float(2 * l + 1) / float(l + 1 - m);
        factors.ofBefore[at] = float(l + m) / float(l + 1 - m);
        ratio *= float(l + 1 - m) / float(l + 1 + m);
      }
      diagonal *= float(2 * m + 1);
      factorials /= float((2 * m + 1) * (2 * m + 2));
    }
    return factors;
  }();
  return all;
}

void harmonics(const Vec3f& way, int degree, float* out) {
  const HarmonicFactors& factors = harmonicFactors();
  // Times sin^m cos(m phi) and sin^m sin(m phi), which are polynomials.
  float cosine = 1, sine = 0;
  for (int m = 0; m <= degree; ++m) {
    float before = 0, value = factors.diagonal[m];
    for (int l = m; l <= degree; ++l) {
      const int at = l * l + l;
      const float norm = factors.norm[at + m] * value;
      out[at + m] = norm * cosine;
      if (m > 0) out[at - m] = norm * sine;
      const float next = factors.ofLast[at + m] * way.z * value - factors.ofBefore[at + m] * before;
      before = value;
      value = next;
    }
    const float turned = cosine * way.x - sine * way.y;
    sine = cosine * way.y + sine * way.x;
    cosine = turned;
  }
}

bool isOdd(int m, int axis) {
  const int degree = degreeOf(m), order = m - degree * degree - degree;
  const bool isSine = order < 0, isOddOrder = order % 2 != 0;
  if (axis == 2) return (degree % 2 != 0) != isOddOrder;
  return axis == 1 ? isSine : isSine != isOddOrder;
}

std::vector<Ordinate> levelSymmetric(int order) {
  struct Point {
    float x, y, z, weight;
  };
  std::vector<Point> points;
  // Of an octant, in cyclic order, which becomes all orders.
  const auto addTurned = [&](float a, float b, float c, float weight) {
    points.push_back({a, b, c, weight});
    points.push_back({c, a, b, weight});
    points.push_back({b, c, a, weight});
  };
  if (order == 4) {
    addTurned(0.3500212f, 0.3500212f, 0.8688903f, 1.0f / 3);
  } else if (order == 6) {
    addTurned(0.2666355f, 0.2666355f, 0.9261808f, 0.1761263f);
    addTurned(0.2666355f, 0.6815076f, 0.6815076f, 0.1572071f);
  } else {
    require(order == 8, "directions: expected an order of 4, 6 or 8");
    addTurned(0.2182179f, 0.2182179f, 0.9511897f, 0.1209877f);
    addTurned(0.2182179f, 0.5773503f, 0.7867958f, 0.0907407f);
    addTurned(0.5773503f, 0.2182179f, 0.7867958f, 0.0907407f);
    points.push_back({0.5773503f, 0.5773503f, 0.5773503f, 0.0925926f});
  }
  double sum = 0;
  for (const Point& p : points) sum += 8 * double(p.weight);
  std::vector<Ordinate> ordinates;
  for (const Point& p : points)
    for (int octant = 0; octant != 8; ++octant)
      ordinates.push_back({{octant & 1 ? -p.x : p.x, octant & 2 ? -p.y : p.y, octant & 4 ? -p.z : p.z},
                           float(double(p.weight) / sum)});
  return ordinates;
}

}  // namespace nephele::detail

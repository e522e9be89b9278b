// Source: W. J. Wiscombe, "The Delta-M Method" (1977). That n-fold scattering has the moments p_l^n is the
// addition theorem; that light which is bent but little goes as far as light which is not, the small-angle
// approximation. As T. Nakajima and M. Tanaka (1988) have it, the smooth rest is left to a solver that keeps
// the low moments.
#include "nephele/render/light/phase_expansion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/math.h"

namespace nephele {

namespace {

// Values of Legendre's polynomials, one after the other.
class Legendre {
 public:
  explicit Legendre(double cosine) : cosine_(cosine) {}
  double next() {
    const double value = value_;
    value_ = (double(2 * degree_ + 1) * cosine_ * value - double(degree_) * before_) / double(degree_ + 1);
    before_ = value;
    ++degree_;
    return value;
  }

 private:
  double cosine_, before_ = 0, value_ = 1;
  int degree_ = 0;
};

// Share of the light that goes straight on: of a phase function that scatters backward hardly any, since no
// moment of what is left may be below -1.
float fAbove(const std::vector<float>& moments, int degree) {
  const std::size_t next = std::size_t(degree) + 1;
  if (next >= moments.size()) return 0.0f;
  float most = 0.999f;
  for (std::size_t l = 1; l < next; ++l) most = std::min(most, (1 + moments[l]) / 2);
  return std::clamp(moments[next], 0.0f, std::max(most, 0.0f));
}

// How far moment l goes on with the beam.
float goesOn(const std::vector<float>& moments, int degree, std::size_t l) {
  const float f = fAbove(moments, degree);
  return int(l) <= degree ? f : std::clamp(moments[l], 0.0f, f);
}

}  // namespace

std::vector<float> legendreMoments(const Phase& phase, int most) {
  // Gauss's rule with 8 points on pieces of the angle.
  constexpr double x[] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363},
                   w[] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};
  std::vector<double> ends{0};
  for (double end = 1e-4; end < 0.03; end *= 1.5) ends.push_back(end);
  while (ends.back() < double(kPi) / 2) ends.push_back(std::min(ends.back() + 0.02, double(kPi) / 2));
  struct Node {
    Legendre polynomials;
    double weight;
  };
  std::vector<Node> nodes;
  for (std::size_t piece = 0; piece + 1 != ends.size(); ++piece)
    for (int i = 0; i != 8; ++i) {
      const double half = 0.5 * (ends[piece + 1] - ends[piece]),
                   angle = ends[piece] + half * (1 + (i % 2 ? x[i / 2] : -x[i / 2]));
      for (const double side : {1.0, -1.0}) {
        const double sine = std::sin(angle / 2), cosine = side * (1 - 2 * sine * sine);
        nodes.push_back({Legendre(cosine),
                         2 * double(kPi) * half * w[i / 2] * std::sin(angle) * double(phase(float(cosine)))});
      }
    }
  std::vector<float> moments;
  double first = 1;
  int small = 0;
  for (int l = 0; l != most && small != 8; ++l) {
    double sum = 0;
    for (Node& node : nodes) sum += node.weight * node.polynomials.next();
    if (l == 0) first = sum;
    moments.push_back(float(sum / first));
    small = sum * sum < 1e-5 ? small + 1 : 0;
  }
  return moments;
}

SmoothScattering::SmoothScattering(const std::vector<float>& phaseMoments, float itsAlbedo, int degree) {
  const float f = fAbove(phaseMoments, degree);
  share = 1 - itsAlbedo * f;
  albedo = itsAlbedo == 1 ? 1 : itsAlbedo * (1 - f) / share;
  moments.assign(std::size_t(degree) + 1, 0.0f);
  for (std::size_t l = 0; l != moments.size() && l != phaseMoments.size(); ++l)
    moments[l] = (phaseMoments[l] - f) / (1 - f);
}

ForwardLight::ForwardLight(const Phase& phase)
    : phase_(phase), attenuations_{1.0f}, table_(std::size_t(kNodes) + 1, 0.0f) {}

ForwardLight::ForwardLight(const Phase& phase, const std::vector<float>& moments, float albedo, int degree,
                           int count)
    : ForwardLight(phase) {
  require(count >= 1 && count <= kMost,
          fmt::format("forward light: expected 1 to {} terms, got {}", kMost, count));
  const double f = double(fAbove(moments, degree));
  if (count == 1 || f < 1e-4) return;
  // Values of q, closer towards the ends.
  std::vector<double> q;
  for (int n = 0; n != count; ++n) q.push_back(0.5 * f * (1 - std::cos(double(kPi) * n / (count - 1))));
  attenuations_.clear();
  for (const double value : q) attenuations_.push_back(float(1 - double(albedo) * value));
  table_.assign(std::size_t(count) * (kNodes + 1), 0.0f);
  const auto lagrange = [&](int n, double at) {
    double product = 1;
    for (int other = 0; other != count; ++other)
      if (other != n) product *= (at - q[std::size_t(other)]) / (q[std::size_t(n)] - q[std::size_t(other)]);
    return product;
  };
  std::vector<double> shares;
  for (int n = 0; n != count; ++n)
    for (std::size_t l = 0; l != moments.size(); ++l)
      shares.push_back(double(2 * l + 1) / (4 * double(kPi)) * double(moments[l]) *
                       (lagrange(n, double(goesOn(moments, degree, l))) - (n == 0)));
  for (int i = 0; i <= kNodes; ++i) {
    const double sine = double(i) / kNodes;
    Legendre polynomials(1 - 2 * sine * sine);
    std::vector<double> sums(std::size_t(count), 0.0);
    for (std::size_t l = 0; l != moments.size(); ++l) {
      const double value = polynomials.next();
      for (std::size_t n = 0; n != sums.size(); ++n) sums[n] += shares[n * moments.size() + l] * value;
    }
    for (std::size_t n = 0; n != sums.size(); ++n) table_[n * (kNodes + 1) + std::size_t(i)] = float(sums[n]);
  }
}

void ForwardLight::weights(float cosine, float* found) const {
  const float place = float(kNodes) * std::sqrt(std::clamp(0.5f * (1 - cosine), 0.0f, 1.0f));
  const int node = std::min(int(place), kNodes - 1);
  const float* at = table_.data() + node;
  for (int n = 0; n != count(); ++n, at += kNodes + 1)
    found[n] = (n == 0 ? phase_(cosine) : 0.0f) + at[0] + (place - float(node)) * (at[1] - at[0]);
}

float ForwardLight::weight(int n, float cosine) const {
  float found[kMost];
  weights(cosine, found);
  return found[n];
}

double ForwardLight::exact(const std::vector<float>& moments, float albedo, int degree, float depth,
                           float cosine) {
  Legendre polynomials{double(cosine)};
  double sum = 0;
  for (std::size_t l = 0; l != moments.size(); ++l)
    sum += double(2 * l + 1) / (4 * double(kPi)) * double(moments[l]) * polynomials.next() *
           std::exp(-double(depth) * (1 - double(albedo) * double(goesOn(moments, degree, l))));
  return sum;
}

}  // namespace nephele

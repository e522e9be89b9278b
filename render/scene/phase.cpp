// Phase functions as one or two lobes, each normalised in closed form.
//
// With t = sqrt(1 + g^2 - 2 g c) the cumulative distribution of a Draine lobe is rational in t, and with w =
// 1 / t its slope is 1 + alpha c^2, which varies mildly: Newton's method from the Henyey-Greenstein solution,
// kept within a bracket, inverts it in a few steps to the last digit. The form divides by g^2; below |g| =
// 0.001 the polynomial of the first order in g takes its place, right to 1e-5 of the density.
//
// Mie: the four ranges of the fit of Jendersie and d'Eon (2023), (7) to (10) of the talk and (11) to (22) of
// its supplement. It knows one diameter and light in the middle of the visible, so no fogbow, glory or
// colours.
#include "nephele/render/scene/phase.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <vector>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/math.h"
#include "nephele/modeling/base/printable.h"

namespace nephele {

namespace {

constexpr float kMost = 0.99f;
constexpr double kLeastG = 1e-3;

void requireEccentricity(const char* name, float value) {
  require(value >= -kMost && value <= kMost,
          fmt::format("phase: {} must be within [-0.99, 0.99], got {}", name, value));
}

// The root of a rising function within [low, high]; `at` returns its value and slope.
template <class Function>
double rootOf(double low, double high, double start, Function&& at) {
  double x = start;
  for (int i = 0; i != 60; ++i) {
    const auto [value, slope] = at(x);
    (value > 0 ? high : low) = x;
    double next = x - value / slope;
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (std::fabs(next - x) <= 1e-12 * std::fabs(x)) return next;
    x = next;
  }
  return x;
}

struct ValueAndSlope {
  double value, slope;
};

double sampleHenyeyGreenstein(double g, double u) {
  if (std::fabs(g) < 1e-6) return 2 * u - 1;
  const double t = (1 - g * g) / (1 - g + 2 * g * u);
  return (1 + g * g - t * t) / (2 * g);
}

// For small g, from the first order in g.
double sampleNearlyEven(double g, double alpha, double u) {
  const auto cumulative = [&](double c) {
    return c * (1 + c * (1.5 * g + c * (alpha / 3 + c * 0.75 * g * alpha)));
  };
  const double low = cumulative(-1), wanted = low + u * (cumulative(1) - low);
  return rootOf(-1, 1, 2 * u - 1, [&](double c) {
    return ValueAndSlope{cumulative(c) - wanted, (1 + alpha * c * c) * (1 + 3 * g * c)};
  });
}

double sampleDraine(double g, double alpha, double u) {
  const double square = 1 + g * g, part = alpha / (4 * g * g);
  const double a = 1 + part * square * square, b = 2 * part * square, c = part / 3;
  const auto cumulative = [&](double w) { return a * w + b / w - c / (w * w * w); };
  const double low = 1 / (1 + g), high = 1 / (1 - g), first = cumulative(low);
  const double wanted = first + u * (cumulative(high) - first);
  const auto cosine = [&](double w) { return (square - 1 / (w * w)) / (2 * g); };
  const double w = rootOf(low, high, low + u * (high - low), [&](double x) {
    const double mu = cosine(x);
    return ValueAndSlope{cumulative(x) - wanted, 1 + alpha * mu * mu};
  });
  return cosine(w);
}

std::optional<std::vector<float>> numbersAfter(const std::string& text, const std::string& name,
                                               std::size_t count) {
  if (!text.starts_with(name + ":")) return {};
  std::vector<float> numbers;
  const char *at = text.data() + name.size() + 1, *end = text.data() + text.size();
  while (numbers.size() != count) {
    float number = 0;
    const auto [stop, error] = std::from_chars(at, end, number);
    if (error != std::errc() || !std::isfinite(number)) return {};
    numbers.push_back(number);
    const bool last = numbers.size() == count;
    if (last ? stop != end : stop == end || *stop != ',') return {};
    at = stop + 1;
  }
  return numbers;
}

}  // namespace

Phase::Lobe Phase::Lobe::draine(float g, float alpha) {
  return {g, alpha, false, (1 - g * g) / (4 * kPi * (1 + alpha * (1 + 2 * g * g) / 3))};
}

Phase::Lobe Phase::Lobe::rational(float k) {
  return {k, 0, true, (1 - k * k) / (4 * kPi)};
}

float Phase::Lobe::value(float c) const {
  if (schlick) {
    const float s = 1 - g * c;
    return norm / (s * s);
  }
  // 1 + g^2 - 2 g c without its cancellation in the peak.
  const float side = 1 - std::fabs(g);
  const float s = side * side + 2 * std::fabs(g) * (g < 0 ? 1 + c : 1 - c);
  return norm * (1 + alpha * c * c) / (s * std::sqrt(s));
}

float Phase::Lobe::meanCosine() const {
  if (schlick) {
    const double k = g;
    if (std::fabs(k) < 0.01) return float(k * (2.0 / 3 + k * k * (2.0 / 15)));
    return float((k - (1 - k * k) * std::atanh(k)) / (k * k));
  }
  return g * (1 + alpha * (3 + 2 * g * g) / 5) / (1 + alpha * (1 + 2 * g * g) / 3);
}

Phase::Lobe Phase::Lobe::flattened(float factor) const {
  return schlick ? rational(g * factor) : draine(g * factor, alpha * factor * factor);
}

float Phase::Lobe::sampleCosine(float u) const {
  double c = 0;
  if (schlick)
    c = (2.0 * u + g - 1) / (2.0 * g * u - g + 1);
  else if (alpha == 0)
    c = sampleHenyeyGreenstein(g, u);
  else if (std::fabs(g) < kLeastG)
    c = sampleNearlyEven(g, alpha, u);
  else
    c = g > 0 ? sampleDraine(g, alpha, u) : -sampleDraine(-g, alpha, 1.0 - u);
  return float(std::clamp(c, -1.0, 1.0));
}

Phase Phase::henyeyGreenstein(float g) {
  requireEccentricity("g", g);
  Phase phase;
  phase.first_ = Lobe::draine(g, 0);
  return phase;
}

Phase Phase::schlick(float k) {
  requireEccentricity("k", k);
  Phase phase;
  phase.first_ = Lobe::rational(k);
  return phase;
}

Phase Phase::rayleigh() {
  return draine(0, 1);
}

Phase Phase::twoLobe(float g1, float g2, float mix) {
  requireEccentricity("g1", g1);
  requireEccentricity("g2", g2);
  require(mix >= 0 && mix <= 1, fmt::format("phase: mix must be within [0, 1], got {}", mix));
  Phase phase;
  phase.first_ = Lobe::draine(g1, 0);
  phase.second_ = Lobe::draine(g2, 0);
  phase.mix_ = mix;
  return phase;
}

Phase Phase::draine(float g, float alpha) {
  requireEccentricity("g", g);
  require(alpha >= 0 && alpha <= 1000, fmt::format("phase: alpha must be within [0, 1000], got {}", alpha));
  Phase phase;
  phase.first_ = Lobe::draine(g, alpha);
  return phase;
}

Phase Phase::mie(float diameterMicrometres) {
  const double d = double(diameterMicrometres);
  require(d > 0 && d <= 50,
          fmt::format("phase: the diameter of droplets must be above 0 and at most 50 micrometres, got {}",
                      diameterMicrometres));
  const double l = std::log(d);
  double peak = 0, lobe = 0, alpha = 250, share = 0;
  if (d >= 5) {
    peak = std::exp(-0.0990567 / (d - 1.67154));
    lobe = std::exp(-2.20679 / (d + 3.91029) - 0.428934);
    alpha = std::exp(3.62489 - 8.29288 / (d + 5.52825));
    share = std::exp(-0.599085 / (d - 0.641583) - 0.665888);
  } else if (d >= 1.5) {
    const double ll = std::log(l);
    peak = 0.0604931 * ll + 0.940256;
    lobe = 0.500411 - 0.081287 / (std::tan(l) - 2 * l + 1.27551);
    alpha = 7.30354 * l + 6.31675;
    share = 0.026914 * (l - std::cos(5.68947 * (ll - 0.0292149))) + 0.376475;
  } else if (d > 0.1) {
    const double bend = (l - 0.238604) * (l + 1.00667) / (0.507522 - 0.15677 * l);
    peak = 0.862 - 0.143 * l * l;
    lobe = 0.379685 * std::cos(1.19692 * std::cos(bend) + 1.37932 * l + 0.0625835) + 0.344213;
    share = 0.146209 * std::cos(3.38707 * l + 2.11193) + 0.316072 + 0.0778917 * l;
  } else {
    peak = 13.8 * d * d;
    lobe = 1.1456 * d * std::sin(9.29044 * d);
    share = 0.252977 - 312.983 * std::pow(d, 4.3);
  }
  Phase phase;
  phase.first_ = Lobe::draine(float(peak), 0);
  phase.second_ = Lobe::draine(float(lobe), float(alpha));
  phase.mix_ = float(share);
  return phase;
}

const char* Phase::forms() {
  return "isotropic, rayleigh, hg:G, schlick:K, two-lobe:G1,G2,MIX or mie:MICROMETRES, with G and K from "
         "-0.99 "
         "to 0.99, MIX from 0 to 1, MICROMETRES above 0 and at most 50";
}

Phase Phase::parse(const std::string& text) {
  try {
    if (text == "isotropic") return {};
    if (text == "rayleigh") return rayleigh();
    if (const auto n = numbersAfter(text, "hg", 1)) return henyeyGreenstein((*n)[0]);
    if (const auto n = numbersAfter(text, "schlick", 1)) return schlick((*n)[0]);
    if (const auto n = numbersAfter(text, "two-lobe", 3)) return twoLobe((*n)[0], (*n)[1], (*n)[2]);
    if (const auto n = numbersAfter(text, "mie", 1)) return mie((*n)[0]);
  } catch (const Error&) {
    // The list of forms below says more.
  }
  throw Error(fmt::format("phase: expected {}; got '{}'", forms(), printable(text, 60)));
}

float Phase::operator()(float c) const {
  const float value = first_.value(c);
  return mix_ == 0 ? value : value + mix_ * (second_.value(c) - value);
}

float Phase::meanCosine() const {
  return (1 - mix_) * first_.meanCosine() + mix_ * second_.meanCosine();
}

Phase Phase::flattened(float factor) const {
  Phase phase;
  phase.first_ = first_.flattened(factor);
  phase.second_ = second_.flattened(factor);
  phase.mix_ = mix_;
  return phase;
}

float Phase::sampleCosine(float u1, float u2) const {
  return u1 < mix_ ? second_.sampleCosine(u2) : first_.sampleCosine(u2);
}

}  // namespace nephele

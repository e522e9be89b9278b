// What glows by its heat: Planck's law, weighed by the colour matching functions of the CIE 1931 standard
// observer and brought to the primaries of Rec.709.
//
// The matching functions are the sums of Gaussians of Wyman, Sloan and Shirley ("Simple Analytic
// Approximations to the CIE XYZ Color Matching Functions", JCGT 2013), within 1 % or so of the tables; they
// are the same numbers everywhere and need no data. Planck's law is integrated by the midpoint rule, 5 nm
// wide, as smooth functions that vanish at both ends allow.
//
// Limits: chromaticities are off by up to 0.003 in x and y.
#include "nephele/render/scene/black_body.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include "nephele/modeling/base/error.h"

namespace nephele {

namespace {

constexpr double kShortest = 360, kWidth = 5;
constexpr int kCount = 94;

double lobe(double x, double centre, double below, double above) {
  const double t = (x - centre) / (x < centre ? below : above);
  return std::exp(-0.5 * t * t);
}

Vec3d matching(double nanometres) {
  const double l = nanometres;
  return {1.056 * lobe(l, 599.8, 37.9, 31.0) + 0.362 * lobe(l, 442.0, 16.0, 26.7) -
              0.065 * lobe(l, 501.1, 20.4, 26.2),
          0.821 * lobe(l, 568.8, 46.9, 40.5) + 0.286 * lobe(l, 530.9, 16.3, 31.1),
          1.217 * lobe(l, 437.0, 11.8, 36.0) + 0.681 * lobe(l, 459.0, 26.0, 13.8)};
}

// Per unit of solid angle and wavelength, up to a factor.
double planck(double nanometres, double kelvin) {
  // Second radiation constant h c / k, in nm K.
  constexpr double c2 = 1.438776877e7;
  const double relative = 560.0 / nanometres;
  return std::pow(relative, 5) / std::expm1(c2 / (nanometres * kelvin));
}

Vec3d integral(double kelvin) {
  Vec3d sum{};
  if (!(kelvin > 0)) return sum;
  static const auto table = [] {
    std::array<Vec3d, kCount> values;
    for (int i = 0; i != kCount; ++i) values[std::size_t(i)] = matching(kShortest + (i + 0.5) * kWidth);
    return values;
  }();
  for (int i = 0; i != kCount; ++i)
    sum += table[std::size_t(i)] * planck(kShortest + (i + 0.5) * kWidth, kelvin);
  return sum;
}

}  // namespace

Vec3d blackBodyXyz(double kelvin) {
  static const double unit = 1 / integral(2000).y;
  return integral(kelvin) * unit;
}

Vec3f blackBody(double kelvin) {
  const Vec3d c = blackBodyXyz(kelvin);
  // IEC 61966-2-1.
  return {float(std::max(0.0, 3.2406 * c.x - 1.5372 * c.y - 0.4986 * c.z)),
          float(std::max(0.0, -0.9689 * c.x + 1.8758 * c.y + 0.0415 * c.z)),
          float(std::max(0.0, 0.0557 * c.x - 0.2040 * c.y + 1.0570 * c.z))};
}

BlackBodyColours::BlackBodyColours(float hottest) : perKelvin_(float(kSteps) / std::max(hottest, 1.0f)) {
  require(std::isfinite(hottest), fmt::format("black body: expected a finite temperature, got {}", hottest));
  if (hottest <= 0) {
    table_.resize(kSteps + 2);
    return;
  }
  for (int i = 0; i <= kSteps + 1; ++i) table_.push_back(blackBody(double(i) / double(perKelvin_)));
}

namespace {

class BlackBodyNode final : public FieldNode<Vec3f> {
 public:
  BlackBodyNode(NodePtr<float> kelvin, std::shared_ptr<const BlackBodyColours> colours)
      : kelvin_(std::move(kelvin)), colours_(std::move(colours)) {}

  void eval(const PointBlock& points, const BlockLanes<3>& values, Scratch& scratch) const override {
    Scratch::Frame frame(scratch);
    float* const kelvin = frame.lane();
    kelvin_->eval(points, {kelvin}, scratch);
    for (int i = 0; i != points.count; ++i) {
      const Vec3f colour = (*colours_)(kelvin[i]);
      for (int c = 0; c != 3; ++c) values[std::size_t(c)][i] = colour[c];
    }
  }
  // From 500 K on every colour grows with the heat; below there is next to none of it.
  RangeOf<Vec3f> range(const Box& box, RangeMemo& memo) const override {
    const float hottest = memo.of(kelvin_, box).max;
    const Vec3f most = hottest > 0 ? (*colours_)(std::max(hottest, 500.0f)) : Vec3f{};
    return {Interval{0.0f, most.x}, Interval{0.0f, most.y}, Interval{0.0f, most.z}};
  }
  NodePtr<Vec3f> restricted(Restriction& restriction) const override {
    const NodePtr<float> kelvin = restrictNode(kelvin_, restriction);
    return kelvin == kelvin_ ? nullptr : std::make_shared<BlackBodyNode>(kelvin, colours_);
  }
  float differenceStep() const override { return kelvin_->differenceStep(); }

 private:
  NodePtr<float> kelvin_;
  std::shared_ptr<const BlackBodyColours> colours_;
};

}  // namespace

VectorField blackBody(const ScalarField& kelvin, float hottest) {
  return VectorField(
      std::make_shared<BlackBodyNode>(kelvin.node(), std::make_shared<const BlackBodyColours>(hottest)));
}

}  // namespace nephele

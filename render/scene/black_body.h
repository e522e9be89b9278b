#pragma once

#include <algorithm>
#include <vector>

#include "nephele/modeling/base/math.h"
#include "nephele/modeling/field/field.h"

namespace nephele {

/// CIE 1931 tristimulus values of a black body, from Planck's law; Y is 1 at 2000 K.
/// 0 at 0 K and below.
Vec3d blackBodyXyz(double kelvin);

/// Colour of a black body in linear Rec.709, luminance 1 at 2000 K, a bright fire: a candle (1850 K) has a
/// third of it, 1000 K six millionths, 3000 K 65 times as much. Colours outside of Rec.709 (below 1900 K,
/// where blue is negative) have those channels at 0. 0 at 0 K and below. Cost: some 80 exponentials.
Vec3f blackBody(double kelvin);

/// Colours of all black bodies between 0 K and `hottest`, from a table; those beyond count as the nearest,
/// NaN as 0 K. @throws Error unless `hottest` is finite.
class BlackBodyColours {
 public:
  explicit BlackBodyColours(float hottest);
  Vec3f operator()(float kelvin) const {
    const float x = kelvin > 0 ? std::min(kelvin * perKelvin_, float(kSteps)) : 0.0f;
    const int i = int(x);
    return table_[std::size_t(i)] + (table_[std::size_t(i + 1)] - table_[std::size_t(i)]) * (x - float(i));
  }

 private:
  static constexpr int kSteps = 4096;
  float perKelvin_;
  std::vector<Vec3f> table_;
};

/// Colours of what is as hot as `kelvin` says, from the same table: what is hotter than `hottest` counts as
/// that, and NaN as 0 K.
VectorField blackBody(const ScalarField& kelvin, float hottest);

}  // namespace nephele

#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "modeling/math.h"

namespace nephele {

/// Unit vector towards `azimuthDegrees` about y from +z towards +x, raised by `elevationDegrees` from the
/// horizon. Where a camera stands, or where light comes from.
inline Vec3f directionTowards(float azimuthDegrees, float elevationDegrees) {
  const float a = radians(azimuthDegrees), e = radians(elevationDegrees);
  return {std::sin(a) * std::cos(e), std::sin(e), std::cos(a) * std::cos(e)};
}

/// A light so far away that its rays are parallel: the sun.
struct DistantLight {
  /// Names the image layer `light_<name>`.
  std::string name = "sun";
  /// Towards the light; any length but zero.
  Vec3f direction{0, 1, 0};
  /// Irradiance of a surface that faces the light: a white diffuse one then has the radiance irradiance / pi.
  Vec3f irradiance{1, 1, 1};
};

/// The lights of a picture.
struct Lights {
  std::vector<DistantLight> suns;
  /// Radiance of a sky that is equally bright in all directions, below the horizon too.
  Vec3f sky{};
};

}  // namespace nephele

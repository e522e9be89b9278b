#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nephele/modeling/base/math.h"

namespace nephele {

class ClearSky;
class Environment;
class DeepShadowMap;

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
  /// Multiplies the extinction on the way from the light, per colour: where green and blue are less than 1
  /// they reach deeper than red. What has been scattered sees the extinction itself.
  /// Source: notes, production sessions, the orange multiplier.
  Vec3f shadow{1, 1, 1};
  /// Taken for its shadow where given, in place of a sweep through the volume. The map's own extinction
  /// counts.
  std::shared_ptr<const DeepShadowMap> deepShadow{};
};

/// How light gets weaker with the distance r from a light.
enum class Decay { quadratic, linear, none };

/// A light at a place, in all directions or in a cone.
///
/// Irradiance where it faces the light:  intensity * cone / max(r, decayStart)^p,  p = 2, 1 or 0 for the
/// three kinds of decay; r in world units. Only quadratic decay with a start of 0 is that of real light.
struct LocalLight {
  /// The light of a spot: full within `angleDegrees` - `penumbraDegrees` of its axis, none beyond
  /// `angleDegrees`, between them 3 t^2 - 2 t^3 of the cosine's place t.
  struct Cone {
    /// The way of the light; any length but zero.
    Vec3f direction{0, -1, 0};
    /// Half the opening, in (0, 90].
    float angleDegrees = 25;
    /// Within [0, angleDegrees].
    float penumbraDegrees = 5;
  };

  std::string name = "point";
  Vec3f position{};
  /// Irradiance at distance 1, times the unit of length squared: radiant intensity.
  Vec3f intensity{1, 1, 1};
  Decay decay = Decay::quadratic;
  /// Up to this distance the light does not get weaker.
  float decayStart = 0;
  std::optional<Cone> cone{};
  /// As DistantLight::shadow and deepShadow.
  Vec3f shadow{1, 1, 1};
  std::shared_ptr<const DeepShadowMap> deepShadow{};

  /// Irradiance per intensity at distance `r`, without the cone.
  float decayAt(float r) const {
    const float d = std::max(r, decayStart);
    return decay == Decay::quadratic ? 1 / (d * d) : decay == Decay::linear ? 1 / d : 1;
  }
  /// The cone's share of the light that leaves in the unit direction `way`.
  float coneAt(const Vec3f& way) const {
    if (!cone) return 1;
    const float c = dot(normalize(cone->direction), way), outer = outerCosine();
    const float t = std::clamp((c - outer) / std::max(innerCosine() - outer, 1e-6f), 0.0f, 1.0f);
    return t * t * (3 - 2 * t);
  }
  float outerCosine() const { return std::cos(radians(cone->angleDegrees)); }
  float innerCosine() const { return std::cos(radians(cone->angleDegrees - cone->penumbraDegrees)); }
};

/// The lights of a picture.
struct Lights {
  std::vector<DistantLight> suns;
  /// Radiance of a sky that is equally bright in all directions, below the horizon too.
  Vec3f sky{};
  /// Points and spots.
  std::vector<LocalLight> locals{};
  /// Where given, the sky in place of `sky`.
  std::shared_ptr<const Environment> map{};
  /// Of what `map` is a map, where it is a clear sky's; pictures may show its air, see addAir.
  std::shared_ptr<const ClearSky> clear{};

  /// Shadows come from deep shadow maps, whose transmittance may be off by this, in place of sweeps. Only for
  /// the marcher, as DistantLight::deepShadow.
  std::optional<float> deepTolerance{};
  /// Nodes per voxel, along each axis, of the lattices that shadows of suns, points and spots are kept on: 1,
  /// 2 or 4. Where a voxel is opaque, a shadow changes within it. Time and memory of them grow with the cube.
  int shadowDetail = 1;

  /// Most suns, and most points and spots.
  static constexpr std::size_t kMost = 8;
  /// Bytes of a name: channels of a picture, of up to 255, have it with a layer's name before and after.
  static constexpr std::size_t kLongestName = 200;
  bool hasSky() const { return map || sky != Vec3f{}; }
  /// Of every layer light_<name>: suns, points and spots, the sky.
  std::vector<std::string> names() const;
  /// @throws Error naming the light and its value if a number is not finite or outside its range, two lights
  /// have the same name, or there are too many.
  void check() const;
};

}  // namespace nephele

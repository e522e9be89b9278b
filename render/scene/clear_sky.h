#pragma once

#include <memory>

#include "nephele/modeling/base/math.h"
#include "nephele/render/scene/environment.h"

namespace nephele {

/// The light of a sky without clouds and of the sun in it, for an observer at the height of clouds, by
/// scattering in the atmosphere: air, haze and ozone about a round earth, any number of scatterings.
///
/// Source: S. Hillaire, "A Scalable and Production Ready Sky and Atmosphere Rendering Technique" (2020), for
/// what is scattered more than once; E. Bruneton and F. Neyret, "Precomputed Atmospheric Scattering" (2008),
/// for the air's numbers at 680, 550 and 440 nanometres, which stand for red, green and blue.
class ClearSky {
 public:
  struct Options {
    /// Towards the sun; any length but zero. Below the horizon there is dusk, then night.
    Vec3f sun{0, 1, 0};
    /// What air and haze take of a beam over what air alone does, at 550 nanometres: 1 is air without haze, 2
    /// to 3 a clear day, 6 and more hazy. 1 to 10.
    float turbidity = 2.0f;
    /// Of the ground, which lights clouds from below. 0 to 1.
    Vec3f groundAlbedo{0.2f, 0.2f, 0.2f};
    /// Of the observer above the ground, metres, 0 to 20 000.
    float height = 1000.0f;
  };

  /// Cost: some ten milliseconds. @throws Error if an option is outside of its range.
  explicit ClearSky(const Options& options);
  ClearSky() : ClearSky(Options{}) {}

  /// Irradiance of a surface that faces the sun, 0 once that has set. Its luminance is 3.6 for the default
  /// turbidity and a sun at 38 degrees.
  Vec3f sunlight() const;
  /// Radiance from a direction, of any length but zero: of the sky, or the ground behind its air.
  Vec3f radiance(const Vec3f& towards) const;
  /// What the air before a place does to light that comes from there: so much of it is left, and light is
  /// added.
  struct Air {
    Vec3f left{1, 1, 1}, light{};
  };
  /// Of a place in a direction, of any length but zero, and at a distance in metres; no farther than
  /// where the atmosphere ends, and as if there were no ground.
  Air airBefore(const Vec3f& towards, float metres) const;
  /// Turned by `degrees` about y, azimuths growing.
  ClearSky turned(double degrees) const;
  /// The sky as a map of so many rows, even and at most 4096, its radiance times `intensity`. Uses all cores.
  Environment map(int rows = 96, float intensity = 1) const;

 private:
  struct Data;
  std::shared_ptr<const Data> data_;
};

}  // namespace nephele

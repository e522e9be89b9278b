#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "nephele/modeling/field/field.h"

/// What the density inside a cloud is multiplied by: fields of position, 1 where nothing is changed.
namespace nephele {

/// A point of a ramp: at this place, this value.
struct RampStop {
  float at = 0.0f;
  float value = 0.0f;
};

/// `f` through the polyline of `stops`: between two stops linear, before the first and after the last their
/// values. Places must rise; where two are equal the ramp jumps, from the value of the first to that of the
/// second above it. NaN gives the first value.
/// @throws Error if there is no stop, a number is not finite or the places fall.
ScalarField ramp(const ScalarField& f, std::vector<RampStop> stops);

/// y, as a share of the way from `low` (0) to `high` (1). @throws Error unless low < high, both finite.
ScalarField heightBetween(float low, float high);

struct DensityProfile {
  /// y of the lowest and the highest point of the shape, world units: heights 0 and 1. Used by
  /// `heightProfile` and `thinOut`.
  float low = 0.0f, high = 1.0f;

  /// Rms of the variation inside, >= 0; 0 is even density.
  float interiorNoise = 0.0f;
  /// Of the largest clumps, cycles per world unit, > 0.
  float interiorFrequency = 8.0f;
  std::uint32_t seed = 0;

  /// Cuts the underside: density is 0 below `height` and whole above `height + softness`, smooth between.
  struct FlatBase {
    float height = 0.0f;    ///< y, world units.
    float softness = 0.0f;  ///< World units, > 0.
  };
  std::optional<FlatBase> flatBase{};

  /// Factors (>= 0) at heights between 0 and 1. Empty: 1 everywhere.
  std::vector<RampStop> heightProfile{};

  /// Share of the density that is gone at the top, 0 to 1, and the height above which it starts to go.
  float thinOut = 0.0f;
  float thinOutFrom = 0.5f;
};

/// The product of
///
///     noise:   max(0, 1 + interiorNoise N(x)), N a sum of four Perlin noises of unit rms, so that the mean
///              stays 1 and the rms is as stated as long as interiorNoise is below about 0.5;
///     base:    smoothstep(height, height + softness, y);
///     profile: the ramp of heightProfile at h = (y - low) / (high - low);
///     top:     1 - thinOut smoothstep(thinOutFrom, 1, h).
///
/// Never negative. The constant 1 where nothing is asked for. Ranges are conservative; ranges of a noise that
/// varies are only as tight as those of `perlin`. Cost: four noises where there is interior noise, else a few
/// operations. @throws Error for numbers outside their range.
ScalarField densityFactor(const DensityProfile& profile);

}  // namespace nephele

#pragma once

#include "apps/options/field_value.h"

namespace nephele::apps {

/// What the parameters of layers are, on the command line and in recipes.
inline constexpr Quantity kAmplitude{.unit = Quantity::Unit::length};
inline constexpr Quantity kFrequency{.unit = Quantity::Unit::frequency, .lowIsAllowed = false};
inline constexpr Quantity kLacunarity{.low = 0.1, .high = 100};
inline constexpr Quantity kRoughness{.low = 0, .high = 10};
inline constexpr Quantity kBillow{.low = 0, .high = 100};
inline constexpr Quantity kBillowScale{.low = 0.01, .high = 100};

/// And those of the density.
inline constexpr Quantity kEdgeThickness{.unit = Quantity::Unit::length, .lowIsAllowed = false};
inline constexpr Quantity kDensity{.low = 0, .high = 1000};

}  // namespace nephele::apps

#pragma once

#include <optional>

#include "apps/options/options.h"

namespace nephele::apps {

/// How large what is seen is in the world, and the air that hangs before it.
struct ScaleOptions {
  /// Metres that the longest side of the volume stands for.
  std::optional<double> longestSide;
  bool aerialPerspective = false;

  /// How many metres a world unit is, if the longest side has so many: one, unless that was given.
  float metresPerUnit(double worldUnits) const;
};

/// Extinction per metre, diameter of droplets in micrometres and albedo of a real cumulus, for volumes whose
/// scale is given: 0.4 g of water in a cubic metre, in droplets of 16 micrometres, have
/// 1.5 * 0.4e-6 / 8e-6 = 0.075 per metre, and water takes less than a millionth of visible light.
/// Source: the extinction of drops much larger than waves, 3 w / (2 rho r) (Rogers and Yau, "A Short Course
/// in Cloud Physics", 1989, whose measured cumuli have such drops and water).
struct RealCloud {
  static constexpr float kExtinction = 0.075f, kDiameter = 16.0f, kAlbedo = 1.0f;
};

/// Declares the options on `app`.
void addScaleOptions(CLI::App& app, ScaleOptions& options);

}  // namespace nephele::apps

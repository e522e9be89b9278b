#pragma once

#include <optional>
#include <string>

#include "apps/options/cloud_quantities.h"
#include "apps/options/field_sources.h"
#include "nephele/modeling/cloud/density_profile.h"

namespace nephele::apps {

/// How the density of a cloud rises and varies, as typed.
struct DensityArguments {
  FieldValue density = parseFieldValue("--density", "1", kDensity);
  /// Of the rise over the edge; empty: smooth.
  std::optional<float> edgeExponent;
  double interiorNoise = 0;
  Frequency interiorFrequency{8, true};
  enum class Base { standard, off, given };
  /// Standard: a flat base for generated shapes, none for others.
  Base base = Base::standard;
  /// y of the plane: in world units, or above the lowest point in percent of the longest side.
  Length flatBase{1, true}, flatBaseSoftness{4, true};
  std::vector<RampStop> heightProfile;
  double thinOut = 0, thinOutFrom = 0.5;

  /// What the density of a cloud on the shape of `sources` is multiplied by.
  ScalarField factor(FieldSources& sources, bool generated, std::uint32_t seed) const;
};

/// Declares the options on `app`.
void addDensityOptions(CLI::App& app, DensityArguments& arguments);

}  // namespace nephele::apps

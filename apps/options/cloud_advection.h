#pragma once

#include <optional>

#include "apps/app.h"
#include "apps/options/cloud_quantities.h"
#include "apps/options/field_sources.h"
#include "nephele/levelset/io/vdb_io.h"

namespace nephele::apps {

/// Wind that draws streaks out of a cloud to its lee.
struct Wind {
  /// Level, the way that it goes.
  Vec3f direction{0, 0, 1};
  /// Of what it carries farthest, at the top of the shape.
  Length way{};
  /// How much less that is at the bottom: 0, as far; 1, not at all.
  float shear = 1;
};

/// The one-line form of advection that the verb cloud has: noise frays the finished cloud, and wind carries
/// what it has loosened.
struct CloudAdvectionArguments {
  /// Rms way along each axis; 0: none.
  FieldValue strength = parseFieldValue("--advect", "0", kAmplitude);
  Frequency frequency{10, true};
  int steps = 4;
  std::optional<Wind> wind{};

  /// Whether anything is carried along.
  bool isAny(FieldSources& sources) const;
  /// `density` carried along, or itself. Several octaves of noise, drawn from `seed`.
  VdbGrid carried(const VdbGrid& density, FieldSources& sources, int seed, Run& run) const;

 private:
  float farthest(FieldSources& sources, const ScalarField& way) const;
  VectorField windOver(const FieldSources& sources, int seed) const;
};

/// Declares the options on `app`.
void addCloudAdvectionOptions(CLI::App& app, CloudAdvectionArguments& arguments);

}  // namespace nephele::apps

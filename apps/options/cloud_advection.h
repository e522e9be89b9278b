#pragma once

#include "apps/app.h"
#include "apps/options/cloud_quantities.h"
#include "apps/options/field_sources.h"
#include "nephele/levelset/io/vdb_io.h"

namespace nephele::apps {

/// The one-line form of advection that the verb cloud has: noise frays the finished cloud.
struct CloudAdvectionArguments {
  /// Rms way along each axis; 0: none.
  FieldValue strength = parseFieldValue("--advect", "0", kAmplitude);
  Frequency frequency{10, true};
  int steps = 4;

  /// `density` carried along, or itself. Several octaves of noise, drawn from `seed`.
  VdbGrid carried(const VdbGrid& density, FieldSources& sources, int seed, Run& run) const;
};

/// Declares the options on `app`.
void addCloudAdvectionOptions(CLI::App& app, CloudAdvectionArguments& arguments);

}  // namespace nephele::apps

#pragma once

#include <string>
#include <vector>

#include "apps/app.h"
#include "apps/options/velocity_options.h"
#include "nephele/levelset/flow/advection.h"

namespace nephele::apps {

/// The options of the verb advect as typed.
struct AdvectArguments {
  std::string input, output, map, continueFrom;
  VelocityArguments velocity;
  int steps = 1, mapCoarseness = 1;
  double dt = 1, rebake = 5;
  /// Options that say nothing to other methods.
  const CLI::Option* ofGrid = nullptr;
  std::vector<const CLI::Option*> ofMap;
  /// What needs no conversion; the rest is filled in by `resolved`.
  AdvectionOptions advection;

  /// The library's options, without the map to go on from. @throws CLI::ValidationError where options
  /// exclude each other.
  AdvectionOptions resolved() const;
};

/// Declares the options on `app`.
void addAdvectOptions(CLI::App& app, AdvectArguments& arguments);

}  // namespace nephele::apps

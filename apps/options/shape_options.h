#pragma once

#include <optional>
#include <string>

#include "apps/app.h"
#include "nephele/levelset/cloud/cloud.h"

namespace nephele::apps {

/// What a cloud grows on, as typed: a file, or a shape from a seed.
struct ShapeArguments {
  std::string input, meshOutput;
  std::optional<CloudSpecies> species;
  int seed = 0;
  double size = 1;
  MeshRepairOptions repair;
  int subdivide = 0;

  bool isGenerated() const { return species.has_value(); }

  /// The shape; where asked for, its mesh is written, too. @throws CLI::ValidationError where neither a file
  /// nor a species was given.
  Mesh shape(Run& run) const;
};

/// Declares the options on `app`.
void addShapeOptions(CLI::App& app, ShapeArguments& arguments);

}  // namespace nephele::apps

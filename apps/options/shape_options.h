#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/app.h"
#include "apps/options/combine_options.h"
#include "nephele/levelset/cloud/cloud.h"

namespace nephele::apps {

/// What a cloud grows on, as typed: a file, or a shape from a seed.
struct ShapeArguments {
  std::vector<std::string> inputs;
  std::string meshOutput;
  /// What several inputs become.
  CombineArguments combine;
  std::optional<CloudSpecies> species;
  int seed = 0;
  double size = 1;
  MeshRepairOptions repair;
  int subdivide = 0;

  bool isGenerated() const { return species.has_value(); }

  /// What messages call the shape.
  std::string name() const { return inputs.empty() ? "--species" : inputs.front(); }
  /// The shape; where asked for, its mesh is written, too. Several inputs are combined on voxels of the size
  /// that `voxelSize` says for a longest side. @throws CLI::ValidationError where neither a file nor a
  /// species was given.
  Mesh shape(const std::function<double(double)>& voxelSize, Run& run) const;
};

/// Declares the options on `app`.
void addShapeOptions(CLI::App& app, ShapeArguments& arguments);

}  // namespace nephele::apps

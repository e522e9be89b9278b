#pragma once

#include <string>
#include <vector>

#include "apps/options/combine_options.h"

namespace nephele::apps {

/// The options of the verb levelset as typed.
struct LevelsetArguments {
  std::vector<std::string> inputs;
  std::string output;
  Length voxelSizeTyped;
  int resolution = 256;
  MeshToLevelSetOptions conversion;
  MeshRepairOptions repair;
  CombineArguments combine;
  int subdivide = 0;
  const CLI::Option *voxelSizeOption = nullptr, *resolutionOption = nullptr;

  /// The input is one mesh.
  bool isMesh() const;
  /// World units; `own`: that of the input, if it has voxels.
  double voxelSize(double longestSide, std::optional<double> own = {}) const;
  /// Of all inputs. @throws Error naming the file.
  Extent extent() const;
};

/// Declares the options on `app`.
void addLevelsetOptions(CLI::App& app, LevelsetArguments& arguments);

}  // namespace nephele::apps

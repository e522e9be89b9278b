#pragma once

#include <string>
#include <vector>

#include "apps/app.h"
#include "nephele/levelset/grid/level_set_combination.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/levelset/mesh/mesh_to_level_set.h"

namespace nephele::apps {

/// How several inputs become one solid, as typed.
struct CombineArguments {
  Combination combination = Combination::unionOf;
  Length blend;
  const CLI::Option *combinationOption = nullptr, *blendOption = nullptr;

  /// @throws CLI::ValidationError if either was given for fewer than two inputs.
  void refuseFor(std::size_t inputs) const;
};

/// Declares --combine and --blend on `app`.
void addCombineOptions(CLI::App& app, CombineArguments& arguments);

/// Solids from files, closed meshes and level sets, to be combined.
class Solids {
 public:
  /// Reads all; tells what had to be repaired. @throws Error naming the file.
  Solids(const std::vector<std::string>& paths, const MeshRepairOptions& repair, int subdivide, Run& run);

  /// Of all together.
  const Box& box() const { return box_; }
  /// What all of them can fill when they are one, or more.
  Box boxOf(Combination combination) const;
  /// Of the first, if it is a level set.
  std::optional<double> ownVoxelSize() const;
  /// Vertices, triangles and volume of each, for statistics.
  nlohmann::json description() const;

  /// All on one grid, as one; percentages are of `longestSide`. Level sets whose voxels are those of the
  /// grid, and which reach far enough, are taken by their values, others by their surfaces.
  /// @throws Error naming the file that cannot be a level set, or if nothing is left.
  VoxelGrid<float> combined(const CombineArguments& how, const MeshToLevelSetOptions& conversion,
                            double longestSide, Run& run) const;

 private:
  struct Solid {
    std::string path;
    RepairedMesh mesh;
  };
  VoxelGrid<float> levelOf(const Solid& solid, const MeshToLevelSetOptions& conversion, const Run& run) const;

  std::vector<Solid> solids_;
  Box box_;
};

}  // namespace nephele::apps

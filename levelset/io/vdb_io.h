#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/modeling/base/progress.h"

namespace nephele {

/// A grid in OpenVDB's own form; a handle that keeps OpenVDB's headers out of ours.
/// Level sets in it are negative inside, as in files.
class VdbGrid {
 public:
  struct Impl;
  explicit VdbGrid(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}

  const Impl& impl() const { return *impl_; }
  Impl& impl() { return *impl_; }

 private:
  std::shared_ptr<Impl> impl_;
};

/// What a grid is, without its values.
struct VdbGridInfo {
  enum class Class { unknown, levelSet, fogVolume, staggered };

  std::string name;
  std::string type;  ///< OpenVDB's name: float, double, vec3s, ...
  Class gridClass = Class::unknown;
  std::uint64_t activeVoxels = 0;
  Vec3i indexMin{}, indexMax{};  ///< Box of active voxels, both included.
  Vec3f voxelSize{};
  bool uniform = true;  ///< Uniform scale and translation only.
  float background = 0.0f;
  float valueMin = 0.0f, valueMax = 0.0f;  ///< Over active values; scalar grids only.
  bool halfFloat = false;
  std::uint64_t memoryBytes = 0;
  std::map<std::string, std::string> metadata;
};

VdbGridInfo describe(const VdbGrid& grid);

/// Whether a path is that of a volume, by its name: .vdb or .nvdb, in small or capital letters.
bool isVolumeFile(const std::string& path);

/// Every grid of a .vdb or .nvdb file. @throws Error naming the path and what is wrong, also where the file
/// is cut short but OpenVDB would read it silently.
std::vector<VdbGrid> readVdbFile(const std::string& path);

/// One scalar grid: the one called `name`, or the first of the file that fits where `name` is empty. Double
/// grids become float.
/// @throws Error naming the path, the name and the grids that are there.
VdbGrid readScalarGrid(const std::string& path, const std::string& name = {});

/// The three components of the vector grid called `name`, as scalar grids. Those of a staggered grid stand on
/// the faces of its voxels: half a voxel below, each along its own axis. A grid of double vectors becomes
/// float.
/// @throws Error naming the path, the name and the grids that are there.
std::array<VdbGrid, 3> readVectorGrid(const std::string& path, const std::string& name);

/// The same of a vector grid that was read already. @throws Error naming the grid if it holds no vectors.
std::array<VdbGrid, 3> vectorComponents(const VdbGrid& grid);

/// Bricks of a scalar grid. A level set changes sign (positive inside); fog keeps its values.
/// @throws Error naming the grid if it holds no scalars, is too large, not finite, or so far from the origin
/// that single precision would move a voxel by more than an eighth of its size.
std::shared_ptr<BrickGrid> toBricks(const VdbGrid& grid);

/// What a file says of a grid beside its values.
struct VdbGridLabel {
  std::string name;  ///< "density", "surface"
  VdbGridInfo::Class gridClass = VdbGridInfo::Class::unknown;
  bool halfFloat = false;
};

/// OpenVDB form of bricks. Class level set: sign flips (negative inside), background is half-width x voxel
/// size, voxels inside the band are active. Class fog volume: voxels with a value > 0 are active, background
/// 0; constant bricks become tiles.
VdbGrid toVdb(const BrickGrid& bricks, const VdbGridLabel& label);

/// Writes grids to `path`, beside it first and then renamed. `metadata` (command line, seed, version ...)
/// goes to every grid. File version readable by OpenVDB 10. @throws Error naming the path; no partial file
/// stays.
void writeVdbFile(const std::string& path, const std::vector<VdbGrid>& grids,
                  const std::map<std::string, std::string>& metadata);

}  // namespace nephele

#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nephele/levelset/grid/grid_field.h"
#include "nephele/levelset/grid/voxel_grid.h"
#include "nephele/modeling/base/progress.h"

namespace nephele {

/// A grid of a file, in OpenVDB's own form: what is read, described and written. A handle that keeps
/// OpenVDB's headers out of ours. The values are the file's, level sets negative inside; `toBricks` and
/// `toVdb` turn them.
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
  bool halfFloat = false;
  std::uint64_t memoryBytes = 0;
  std::map<std::string, std::string> metadata;
};

VdbGridInfo describe(const VdbGrid& grid);

/// What the active values of a grid reach, or their components.
struct VdbValueRange {
  float min = 0.0f, max = 0.0f;  ///< Over finite ones; 0 where there are none.
  std::uint64_t notFinite = 0;   ///< Voxels that are infinite or not a number.
};

/// Cost: a look at all values. Nothing of a grid that holds no floats, doubles or vectors of these.
VdbValueRange valueRange(const VdbGrid& grid);

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

/// What the values of a grid are: numbers (float, double), vectors (of float, of double), or anything else.
enum class VdbValues { scalar, vector, other };
VdbValues valuesOf(const VdbGrid& grid);

/// The grids of a file without their values: names, types, labels. @throws Error as readVdbFile.
std::vector<VdbGrid> readVdbHeaders(const std::string& path);

/// "it holds 'density' (float), 'v' (vec3s)": for messages.
std::string listOf(const std::vector<VdbGrid>& grids);

/// Around what a grid shows, world units: the surface of a level set, the centres of the active voxels of
/// others; empty if there is nothing.
Box contentBox(const VdbGrid& grid);

/// Bricks of a scalar grid, `made` being told of them. A level set changes sign (positive inside); fog keeps
/// its values.
/// @throws Error naming the grid if it holds no scalars, is too large, not finite, or so far from the origin
/// that single precision would move a voxel by more than an eighth of its size.
std::shared_ptr<BrickGrid> toBricks(const VdbGrid& grid, const BrickSink& made = {});

/// What a file says of a grid beside its values.
struct VdbGridLabel {
  std::string name;  ///< "density", "surface"
  VdbGridInfo::Class gridClass = VdbGridInfo::Class::unknown;
  bool halfFloat = false;
  /// Text beside the values.
  std::map<std::string, std::string> metadata{};
};

/// The label of a grid, without its metadata.
VdbGridLabel labelOf(const VdbGrid& grid);
/// The text that a grid has under a key, if any.
std::optional<std::string> metadataOf(const VdbGrid& grid, const std::string& key);
/// Gives a grid all metadata of another, its class and name among them.
void copyMetadata(const VdbGrid& from, VdbGrid& to);

/// OpenVDB form of bricks. Class level set: sign flips (negative inside), background is half-width x voxel
/// size, voxels inside the band are active. Class fog volume: voxels with a value > 0 are active, background
/// 0; constant bricks become tiles.
/// @throws Error naming the grid if a value is not finite, or its background does not fit its
/// class.
VdbGrid toVdb(const BrickGrid& bricks, const VdbGridLabel& label);
/// The same of voxels. Those that are handed over give their memory back while the tree takes it.
VdbGrid toVdb(VoxelGrid<float> voxels, const VdbGridLabel& label);
/// Voxels of bricks that hold samples are active.
VdbGrid toVdb(VoxelGrid<Vec3f> voxels, const VdbGridLabel& label);
/// A vector grid of three components on one lattice; those of class staggered stand half a voxel below each
/// other's, as readVectorGrid gives them. Voxels where a component differs from its background are active.
VdbGrid toVdb(const VectorGrids& grids, const VdbGridLabel& label);
/// The bricks of a vector grid that hold active voxels. @throws Error naming the grid if it holds no vectors
/// of float, or a value is not finite.
VoxelGrid<Vec3f> toVectorVoxels(const VdbGrid& grid);

/// Of grids that were read and are to be written again. @throws Error naming a grid of points, whose values
/// are not read, two grids of one name, voxels below 1e-12, or a grid that is to be written in 16 bits and
/// has values beyond 65504 or, as a level set, none beyond 9e-5.
void requireWritable(const std::vector<VdbGrid>& grids);

/// Writes grids to `path`, beside it first and then renamed. `metadata` (command line, seed, version ...)
/// goes to every grid. File version readable by OpenVDB 10. @throws Error naming the path, also for what
/// requireWritable refuses, and texts over 64 MiB, which readers refuse; no partial file stays.
void writeVdbFile(const std::string& path, const std::vector<VdbGrid>& grids,
                  const std::map<std::string, std::string>& metadata = {});

}  // namespace nephele

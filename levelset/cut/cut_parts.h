#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>

#include "nephele/levelset/cut/cut.h"

/// Cuts of several parts at once, whose pieces have names and may be cut again.
namespace nephele {

/// Something to be cut: a model, or a piece of an earlier cut.
struct CutPart {
  /// What its pieces are called by: `name`_0001 and so on.
  std::string name = "piece";
  /// Of a piece of an earlier cut: what that was cut from, or nothing. Such a part keeps its name where no
  /// knife touches it, and is the parent of its pieces.
  std::optional<std::string> parent{};
  /// Closed. Also where there is a level set: then it is the mesh of that, for `cutIntoMeshes` that of
  /// `marchingTetrahedra`.
  Mesh mesh{};
  /// Positive inside, with a band of at least 3 voxels. Needed by `cutIntoLevelSets`; `cutIntoMeshes` cuts
  /// it, if there is one, in place of the mesh.
  std::shared_ptr<const BrickGrid> level{};
};

/// Cuts every part by the same knives, exactly, as `cutIntoMeshes` of a mesh, or of a level set for parts
/// that have one. Pieces come part by part. `piece`, cut, becomes `piece_0001`, `piece_0002` ...; a part of
/// an earlier cut that no knife touches stays as it is, name and parent included. Neighbours are found among
/// the pieces of all parts, by triangles that are the same.
/// @throws Error as these do, naming the part where there are several, or if there are no parts or two have
/// one name; Cancelled.
Pieces cutIntoMeshes(std::span<const CutPart> parts, const Knives& knives, const CutOptions& options = {},
                     const Progress& progress = silent());

/// The same by level sets of that voxel size, world units, each in the box of its part. Meshes are those of
/// marching cubes, their faces by the blades the group `inside`. Two pieces are neighbours where a face of
/// one has the other within a voxel in front of it: areas are too small by about a voxel along their rims.
/// With a kerf only pieces of different parts are.
/// @throws Error as `cutIntoLevelSets` of a field, or if a part has no level set; Cancelled.
Pieces cutIntoLevelSets(std::span<const CutPart> parts, double voxelSize, const Knives& knives,
                        const CutOptions& options = {}, const Progress& progress = silent());

}  // namespace nephele

#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "nephele/levelset/cut/cut.h"
#include "nephele/levelset/cut/cut_into_level_sets.h"
#include "nephele/levelset/mesh/mass_properties.h"

/// Pieces with names, and pieces that are cut again.
namespace nephele {

/// Something to be cut: a model, or a piece of an earlier cut.
struct CutPart {
  /// What its pieces are called by: `name`_0001 and so on.
  std::string name = "piece";
  /// Of a piece of an earlier cut: what that was cut from, or nothing. Such a part keeps its name where no
  /// knife touches it, and is the parent of its pieces.
  std::optional<std::string> parent{};
  /// Closed. Also where there is a level set: then it is the mesh of that, for `cutParts` that of
  /// `marchingTetrahedra`.
  Mesh mesh{};
  /// Positive inside, with a band of at least 3 voxels. Needed by `cutPartsAsLevelSets`; `cutParts` cuts it,
  /// if there is one, in place of the mesh.
  std::shared_ptr<const BrickGrid> level{};
};

struct NamedPiece {
  std::string name{};
  /// The piece that this one was cut from; empty where that was no piece.
  std::string parent{};
  Mesh mesh{};
  PieceCode code{};
  std::optional<std::uint32_t> cell{};
  MassProperties mass{};
  Vec3d boxMin{}, boxMax{};
  /// Every edge has a face on either side.
  bool closed = false;
  std::vector<PieceContact> neighbours{};
  /// Of cuts of level sets only.
  std::shared_ptr<BrickGrid> level{};
};

struct PieceSet {
  std::vector<NamedPiece> pieces;
  /// Of all parts before the cut, and of the pieces.
  double volumeOriginal = 0.0, volumeSum = 0.0;
  /// Combinations of sides and cells that hold pieces.
  std::size_t codes = 0;
  /// What was too small, and the volume that went with it.
  std::size_t slivers = 0;
  double sliverVolume = 0.0;
};

/// The inside of a closed mesh as a knife for level sets of that voxel size: its signed distance as far as a
/// cut of that width needs it. @throws Error as `meshDistance`.
Knife solidKnife(const Mesh& solid, double voxelSize, float kerf, const Progress& progress = silent());

/// Cuts every part by the same knives, exactly, see `cutMesh`, and `cutLevelSet` for parts with a level set,
/// where minVolume 0 stands for one voxel. Pieces come part by part. `piece`, cut,
/// becomes `piece_0001`, `piece_0002` ...; a part of an earlier cut that no knife touches stays as it is,
/// name and parent included. Neighbours are found among the pieces of all parts, by inner faces that are the
/// same.
/// @throws Error as these do, naming the part where there are several, or if there are no parts or two
/// have one name; Cancelled.
PieceSet cutParts(std::span<const CutPart> parts, const MeshCutOptions& options,
                  const Progress& progress = silent());

/// The same by level sets, see `cutIntoPieces`; the box of `options` is each part's own. Meshes are those of
/// marching cubes, their faces by the blades the group `inside`. Two pieces are neighbours where an inner
/// face of one has the other within a voxel in front of it: areas hold within some percent, and only if there
/// is no kerf.
PieceSet cutPartsAsLevelSets(std::span<const CutPart> parts, const CutOptions& options,
                             const Progress& progress = silent());

}  // namespace nephele

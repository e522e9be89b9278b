#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "nephele/levelset/cut/cut_parts.h"

namespace nephele {

/// Whose pieces these are, and what is written of them.
struct PieceFilesOptions {
  enum class Format { obj, ply };

  std::string folder;
  Format format = Format::obj;
  /// Also writes all pieces moved apart, see `explodedOffsets`.
  std::optional<double> explode{};
  /// Also writes a level set of each piece, of this voxel size if the cut made none.
  std::optional<double> levelSetVoxelSize{};
  /// For pieces.json: what was cut, by what, how. In the order of the codes.
  std::string source{}, geometry{};
  std::vector<std::string> knives{};
  std::vector<Vec3f> cells{};
  double kerf = 0.0;
  /// Creator, version, command line.
  std::map<std::string, std::string> metadata{};
};

/// How far each piece moves, so that its centroid is 1 + `explode` times as far from the centroid of all.
std::vector<Vec3d> explodedOffsets(const Pieces& pieces, double explode);

/// Writes pieces to a folder, which is made if it is not there: a mesh of each, `NAME.obj` or `NAME.ply`;
/// `pieces.obj`, all of them as objects; `pieces.mtl`, the materials of outer and inner faces;
/// `exploded.obj` and `pieces.vdb` if asked for; and `pieces.json`, which lists them. Returns the names.
///
/// All or nothing: files appear under their names once all are written, pieces.json last. Files that an
/// earlier pieces.json in the folder lists are replaced or removed; no others are touched.
/// @throws Error naming the path; also where the folder holds files that are in the way: of the same names,
/// or meshes named like pieces, which no pieces.json lists. Cancelled.
std::vector<std::string> writePieces(const Pieces& pieces, const PieceFilesOptions& options,
                                     const Progress& progress = silent());

/// @throws Error naming the path if `writePieces` could not make the folder or write to it.
void requireWritableFolder(const std::string& folder);

/// The pieces that a folder holds, as parts for another cut: those that its pieces.json lists, or all its
/// meshes if it has none, by name.
/// @throws Error naming the path: no folder, no meshes, or one that is listed but not there.
std::vector<CutPart> readPieces(const std::string& folder, const Progress& progress = silent());

/// Whether the pieces.json beside a file lists it, so that `writePieces` to its folder replaces or removes
/// it.
/// @throws Error if that list is not one of a cut.
bool isListedPiece(const std::string& path);

/// `+` or `-` for each knife.
std::string codeText(const PieceCode& code);

/// Whether a name is one that a cut gives to pieces of a model: piece_0001, piece_0001_0002 ...
bool isPieceName(const std::string& name);

}  // namespace nephele

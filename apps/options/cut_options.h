#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/app.h"
#include "nephele/levelset/cut/piece_files.h"
#include "nephele/render/preview/pieces_picture.h"

namespace nephele::apps {

struct CutKnives;

/// The options of the verb cut as typed.
struct CutArguments {
  enum class Geometry { exact, levelset };

  std::string input, folder, points, preview;
  std::vector<BladePlane> planes;
  int randomPlanes = 0, cellCount = 0, seed = 0, resolution = 256, octaves = 4;
  bool throughCentre = false, levelSets = false;
  Length roughness, kerf, voxelSize;
  Frequency roughnessFrequency{5, true};
  std::vector<std::string> knifeFiles;
  std::optional<double> explode;
  /// Volume, or a share of the whole in percent; the library's default if not given.
  std::optional<Length> minVolume;
  Geometry geometry = Geometry::exact;
  PieceFilesOptions::Format format = PieceFilesOptions::Format::obj;
  MeshRepairOptions repair;
  PiecesPictureOptions picture;
  const CLI::Option* resolutionOption = nullptr;

  /// What is to be cut, whole and closed, with level sets if these are to be cut.
  /// @throws Error naming the file.
  std::vector<CutPart> readParts(Run& run) const;
  /// Refuses a cut that would take away what it reads. @throws Error naming the file.
  void requireInputsKept() const;
  /// The input is one mesh, not a volume or pieces.
  bool isModel() const;
  /// The pieces, of parts that have level sets if these are to be cut. @throws Error naming the input.
  Pieces cut(const std::vector<CutPart>& parts, const CutKnives& knives, Run& run) const;
  bool hasKnives() const {
    return !planes.empty() || randomPlanes > 0 || !knifeFiles.empty() || cellCount > 0 || !points.empty();
  }
  /// What is written of the pieces.
  PieceFilesOptions files(const CutKnives& knives, const Run& run) const;
};

/// The knives that the arguments ask for, for parts that are there.
struct CutKnives {
  Knives knives;
  CutOptions options;
  /// For pieces.json and messages, in the order of the codes.
  std::vector<std::string> names;
  /// Of level sets.
  double voxelSize = 0;
};

/// @throws CLI::ValidationError if there is no knife, Error naming a file.
Box boxOf(const std::vector<CutPart>& parts);
/// Makes level sets of this voxel size for parts that have none. @throws Error naming the part.
void addLevelSets(std::vector<CutPart>& parts, double voxelSize, Run& run);
CutKnives knivesOf(const CutArguments& arguments, const std::vector<CutPart>& parts, Run& run);

/// Declares the options on `app`.
void addCutOptions(CLI::App& app, CutArguments& arguments);

}  // namespace nephele::apps

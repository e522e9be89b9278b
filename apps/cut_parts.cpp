// What the verb cut cuts, and what it writes.
#include <fmt/format.h>

#include <filesystem>

#include "apps/options/cut_options.h"
#include "nephele/levelset/cut/cut_input.h"
#include "nephele/levelset/cut/marching_tetrahedra.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/levelset/mesh/mesh_to_level_set.h"
#include "nephele/modeling/base/error.h"

namespace nephele::apps {
namespace {

namespace fs = std::filesystem;

std::vector<CutPart> readInput(const CutArguments& a, Run& run) {
  if (fs::is_directory(a.input)) return readPieces(a.input, run);
  CutPart part;
  if (const std::string name = fs::path(a.input).stem().string(); isPieceName(name)) {
    part.name = name;
    part.parent = "";
  }
  if (isVolumeFile(a.input)) {
    part.level = readLevelSet(a.input);
    const bool isExact = a.geometry == CutArguments::Geometry::exact;
    part.mesh = namingFile(
        a.input, [&] { return isExact ? marchingTetrahedra(*part.level, run) : marchingCubes(*part.level); });
    if (part.mesh.faceCount() == 0) throw Error(a.input + ": its level set has no surface");
  } else {
    part.mesh = readMesh(a.input);
  }
  std::vector<CutPart> parts;
  parts.push_back(std::move(part));
  return parts;
}

/// Planes through a convex model part it into at most 1 + n + n over 2 + n over 3 pieces; random ones make
/// two thirds of these.
void requirePiecesMemory(const Knives& knives, std::size_t parts, const Run& run) {
  constexpr double kBytesPerPiece = 7000, kMany = 2e4;
  const auto n = double(knives.planes.size() + knives.rough.size());
  const double most =
      n + n * (n - 1) / 2 + n * (n - 1) * (n - 2) / 6 + double(knives.cells.size()) + double(parts);
  run.requireMemory(kBytesPerPiece * most, fmt::format("use fewer knives than {:g}", n));
  if (most > kMany) run.note(fmt::format("{:g} knives: this may make up to {:.2g} pieces", n, most));
}

}  // namespace

void addLevelSets(std::vector<CutPart>& parts, double voxelSize, Run& run) {
  for (CutPart& part : parts) {
    const MeshToLevelSetOptions options{.voxelSize = voxelSize};
    if (!part.level) part.mesh = triangulated(part.mesh);
    run.requireMemory(2 * estimateLevelSetBytes(part.mesh, options),
                      "use larger voxels (a lower --resolution or a larger --voxel-size)");
    const auto made = [&] { return toBricks(meshToLevelSet(part.mesh, options, run)); };
    if (!part.level) part.level = parts.size() > 1 ? namingFile(part.name, made) : made();
  }
}

Pieces CutArguments::cut(const std::vector<CutPart>& parts, const CutKnives& knives, Run& run) const {
  requirePiecesMemory(knives.knives, parts.size(), run);
  return namingFile(input, [&] {
    return geometry == Geometry::exact
               ? cutIntoMeshes(parts, knives.knives, knives.options, run)
               : cutIntoLevelSets(parts, knives.voxelSize, knives.knives, knives.options, run);
  });
}

std::vector<CutPart> CutArguments::readParts(Run& run) const {
  run.begin("read");
  std::vector<CutPart> parts = readInput(*this, run);
  const bool isListed = fs::exists(fs::path(input) / "pieces.json");
  // What a cut has made is whole, and may hold places that are equal and must not be merged.
  const bool isWrapped = repair.mode == MeshRepairOptions::Mode::wrap;
  if ((!isListed || isWrapped) && !isVolumeFile(input)) {
    run.begin("repair");
    MeshRepairOptions options = repair;
    options.keepPolygons = geometry == Geometry::exact;
    for (CutPart& part : parts) {
      RepairedMesh repaired = namingFile(input, [&] { return repairMesh(part.mesh, options, run); });
      for (const std::string& what : repaired.repairs)
        run.note(parts.size() > 1 ? fmt::format("{}: {}", part.name, what) : what);
      part.mesh = std::move(repaired.mesh);
    }
  }
  std::size_t triangles = 0;
  for (const CutPart& part : parts) triangles += part.mesh.corners.size() - 2 * part.mesh.faceCount();
  // Of a cut, its pieces and their text.
  constexpr double kBytesPerTriangle = 1500;
  run.requireMemory(kBytesPerTriangle * double(triangles), "cut a coarser mesh");
  return parts;
}

void CutArguments::requireInputsKept() const {
  std::vector<std::string> files = knifeFiles;
  files.push_back(input);
  std::error_code error;
  for (const std::string& file : files)
    if (!folder.empty() && fs::equivalent(fs::absolute(file).parent_path(), folder, error) &&
        isListedPiece(file))
      throw Error(
          fmt::format("{}: is one of the pieces in {}, which all make room for the new ones: give the folder "
                      "to cut all of them, or write to another",
                      file, folder));
}

bool CutArguments::isModel() const {
  return !isVolumeFile(input) && !fs::is_directory(input);
}

PieceFilesOptions CutArguments::files(const CutKnives& knives, const Run& run) const {
  PieceFilesOptions files{.folder = folder, .format = format, .explode = explode};
  if (levelSets) files.levelSetVoxelSize = knives.voxelSize;
  files.source = input;
  files.geometry = geometry == Geometry::exact ? "exact" : "levelset";
  files.knives = knives.names;
  files.cells = knives.knives.cells;
  files.kerf = double(knives.options.kerf);
  files.metadata = run.metadata();
  files.metadata["seed"] = std::to_string(seed);
  return files;
}

}  // namespace nephele::apps

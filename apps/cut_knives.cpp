// What the verb cut works with: the parts to be cut, and the knives.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "apps/cut_options.h"
#include "levelset/grid_field.h"
#include "levelset/marching_cubes.h"
#include "levelset/mesh_io.h"
#include "levelset/mesh_to_level_set.h"
#include "levelset/point_io.h"
#include "levelset/vdb_io.h"

namespace nephele::apps {
namespace {

namespace fs = std::filesystem;

/// Voxels along a part in which points are scattered.
constexpr double kScatterResolution = 128;

Box boxOf(const std::vector<CutPart>& parts) {
  Box box;
  for (const CutPart& part : parts) box = box.including(boundingBox(part.mesh));
  return box;
}

std::shared_ptr<const BrickGrid> readLevelSet(const std::string& path) {
  const VdbGrid grid = readScalarGrid(path);
  if (const VdbGridInfo info = describe(grid); info.gridClass != VdbGridInfo::Class::levelSet)
    throw Error(fmt::format("{}: grid '{}' is not a level set; 'nephele mesh' makes a mesh of a density",
                            path, info.name));
  return toBricks(grid);
}

bool isVolume(const std::string& path) {
  return path.ends_with(".vdb") || path.ends_with(".nvdb");
}

Mesh meshOf(const BrickGrid& level, const std::string& path) {
  Mesh mesh = marchingCubes(level);
  require(mesh.faceCount() > 0, fmt::format("{}: its level set has no surface", path));
  return mesh;
}

/// Points inside the parts, as many in each as fit its volume.
std::vector<Vec3f> scatter(const std::vector<CutPart>& parts, int count, std::uint32_t seed) {
  std::vector<double> reached{0};
  for (const CutPart& part : parts) reached.push_back(reached.back() + signedVolume(part.mesh));
  std::vector<Vec3f> points;
  std::size_t last = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const auto until = std::size_t(std::lround(count * reached[i + 1] / reached.back()));
    if (until <= last) continue;
    const Box box = boundingBox(parts[i].mesh);
    const double voxel = double(box.longestSide()) / kScatterResolution;
    const ScalarField inside =
        parts[i].level
            ? gridField(parts[i].level)
            : meshDistance(parts[i].mesh, {.voxelSize = voxel, .exteriorBand = voxel, .interiorBand = voxel});
    const auto some = scatteredPoints(inside, box, int(until - last), seed + std::uint32_t(i));
    points.insert(points.end(), some.begin(), some.end());
    last = until;
  }
  return points;
}

Mesh readKnife(const std::string& path, const MeshRepairOptions& repair, Run& run) {
  if (isVolume(path)) return meshOf(*readLevelSet(path), path);
  const Mesh soup = readMesh(path);
  try {
    RepairedMesh repaired = repairMesh(soup, repair, run);
    for (const std::string& what : repaired.repairs) run.note(fmt::format("{}: {}", path, what));
    return std::move(repaired.mesh);
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& error) {
    throw Error(fmt::format("{}: {}", path, error.what()));
  }
}

std::string planeText(const BladePlane& plane) {
  const auto &p = plane.point, &n = plane.normal;
  return fmt::format("{},{},{},{},{},{}", p.x, p.y, p.z, n.x, n.y, n.z);
}

std::vector<CutPart> readInput(const CutArguments& a, Run& run) {
  if (fs::is_directory(a.input)) return readPieces(a.input, run);
  CutPart part;
  if (const std::string name = fs::path(a.input).stem().string(); isPieceName(name)) {
    part.name = name;
    part.parent = "";
  }
  if (isVolume(a.input)) {
    part.level = readLevelSet(a.input);
    part.mesh = meshOf(*part.level, a.input);
  } else {
    part.mesh = readMesh(a.input);
  }
  std::vector<CutPart> parts;
  parts.push_back(std::move(part));
  return parts;
}

}  // namespace

std::vector<CutPart> CutArguments::readParts(Run& run) const {
  run.begin("read");
  std::vector<CutPart> parts = readInput(*this, run);
  const bool isListed = fs::exists(fs::path(input) / "pieces.json");
  // What a cut has made is whole, and may hold places that are equal and must not be merged.
  if (!isListed && !isVolume(input)) {
    run.begin("repair");
    for (CutPart& part : parts) {
      RepairedMesh repaired = repairMesh(part.mesh, repair, run);
      for (const std::string& what : repaired.repairs)
        run.note(parts.size() > 1 ? fmt::format("{}: {}", part.name, what) : what);
      part.mesh = std::move(repaired.mesh);
    }
  }
  std::size_t triangles = 0;
  for (const CutPart& part : parts) triangles += part.mesh.faceCount();
  // Of a cut, its pieces and their text.
  constexpr double kBytesPerTriangle = 1500;
  run.requireMemory(kBytesPerTriangle * double(triangles), "cut a coarser mesh");
  return parts;
}

bool CutArguments::isModel() const {
  return !isVolume(input) && !fs::is_directory(input);
}

PieceFilesOptions CutArguments::files(const CutKnives& knives, const Run& run) const {
  PieceFilesOptions files{.folder = folder, .format = format, .explode = explode};
  if (levelSets) files.levelSetVoxelSize = knives.voxelSize;
  files.source = input;
  files.geometry = geometry == Geometry::exact ? "exact" : "levelset";
  files.knives = knives.names;
  files.cells = knives.exact.cells;
  files.kerf = double(knives.exact.kerf);
  files.metadata = run.metadata();
  files.metadata["seed"] = std::to_string(seed);
  return files;
}

CutKnives knivesOf(const CutArguments& a, const std::vector<CutPart>& parts, Run& run) {
  CutKnives knives;
  const Box box = boxOf(parts);
  const auto side = double(box.longestSide());
  std::vector<BladePlane> planes = a.planes;
  const auto random = randomBlades(
      {.count = a.randomPlanes, .box = box, .throughCentre = a.throughCentre, .seed = std::uint32_t(a.seed)});
  planes.insert(planes.end(), random.begin(), random.end());
  const auto amplitude = float(a.roughness.worldUnits(side));
  for (std::uint32_t i = 0; i < planes.size(); ++i) {
    knives.names.push_back((amplitude > 0 ? "rough plane " : "plane ") + planeText(planes[i]));
    if (amplitude == 0) {
      knives.exact.planes.push_back(planes[i]);
      continue;
    }
    knives.exact.rough.push_back({planes[i],
                                  {.amplitude = amplitude,
                                   .noise = {.frequency = float(a.roughnessFrequency.perWorldUnit(side)),
                                             .seed = std::uint32_t(a.seed) * 7919u + i},
                                   .octaves = a.octaves}});
  }
  for (const std::string& path : a.knifeFiles) {
    run.begin("knife");
    knives.names.push_back("file " + path);
    knives.exact.solids.push_back(readKnife(path, a.repair, run));
  }
  if (a.cellCount > 0) {
    run.begin("scatter");
    knives.exact.cells = scatter(parts, a.cellCount, std::uint32_t(a.seed));
  }
  if (!a.points.empty())
    for (const Vec3d& p : readPoints(a.points).positions) knives.exact.cells.emplace_back(p);
  if (knives.names.empty() && knives.exact.cells.empty())
    throw CLI::ValidationError("no knife", "give --plane, --random-planes, --knife, --voronoi or --points");
  knives.exact.kerf = float(a.kerf.worldUnits(side));
  if (a.minVolume.value > 0) {
    double whole = 0;
    for (const CutPart& part : parts) whole += signedVolume(part.mesh);
    knives.exact.minVolume = a.minVolume.worldUnits(whole);
  }
  knives.voxelSize = a.voxelSize.value > 0 ? a.voxelSize.worldUnits(side) : side / a.resolution;
  if (a.voxelSize.value == 0 && a.resolutionOption->count() == 0 && parts[0].level)
    knives.voxelSize = double(parts[0].level->voxelSize);
  return knives;
}

CutOptions CutKnives::forLevelSets(const Progress& progress) const {
  CutOptions options{.voxelSize = float(voxelSize), .cells = exact.cells, .kerf = exact.kerf};
  for (const BladePlane& plane : exact.planes) options.knives.push_back(flatKnife(plane));
  for (const RoughBlade& blade : exact.rough)
    options.knives.push_back(roughKnife(blade.plane, blade.roughness));
  const double reach = 0.5 * double(exact.kerf) + 4 * voxelSize;
  for (const Mesh& solid : exact.solids)
    options.knives.emplace_back(meshDistance(
        solid, {.voxelSize = voxelSize, .exteriorBand = reach, .interiorBand = reach}, progress));
  if (exact.minVolume > 0) options.minVolume = exact.minVolume / (voxelSize * voxelSize * voxelSize);
  return options;
}

}  // namespace nephele::apps

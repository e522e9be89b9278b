#include "nephele/levelset/cut/cut_input.h"

#include <fmt/format.h>

#include <cmath>

#include "nephele/levelset/grid/grid_field.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/levelset/mesh/mesh_distance.h"
#include "nephele/modeling/base/error.h"

namespace nephele {

std::shared_ptr<const BrickGrid> readLevelSet(const std::string& path) {
  const VdbGrid grid = readScalarGrid(path);
  if (const VdbGridInfo info = describe(grid); info.gridClass != VdbGridInfo::Class::levelSet)
    throw Error(fmt::format("{}: grid '{}' is not a level set; make a mesh of it first", path, info.name));
  return namingFile(path, [&] { return toBricks(grid); });
}

Mesh readSolid(const std::string& path, const MeshRepairOptions& repair, const Progress& progress) {
  if (isVolumeFile(path)) {
    Mesh surface = marchingCubes(*readLevelSet(path));
    require(surface.faceCount() > 0, path + ": its level set has no surface");
    return surface;
  }
  const Mesh soup = readMesh(path);
  RepairedMesh repaired = namingFile(path, [&] { return repairMesh(soup, repair, progress); });
  for (const std::string& what : repaired.repairs) progress.note(fmt::format("{}: {}", path, what));
  return std::move(repaired.mesh);
}

std::vector<Vec3f> scatteredPoints(std::span<const CutPart> parts, int count, std::uint32_t seed) {
  // Voxels along a part in which points are scattered.
  constexpr double kResolution = 128;
  std::vector<double> reached{0};
  for (const CutPart& part : parts) reached.push_back(reached.back() + signedVolume(part.mesh));
  std::vector<Vec3f> points;
  std::size_t last = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const auto until = std::size_t(std::lround(count * reached[i + 1] / reached.back()));
    if (until <= last) continue;
    const Box box = boundingBox(parts[i].mesh);
    const double voxel = double(box.longestSide()) / kResolution;
    const ScalarField inside =
        parts[i].level ? gridField(parts[i].level)
                       : meshDistance(triangulated(parts[i].mesh),
                                      {.voxelSize = voxel, .exteriorBand = voxel, .interiorBand = voxel});
    const auto some = scatteredPoints(inside, box, int(until - last), seed + std::uint32_t(i));
    points.insert(points.end(), some.begin(), some.end());
    last = until;
  }
  return points;
}

}  // namespace nephele

// The knives of the verb cut.
#include <fmt/format.h>

#include "apps/options/cut_options.h"
#include "nephele/levelset/cut/cut_input.h"
#include "nephele/levelset/io/point_io.h"

namespace nephele::apps {
namespace {

Box boxOf(const std::vector<CutPart>& parts) {
  Box box;
  for (const CutPart& part : parts) box = box.including(boundingBox(part.mesh));
  return box;
}

std::string planeText(const BladePlane& plane) {
  const auto &p = plane.point, &n = plane.normal;
  return fmt::format("{},{},{},{},{},{}", p.x, p.y, p.z, n.x, n.y, n.z);
}

}  // namespace

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
    knives.exact.solids.push_back(readSolid(path, a.repair, run));
  }
  if (a.cellCount > 0) {
    run.begin("scatter");
    knives.exact.cells = scatteredPoints(parts, a.cellCount, std::uint32_t(a.seed));
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
  for (const Mesh& solid : exact.solids)
    options.knives.push_back(solidKnife(solid, voxelSize, exact.kerf, progress));
  if (exact.minVolume > 0) options.minVolume = exact.minVolume / (voxelSize * voxelSize * voxelSize);
  return options;
}

}  // namespace nephele::apps

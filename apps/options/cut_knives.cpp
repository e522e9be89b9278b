// The knives of the verb cut.
#include <fmt/format.h>

#include "apps/options/cut_options.h"
#include "apps/options/expression_names.h"
#include "nephele/levelset/cut/cut_input.h"
#include "nephele/levelset/io/point_io.h"
#include "nephele/levelset/mesh/marching_cubes.h"

namespace nephele::apps {
namespace {

std::string planeText(const BladePlane& plane) {
  const auto &p = plane.point, &n = plane.normal;
  return fmt::format("{},{},{},{},{},{}", p.x, p.y, p.z, n.x, n.y, n.z);
}

/// The part of space around `box` where `blade` is positive, as a closed mesh; where it is positive nowhere,
/// one that lies beside the box, and parts nothing.
Mesh solidOf(const ScalarField& blade, const Box& box, double voxelSize, float kerf, Run& run) {
  Mesh mesh = marchingCubes(*sampledBlade(blade, box, voxelSize, kerf, run), 0.0f, run);
  if (mesh.faceCount() > 0) return mesh;
  const auto voxel = float(voxelSize);
  const float away = box.longestSide() + 32 * voxel + 4 * kerf;
  const Vec3f corner = box.max + Vec3f{away, away, away};
  const Box beside{corner, corner + Vec3f{voxel, voxel, voxel}};
  return marchingCubes(*sampledBlade(ScalarField(1.0f), beside, voxelSize, kerf, run), 0.0f, run);
}

}  // namespace

Box boxOf(const std::vector<CutPart>& parts) {
  Box box;
  for (const CutPart& part : parts) box = box.including(boundingBox(part.mesh));
  return box;
}

CutKnives knivesOf(const CutArguments& a, const std::vector<CutPart>& parts, Run& run) {
  CutKnives result;
  Knives& knives = result.knives;
  const Box box = run.box(boxOf(parts));
  const double side = run.longestSide(box);
  std::vector<BladePlane> planes = a.planes;
  const auto random = randomBlades(
      {.count = a.randomPlanes, .box = box, .throughCentre = a.throughCentre, .seed = std::uint32_t(a.seed)});
  planes.insert(planes.end(), random.begin(), random.end());
  const auto amplitude = float(a.roughness.worldUnits(side));
  const bool areCellsRough = amplitude > 0 && (a.cellCount > 0 || !a.points.empty());
  if (areCellsRough && a.geometry == CutArguments::Geometry::levelset)
    throw CLI::ValidationError("--roughness", "rough walls of cells are for --geometry exact alone");
  if (double(amplitude) > side)
    throw CLI::ValidationError(
        "--roughness",
        fmt::format("may be 0 to the longest side of what is cut, {:.4g} or 100%, and is {:.4g}", side,
                    amplitude));
  for (std::uint32_t i = 0; i < planes.size(); ++i) {
    result.names.push_back((amplitude > 0 ? "rough plane " : "plane ") + planeText(planes[i]));
    if (amplitude == 0) {
      knives.planes.push_back(planes[i]);
      continue;
    }
    knives.rough.push_back({planes[i],
                            {.amplitude = amplitude,
                             .noise = {.frequency = float(a.roughnessFrequency.perWorldUnit(side)),
                                       .seed = std::uint32_t(a.seed) * 7919u + i},
                             .octaves = a.octaves}});
  }
  for (const std::string& path : a.knifeFiles) {
    if (path.starts_with('=')) continue;
    run.begin("knife");
    result.names.push_back("file " + path);
    knives.solids.push_back(readSolid(path, a.repair, run));
  }
  result.options.kerf = float(a.kerf.worldUnits(side));
  result.voxelSize = a.voxelSize.value > 0 ? a.voxelSize.worldUnits(side) : side / a.resolution;
  if (a.voxelSize.value == 0 && a.resolutionOption->count() == 0 && parts[0].level)
    result.voxelSize = double(parts[0].level->voxelSize());
  for (const std::string& text : a.knifeFiles) {
    if (!text.starts_with('=')) continue;
    run.begin("knife");
    result.names.push_back("expression " + text.substr(1));
    const ScalarField blade = evaluated("--knife", text.substr(1), {felt::Kind::scalarField},
                                        namesOfPlace(double(run.frame().value_or(0)), a.seed), side)
                                  .as<ScalarField>();
    knives.solids.push_back(solidOf(blade, box, result.voxelSize, result.options.kerf, run));
  }
  if (a.cellCount > 0) {
    run.begin("scatter");
    knives.cells = namingFile(fmt::format("{}: --voronoi", a.input),
                              [&] { return scatteredPoints(parts, a.cellCount, std::uint32_t(a.seed)); });
  }
  if (areCellsRough)
    knives.cellRoughness = {.amplitude = amplitude,
                            .noise = {.frequency = float(a.roughnessFrequency.perWorldUnit(side)),
                                      .seed = std::uint32_t(a.seed) * 7919u + 4001u},
                            .octaves = a.octaves};
  if (!a.points.empty())
    for (const Vec3d& p : readPoints(a.points).positions) knives.cells.emplace_back(p);
  if (result.names.empty() && knives.cells.empty())
    throw CLI::ValidationError("no knife", "give --plane, --random-planes, --knife, --voronoi or --points");
  if (a.minVolume) {
    double whole = 0;
    for (const CutPart& part : parts) whole += signedVolume(part.mesh);
    result.options.minVolume = a.minVolume->worldUnits(whole);
    if (*result.options.minVolume > whole)
      throw CLI::ValidationError(
          "--min-volume", fmt::format("may be 0 to the volume of what is cut, {:.4g} or 100%, and is {:.4g}",
                                      whole, *result.options.minVolume));
  }
  return result;
}

}  // namespace nephele::apps

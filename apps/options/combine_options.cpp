#include "apps/options/combine_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "apps/options/mesh_options.h"
#include "nephele/levelset/cloud/cloud.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/error.h"

namespace nephele::apps {
namespace {

bool hasInside(const VoxelGrid<float>& level) {
  bool has = false;
  level.forEachBrick([&](const Vec3i&, std::int32_t entry) {
    const std::span<const float> values = entry >= 0
                                              ? std::span(level.samples(entry), std::size_t(kBrickSamples))
                                              : std::span(&level.constants()[std::size_t(-1 - entry)], 1);
    has = has || std::ranges::any_of(values, [](float value) { return value > 0; });
  });
  return has;
}

}  // namespace

void addCombineOptions(CLI::App& app, CombineArguments& arguments) {
  arguments.combinationOption = addChoice<Combination>(
      app, "--combine", arguments.combination,
      {{"union", Combination::unionOf},
       {"intersection", Combination::intersection},
       {"cutout", Combination::cutout}},
      "What several inputs become: all that is inside one of them, what is inside all, or the "
      "first without the others.");
  arguments.blendOption =
      addLength(app, "--blend", arguments.blend,
                "Round the creases where several inputs meet: surfaces blend where they are as near as this.")
          ->default_str("0");
}

void CombineArguments::refuseFor(std::size_t inputs) const {
  if (inputs < 2) refuseGiven({combinationOption, blendOption}, "is for several inputs, which become one");
}

Solids::Solids(const std::vector<std::string>& paths, const MeshRepairOptions& repair, int subdivide,
               Run& run) {
  run.begin("read");
  for (const std::string& path : paths) {
    RepairedMesh mesh = readShape(path, repair, run);
    for (const std::string& what : mesh.repairs) run.note(fmt::format("{}: {}", path, what));
    if (subdivide > 0) {
      mesh.mesh = subdividedAsAsked(std::move(mesh.mesh), subdivide, run);
      mesh.after = diagnose(mesh.mesh);
    }
    box_ = box_.including(mesh.after.box);
    solids_.push_back({path, std::move(mesh)});
  }
}

Box Solids::boxOf(Combination combination) const {
  if (combination == Combination::unionOf) return box_;
  Box box = solids_.front().mesh.after.box;
  if (combination == Combination::intersection)
    for (const Solid& solid : solids_) box = box.intersection(solid.mesh.after.box);
  return box;
}

std::optional<double> Solids::ownVoxelSize() const {
  const std::string& first = solids_.front().path;
  if (!isVolumeFile(first)) return std::nullopt;
  return double(describe(readScalarGrid(first)).voxelSize.x);
}

nlohmann::json Solids::description() const {
  auto list = nlohmann::json::array();
  for (const auto& [path, mesh] : solids_)
    list.push_back({{"path", path},
                    {"vertices", mesh.after.vertices},
                    {"triangles", mesh.after.triangles},
                    {"volume", mesh.after.volume}});
  return list;
}

VoxelGrid<float> Solids::levelOf(const Solid& solid, const MeshToLevelSetOptions& conversion,
                                 const Run& run) const {
  if (isVolumeFile(solid.path)) {
    const auto bricks = toBricks(readScalarGrid(solid.path));
    const Lattice wanted = Lattice::uniform(float(conversion.voxelSize)), &own = bricks->lattice();
    const auto isSame = [&](const Vec3f& p) { return own.indexToWorld(p) == wanted.indexToWorld(p); };
    const bool reaches =
        -bricks->background() >= float(conversion.halfWidthVoxels * conversion.voxelSize) * 0.9999f;
    if (reaches && isSame({0, 0, 0}) && isSame({1, 0, 0}) && isSame({0, 1, 0}) && isSame({0, 0, 1}))
      return toVoxels(*bricks);
  }
  return meshToLevelSet(solid.mesh.mesh, conversion, run);
}

VoxelGrid<float> Solids::combined(const CombineArguments& how, const MeshToLevelSetOptions& conversion,
                                  double longestSide, Run& run) const {
  const CombinationOptions options{.combination = how.combination,
                                   .blend = float(how.blend.worldUnits(longestSide)),
                                   .halfWidth = float(conversion.halfWidthVoxels * conversion.voxelSize)};
  MeshToLevelSetOptions each = conversion;
  each.halfWidthVoxels = double(neededHalfWidth(options)) / conversion.voxelSize;
  double bytes = 0;
  for (const Solid& solid : solids_) bytes += estimateLevelSetBytes(solid.mesh.mesh, each);
  run.requireMemory(
      bytes, "use larger voxels (a lower --resolution or a larger --voxel-size), or a smaller --blend");
  std::vector<VoxelGrid<float>> levels;
  for (const Solid& solid : solids_)
    levels.push_back(namingFile(solid.path, [&] { return levelOf(solid, each, run); }));
  VoxelGrid<float> result = nephele::combined(levels, options, run);
  if (!hasInside(result))
    throw Error(fmt::format(
        "{}: nothing is left of the inputs together: they {}", solids_.front().path,
        how.combination == Combination::cutout ? "are inside the others" : "have nothing in common"));
  return result;
}

}  // namespace nephele::apps

#include "apps/options/picture/volume_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "apps/options/expression_names.h"
#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/render/volume/volume_parts.h"

namespace nephele::apps {
namespace {

std::shared_ptr<const BrickGrid> readFog(const std::string& path, const std::string& grid, Run& run,
                                         const BrickSink& made = {}) {
  if (isMeshFile(path))
    throw Error(fmt::format("{}: is a mesh, not a density; 'nephele cloud {} -o cloud.vdb' makes one of it",
                            path, path));
  const VdbGrid vdb = readScalarGrid(path, grid);
  const VdbGridInfo info = describe(vdb);
  if (info.gridClass == VdbGridInfo::Class::levelSet)
    throw Error(fmt::format("{}: grid '{}' is a level set, not a density; 'nephele cloud' makes one of it",
                            path, info.name));
  // A brick holds 11^3 samples for 8^3 voxels, rarely all in use.
  const Vec3d size(info.indexMax - info.indexMin);
  // What is coded is counted by who codes it.
  run.requireMemory((made ? 0.0 : 25.0) * double(info.activeVoxels) +
                        (size.x / 8 + 2) * (size.y / 8 + 2) * (size.z / 8 + 2) * 6,
                    "make the volume with larger voxels");
  return toBricks(vdb, made);
}

VolumePart::Grids readThree(const std::string& path, const std::string& grid, double scale = 1) {
  VolumePart::Grids result;
  const std::array<VdbGrid, 3> parts = readVectorGrid(path, grid);
  for (std::size_t c = 0; c != 3; ++c) {
    const auto bricks = toBricks(parts[c]);
    if (scale != 1) bricks->multiply(float(scale));
    result[c] = bricks;
  }
  return result;
}

// A grid of colours, or of numbers that glow white.
VolumePart::Grids readGlow(const std::string& path, const std::string& grid, Run& run) {
  const bool isNumbers = std::ranges::any_of(readVdbHeaders(path), [&](const VdbGrid& one) {
    return labelOf(one).name == grid && valuesOf(one) == VdbValues::scalar;
  });
  if (!isNumbers) return readThree(path, grid);
  const std::shared_ptr<const BrickGrid> one = readFog(path, grid, run);
  return {one, one, one};
}

// The entry for volume `index` of a list with one for all, or one for each.
template <class T>
T entryOf(const std::vector<T>& list, std::size_t index, const T& standard) {
  return list.empty() ? standard : list[list.size() > 1 ? index : 0];
}

// Colours of an expression, where the density has samples, and a little beyond, so that no edge is darker.
VolumePart::Grids colourOf(const std::string& expression, const BrickGrid& density,
                           const VolumeReading& reading, Run& run) {
  // Colours change over shapes, not within their detail.
  constexpr float kAcross = 192;
  const Box box = density.worldBox();
  const float side = box.longestSide(), voxel = std::max(side / kAcross, density.voxelSize());
  const VectorField color = evaluated("--color", expression, {felt::Kind::vectorField},
                                      namesOfPlace(reading.time, reading.seed), run.longestSide(box))
                                .as<VectorField>();
  VolumePart::Grids grids;
  for (std::size_t c = 0; c < 3; ++c)
    grids[c] = bakeGrid(clamp(component(color, int(c)), 0, 1),
                        {.voxelSize = voxel, .box = box.expanded(2 * voxel), .background = 0.0f}, run);
  return grids;
}

/// Codes the density of a part while it is made, where that is asked for and enough.
BrickSink codingOf(VolumePart& part, const VolumeOptions& options, const VolumeReading& reading, Run& run) {
  if (!reading.coded || part.share != 1 || options.hasOthers()) return {};
  part.coded = std::make_shared<CodedDensity>();
  return {[coded = part.coded, &run](std::size_t bricks, std::size_t places) {
            run.requireMemory(CodedBricks::estimateBytes(double(bricks), double(places)),
                              "make the volume with larger voxels");
            coded->begin(bricks);
          },
          [coded = part.coded](std::int32_t pool, const float* samples) { coded->take(pool, samples); }};
}

VolumePart readPart(const std::string& path, std::size_t index, const VolumeOptions& options,
                    const VolumeReading& reading, Run& run) {
  const auto nameIn = [&](const std::vector<std::string>& names) {
    const std::string name = entryOf(names, index, std::string());
    return name == "none" ? std::string() : name;
  };
  VolumePart part;
  part.share = float(entryOf(options.densityScales, index, 1.0));
  // No float tells what lies behind so little from what lies behind nothing.
  if (reading.holdsObjects && part.share == 0) part.share = 1e-12f;
  const BrickSink made = codingOf(part, options, reading, run);
  part.density = readFog(path, nameIn(options.densityGrids), run, made);
  if (const std::string name = nameIn(options.colourGrids); !name.empty())
    part.colour = readThree(path, name);
  else if (!options.color.empty())
    part.colour = colourOf(options.color, *part.density, reading, run);
  if (const std::string name = nameIn(options.emissionGrids); !name.empty())
    part.emission = readGlow(path, name, run);
  if (const std::string name = nameIn(options.temperatureGrids); !name.empty())
    part.temperature = readFog(path, name, run);
  if (const std::string name = nameIn(options.velocityGrids); !name.empty() && !reading.shutter.isInstant()) {
    part.velocity = readThree(path, name, options.velocityFactor());
    part.shutter = reading.shutter;
  }
  part.emissionScale = float(options.emissionScale);
  part.temperatureScale = float(options.temperatureScale);
  return part;
}

void checkCount(const std::string& option, std::size_t given, std::size_t volumes) {
  if (given > 1 && given != volumes)
    throw Error(volumes == 1 ? fmt::format("{}: got {} entries for 1 volume, allowed: 1", option, given)
                             : fmt::format("{}: got {} entries for {} volumes, allowed: 1 or {}", option,
                                           given, volumes, volumes));
}

void requireScaledVelocity(const VolumeOptions& options) {
  if (options.velocityScale && options.velocityGrids.empty())
    throw CLI::ValidationError("--velocity-scale", "multiplies a velocity grid; give --velocity-grid");
}

}  // namespace

std::vector<std::string> VolumeOptions::seenGrids(std::size_t files) const {
  checkCount("--grid", densityGrids.size(), files);
  std::vector<std::string> names(files);
  for (std::size_t i = 0; i != files; ++i)
    if (const std::string name = entryOf(densityGrids, i, std::string()); name != "none") names[i] = name;
  return names;
}

void addVolumeOptions(CLI::App& app, VolumeOptions& options) {
  const auto addGrid = [&app](const std::string& name, std::vector<std::string>& target,
                              const std::string& text) {
    return app.add_option(name, target, text)
        ->type_name("NAME[,NAME...]")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->default_str("none");
  };
  addGrid("--grid", options.densityGrids,
          "Density in the file; several names are for one volume after the other, here and below.")
      ->default_str("the first grid that holds numbers");
  addGrid("--color-grid", options.colourGrids, "Colours, 0 to 1, that multiply the albedo: 'Cd'.");
  app.add_option_function<std::string>(
         "--color",
         [&options](const std::string& text) {
           if (!text.starts_with('='))
             refuseValue("--color", text, "an expression of P, time and seed after =, as in =(1, 0.5, 0.2)");
           options.color = text.substr(1);
           checkedExpression("--color", options.color, {felt::Kind::vectorField}, namesOfPlace(0, 0));
         },
         "Color, 0 to 1, that multiplies the albedo where there is no --color-grid, as a vector of P, time "
         "and seed.")
      ->type_name("=EXPRESSION")
      ->default_str("none");
  addGrid("--emission-grid", options.emissionGrids,
          "Numbers or colours that glow: as bright as this where density 1 is opaque.");
  addGrid("--temperature-grid", options.temperatureGrids,
          "Temperatures that glow as black bodies, luminance 1 at 2000 K.");
  addNumber(app, "--temperature-scale", options.temperatureScale, 1e-6, 1e5,
            "Kelvins where the temperature grid is 1.");
  addGrid("--velocity-grid", options.velocityGrids,
          "Velocities that blur the volume while the --shutter is open: world units per second, 24 frames "
          "in one, unless --velocity-scale says otherwise.");
  addOptional(app, "--velocity-scale", options.velocityScale, -1e6, 1e6,
              "Multiplies the velocity grid: frames, to world units per frame.")
      ->default_str(fmt::format("{:g}", options.velocityFactor()));
  addNumber(app, "--emission-scale", options.emissionScale, 0, 1e12, "Multiplies all that glows.");
  app.add_option_function<std::string>(
         "--density-scale",
         [&options](const std::string& text) {
           const std::string form = "numbers of at least 0, one for all volumes or one for each";
           options.densityScales = parseNumbers("--density-scale", text, form);
           for (const double scale : options.densityScales)
             if (!(scale >= 0 && scale <= 1e12)) refuseValue("--density-scale", text, form);
         },
         "Multiplies the densities: of all volumes, or of one after the other.")
      ->type_name("NUMBER[,NUMBER...]")
      ->default_str("1");
}

void requireNoGrids(const VolumeOptions& options) {
  const auto names = [](const std::vector<std::string>& list) {
    return std::ranges::any_of(list, [](const std::string& name) { return name != "none"; });
  };
  // Not --temperature-grid, which a look gives to whatever it is put on.
  const std::pair<const char*, bool> given[] = {{"--grid", names(options.densityGrids)},
                                                {"--color-grid", names(options.colourGrids)},
                                                {"--color", !options.color.empty()},
                                                {"--emission-grid", names(options.emissionGrids)},
                                                {"--velocity-grid", names(options.velocityGrids)}};
  for (const auto& [option, isGiven] : given)
    if (isGiven)
      throw CLI::ValidationError(option, "is for files of volumes; a script declares what there is itself");
  checkCount("--density-scale", options.densityScales.size(), 1);
}

RenderVolume readVolumes(const std::vector<std::string>& paths, const VolumeOptions& options,
                         const VolumeReading& reading, Run& run) {
  checkCount("--grid", options.densityGrids.size(), paths.size());
  checkCount("--color-grid", options.colourGrids.size(), paths.size());
  checkCount("--emission-grid", options.emissionGrids.size(), paths.size());
  checkCount("--temperature-grid", options.temperatureGrids.size(), paths.size());
  checkCount("--velocity-grid", options.velocityGrids.size(), paths.size());
  checkCount("--density-scale", options.densityScales.size(), paths.size());
  requireScaledVelocity(options);
  if (!options.velocityGrids.empty() && reading.shutter.isInstant())
    throw CLI::ValidationError("--velocity-grid", "shows only while the shutter is open; give --shutter");
  run.begin("read");
  VolumeReading each = reading;
  each.coded = reading.coded && paths.size() == 1;
  std::vector<VolumePart> parts;
  for (std::size_t i = 0; i != paths.size(); ++i)
    namingFile(paths[i], [&] { check(parts.emplace_back(readPart(paths[i], i, options, each, run))); });
  // Trees of files are many small parts.
  detail::releaseFreed();
  run.requireMemory(estimateCombinedBytes(parts), "make the volumes with larger voxels");
  if (paths.size() > 1) return combine(parts, run);
  std::optional<RenderVolume> only;
  namingFile(paths.front(), [&] { only.emplace(combine(parts, run)); });
  return *std::move(only);
}

RenderVolume volumeOf(const std::function<std::shared_ptr<const BrickGrid>(const BrickSink&)>& make,
                      const VolumeOptions& options, const VolumeReading& reading, Run& run) {
  const auto isAsked = [](const char* option, const std::vector<std::string>& names) {
    if (names.empty() || names[0] == "none") return false;
    if (names[0] != "density")
      throw CLI::ValidationError(option,
                                 fmt::format("got '{}', and the cloud has one grid, density", names[0]));
    return true;
  };
  requireScaledVelocity(options);
  VolumePart part;
  isAsked("--grid", options.densityGrids);
  part.share = float(entryOf(options.densityScales, 0, 1.0));
  if (reading.holdsObjects && part.share == 0) part.share = 1e-12f;
  part.density = make(codingOf(part, options, reading, run));
  const std::shared_ptr<const BrickGrid>& density = part.density;
  if (isAsked("--color-grid", options.colourGrids))
    part.colour = {density, density, density};
  else if (!options.color.empty())
    part.colour = colourOf(options.color, *density, reading, run);
  if (isAsked("--emission-grid", options.emissionGrids)) part.emission = {density, density, density};
  if (isAsked("--temperature-grid", options.temperatureGrids)) part.temperature = density;
  if (!options.velocityGrids.empty())
    throw CLI::ValidationError("--velocity-grid", "the cloud has no velocities");
  part.emissionScale = float(options.emissionScale);
  part.temperatureScale = float(options.temperatureScale);
  check(part);
  return combine({part}, run);
}

}  // namespace nephele::apps

#include <fmt/format.h>

#include "apps/app.h"
#include "apps/options/advect_options.h"
#include "nephele/levelset/flow/advection_files.h"
#include "nephele/modeling/base/error.h"

namespace nephele::apps {
namespace {

nlohmann::json stepsOf(const AdvectedGrids& result) {
  auto steps = nlohmann::json::array();
  for (const AdvectionStep& step : result.steps)
    steps.push_back({{"seconds", step.seconds},
                     {"bricks", step.bricks},
                     {"memory_bytes", step.memoryBytes},
                     {"folded_fraction", step.foldedShare},
                     {"rebaked", step.rebaked}});
  return steps;
}

void requireCarried(const CarriedGrids& input, const std::string& path) {
  if (!input.box.isEmpty()) return;
  const std::string others = fmt::format("{}", fmt::join(input.leftOut, ", "));
  throw Error(fmt::format("{}: no grid of numbers or vectors holds anything{}", path,
                          others.empty() ? "" : "; it holds " + others));
}

Extent extentOfCarried(const AdvectArguments& arguments, Run&) {
  const Box box = carriedGrids(readVdbFile(arguments.input)).box;
  return {box, double(box.longestSide())};
}

void carry(const AdvectArguments& arguments, Run& run) {
  AdvectionOptions options = arguments.resolved();
  options.mostBytes = run.memoryLimitBytes;
  run.begin("read");
  run.expect(0, 0.05);
  const CarriedGrids input =
      namingFile(arguments.input, [&] { return carriedGrids(readVdbFile(arguments.input)); });
  requireCarried(input, arguments.input);
  for (const std::string& grid : input.leftOut)
    run.note(
        fmt::format("{}: grid {} is left out: only numbers and vectors are carried", arguments.input, grid));
  if (!arguments.continueFrom.empty()) options.startMap = readFlowMap(arguments.continueFrom);
  const VectorField velocity =
      arguments.velocity.field(run.longestSide(input.box), double(run.frame().value_or(0)));
  run.requireMemory(
      namingFile(arguments.input, [&] { return estimatedAdvectionBytes(input.bricks, options); }),
      "use a larger --map-coarseness, or larger voxels in the input");

  run.begin("advect");
  run.expect(0.05, 0.9);
  // Velocities that are too fast are so beside the voxels of the input.
  const AdvectedGrids result =
      namingFile(arguments.velocity.path.empty() ? arguments.input : arguments.velocity.path,
                 [&] { return advectGrids(input.bricks, velocity, options, run); });
  run.stats["steps"] = stepsOf(result);

  run.begin("write");
  const std::vector<VdbGrid> grids = toVdb(input, result.grids);
  writeVdbFile(arguments.output, grids, run.metadata());
  if (!arguments.map.empty()) writeVdbFile(arguments.map, toVdb(*result.map), run.metadata());

  run.stats["grids"] = nlohmann::json::array();
  for (const VdbGrid& grid : grids) {
    const VdbGridInfo info = describe(grid);
    run.stats["grids"].push_back({{"name", info.name}, {"active_voxels", info.activeVoxels}});
    run.result(
        fmt::format("{}: grid '{}', {} active voxels", arguments.output, info.name, info.activeVoxels));
  }
  const double folded = result.steps.empty() ? 0 : result.steps.back().foldedShare;
  if (folded > 0.05 && !options.rebakeShare)
    run.note(fmt::format("{:.0f} % of the map has folded; start a new one from {}", 100 * folded,
                         arguments.output));
}

}  // namespace

Verb advectVerb() {
  return verbOf(
      "advect", "Carries the grids of a volume along with a velocity.",
      "nephele advect cloud.vdb -o wisps.vdb --velocity curl:amplitude=0.3%,frequency=8x --steps 12",
      addAdvectOptions, carry, {}, extentOfCarried);
}

}  // namespace nephele::apps

#include "apps/options/cloud_advection.h"

#include "apps/options/velocity_options.h"
#include "nephele/levelset/flow/advection.h"
#include "nephele/levelset/flow/advection_files.h"
#include "nephele/modeling/field/operations.h"

namespace nephele::apps {

VdbGrid CloudAdvectionArguments::carried(const VdbGrid& density, FieldSources& sources, int seed,
                                         Run& run) const {
  const double longestSide = sources.longestSide();
  const Amount most = strength.largest(longestSide);
  if (most.value == 0) return density;
  const ScalarField share =
      sources.field(strength) / float(most.inWorldUnits(strength.quantity.unit, longestSide));
  run.begin("advect");
  VelocityArguments velocity;
  velocity.amplitude = {most.value / steps, most.isRelative};
  velocity.frequency = frequency;
  velocity.octaves = 4;
  velocity.roughness = 0.6;
  velocity.seed = seed;
  const AdvectionOptions options{.method = AdvectionMethod::gridless, .steps = steps};
  const CarriedGrids grids = carriedGrids({density});
  if (grids.box.isEmpty()) return density;
  run.requireMemory(estimatedAdvectionBytes(grids.bricks, options),
                    "use larger voxels (a lower --resolution or a larger --voxel-size)");
  return toVdb(grids, advectGrids(grids.bricks, velocity.field(longestSide) * share, options, run).grids)
      .front();
}

void addCloudAdvectionOptions(CLI::App& app, CloudAdvectionArguments& a) {
  addFieldValue(
      app, "--advect", a.strength,
      "Way by which noise carries the finished density: ragged edges and wisps; see nephele advect.");
  addFrequency(app, "--advect-frequency", a.frequency, "Frequency of that noise.");
  addCount(app, "--advect-steps", a.steps, 1, 1000, "Steps in which it goes; fewer fold and tear more.");
}

}  // namespace nephele::apps

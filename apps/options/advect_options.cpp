#include "apps/options/advect_options.h"

#include <fmt/format.h>

namespace nephele::apps {

AdvectionOptions AdvectArguments::resolved() const {
  AdvectionOptions result = advection;
  if (result.method != AdvectionMethod::selma) refuseGiven(ofMap, "is for --method selma alone");
  if (result.method != AdvectionMethod::grid) refuseGiven({ofGrid}, "is for --method grid alone");
  result.steps = steps;
  result.dt = float(dt);
  result.mapCoarseness = float(mapCoarseness);
  result.rebakeShare = rebake * 0.01;
  // A map that is kept must lead back to the grids of the input.
  if (!map.empty() || !continueFrom.empty()) result.rebakeShare.reset();
  return result;
}

void addAdvectOptions(CLI::App& app, AdvectArguments& a) {
  using Method = AdvectionMethod;
  app.add_option("input", a.input, "Volume whose grids are carried along (.vdb, .nvdb).")
      ->required()
      ->type_name("FILE");
  addOutput(app, "-o,--output", a.output, {".vdb"}, "Volume to write, with all grids of the input.")
      ->required();
  app.add_option_function<std::string>(
         "--velocity", [&a](const std::string& text) { parseVelocity("--velocity", text, a.velocity); },
         "What moves: noise or curl (noise without divergence) with keys amplitude, frequency, octaves, "
         "lacunarity, roughness, seed, kind, time; one vector for all, in world units or percent of the "
         "longest "
         "side per unit of time; or a grid of vectors from a volume.")
      ->required()
      ->type_name("X,Y,Z|noise:KEYS|curl:KEYS|FILE");
  app.add_option("--velocity-grid", a.velocity.grid,
                 "Grid of the velocity file; default: v, vel, velocity, or the only one of vectors.")
      ->type_name("NAME");
  addCount(app, "--steps", a.steps, 0, 1000000, "Steps to make.");
  addNumber(app, "--dt", a.dt, -1e6, 1e6, "Time of a step; below 0: backwards.");
  addChoice<Method>(
      app, "--method", a.advection.method,
      {{"selma", Method::selma}, {"gridless", Method::gridless}, {"grid", Method::grid}},
      "Carry a map and read the input through it; trace every voxel through all steps; or carry "
      "the values themselves.");
  a.ofGrid = addChoice<GridScheme>(
      app, "--scheme", a.advection.scheme,
      {{"maccormack", GridScheme::macCormack}, {"bfecc", GridScheme::bfecc}, {"plain", GridScheme::plain}},
      "How --method grid makes a step.");
  auto* map = addOutput(app, "--map", a.map, {".vdb"},
                        "Also write the map: 'displacement', to go on from, and 'rest', for textures.");
  auto* from = app.add_option("--continue-from", a.continueFrom,
                              "Go on from a map that --map wrote for the same input.")
                   ->type_name("FILE");
  auto* coarseness = addCount(app, "--map-coarseness", a.mapCoarseness, 1, 64,
                              "Voxel of the map, in voxels of the finest grid.")
                         ->excludes(from);
  auto* rebake =
      addNumber(
          app, "--rebake", a.rebake, 0, 100,
          "Percent of the map that may fold before the values are baked and a new map starts; 100: never.")
          ->excludes(map)
          ->excludes(from);
  a.ofMap = {map, from, coarseness, rebake};
}

}  // namespace nephele::apps

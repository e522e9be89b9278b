#include "apps/options/shape_options.h"

#include <fmt/format.h>

#include "apps/options/mesh_options.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/mesh/marching_cubes.h"

namespace nephele::apps {

Mesh ShapeArguments::shape(const std::function<double(double)>& voxelSize, Run& run) const {
  combine.refuseFor(inputs.size());
  if (inputs.empty() && !species)
    throw CLI::ValidationError("input", "give a mesh or a level set to grow a cloud on, or --species");
  Mesh mesh;
  if (species) {
    run.begin("shape");
    mesh = cloudShapeMesh({.species = *species, .seed = std::uint32_t(seed), .size = float(size)}, run);
  } else if (inputs.size() > 1) {
    const Solids solids(inputs, repair, subdivide, run);
    const double longestSide = run.longestSide(solids.box());
    const auto combined = [&](double voxel) {
      return marchingCubes(*toBricks(solids.combined(combine, {.voxelSize = voxel}, longestSide, run)), 0.0f,
                           run);
    };
    // Voxels are those of the cloud, whose size may follow from what is left of the inputs: less than they
    // are.
    const Box most = solids.boxOf(combine.combination);
    const double voxel = voxelSize(run.longestSide(most.isEmpty() ? solids.box() : most));
    mesh = combined(voxel);
    constexpr double kFiner = 0.99;
    if (const double own = voxelSize(run.longestSide(boundingBox(mesh))); own < kFiner * voxel)
      mesh = combined(own);
  } else {
    run.begin("read");
    RepairedMesh read = readShape(inputs[0], repair, run);
    for (const std::string& note : read.repairs) run.note(note);
    mesh = subdividedAsAsked(std::move(read.mesh), subdivide, run);
  }
  if (!meshOutput.empty()) {
    writeMesh(meshOutput, mesh);
    run.result(fmt::format("{}: the shape, {} faces", meshOutput, mesh.faceCount()));
  }
  return mesh;
}

void addShapeOptions(CLI::App& app, ShapeArguments& a) {
  auto* input =
      app.add_option("input", a.inputs,
                     "Mesh, or level set (.vdb, .nvdb), to grow a cloud on; or several, see --combine.")
          ->type_name("FILE");
  std::vector<std::pair<std::string, std::optional<CloudSpecies>>> choices;
  for (const CloudSpecies species : cloudSpecies())
    choices.emplace_back(std::string(speciesName(species)), species);
  auto* species = addChoice<std::optional<CloudSpecies>>(
                      app, "--species", a.species, choices,
                      "Grow the cloud on a shape of this species of cumulus, without an input.")
                      ->excludes(input);
  addCount(app, "--shape-seed", a.seed, 0, 1 << 30, "Another seed is another shape of the species.")
      ->needs(species);
  addNumber(app, "--shape-size", a.size, 1e-6, 1e9, "Longest side of the shape, world units.")
      ->needs(species);
  addOutput(app, "--shape-mesh", a.meshOutput, {".obj", ".ply", ".stl"},
            "Also write what the cloud grows on, before any layer.");
  addCombineOptions(app, a.combine);
  addRepair(app, a.repair.mode);
  addSubdivide(app, a.subdivide)->excludes(species);
}

}  // namespace nephele::apps

#include "apps/options/mesh_options.h"

#include <fmt/format.h>

#include <limits>

#include "nephele/levelset/mesh/decimation.h"
#include "nephele/levelset/mesh/smoothing.h"
#include "nephele/levelset/mesh/subdivision.h"

namespace nephele::apps {
namespace {

Mesh decimatedAsAsked(const Mesh& mesh, const MeshProcessing& asked, const std::string& name, Run& run) {
  DecimationOptions options;
  if (asked.faces > 0) options.faces = std::size_t(asked.faces);
  if (asked.maxError.value > 0)
    options.maxError = asked.maxError.worldUnits(run.longestSide(boundingBox(mesh)));
  const std::size_t before = triangulated(mesh).faceCount();
  if (options.faces && before <= *options.faces) {
    run.note(fmt::format("{}: has {} triangles, no more than --faces {}: nothing is left out", name, before,
                         *options.faces));
    return mesh;
  }
  // Measured: the mesh, its half-edges, quadrics and the tree that finds nearest points.
  constexpr double kTriangle = 700;
  run.requireMemory(kTriangle * double(before), "start from fewer faces");
  DecimatedMesh result = decimate(mesh, options, run);
  const std::size_t after = result.mesh.faceCount();
  if (options.faces && after > *options.faces) {
    if (!options.maxError)
      throw Error(fmt::format(
          "{}: cannot have {} faces: with fewer than {} it would not stay closed, unfolded and whole at its "
          "seams; ask for --faces {} or more",
          name, *options.faces, after, after));
    run.note(fmt::format("{}: {} faces instead of {}: fewer would move the surface by more than {:g}", name,
                         after, *options.faces, *options.maxError));
  }
  run.stats["decimation"] = {{"faces_before", before}, {"faces_after", after}, {"error", result.error}};
  run.note(fmt::format("{} of {} triangles left, {:g} from the surface before at most", after, before,
                       result.error));
  return std::move(result.mesh);
}

}  // namespace

CLI::Option* addSubdivide(CLI::App& app, int& times) {
  return addCount(app, "--subdivide", times, 0, 12,
                  "Split every triangle in four this often and round the mesh (Loop): for coarse cages.");
}

Mesh subdividedAsAsked(Mesh mesh, int times, Run& run) {
  if (times == 0) return mesh;
  run.requireMemory(estimateSubdivisionBytes(mesh, times), "use a lower --subdivide");
  return subdivided(mesh, times, run);
}

Mesh MeshProcessing::processed(Mesh mesh, const std::string& name, Run& run) const {
  mesh = subdividedAsAsked(std::move(mesh), subdivide, run);
  if (smooth > 0) mesh = smoothed(mesh, {.rounds = smooth}, run);
  return faces > 0 || maxError.value > 0 ? decimatedAsAsked(mesh, *this, name, run) : mesh;
}

void addMeshProcessing(CLI::App& app, MeshProcessing& processing) {
  addSubdivide(app, processing.subdivide);
  addCount(app, "--smooth", processing.smooth, 0, 100000,
           "Rounds of smoothing, which take small bumps and keep the volume.");
  addCount(app, "--faces", processing.faces, 1, std::numeric_limits<int>::max(),
           "Leave out triangles, those first that move the surface least, until so many are left.")
      ->default_str("all");
  addLength(app, "--max-error", processing.maxError,
            "Leave out triangles as long as the surface moves by no more than this.", Sign::positive)
      ->default_str("off");
}

}  // namespace nephele::apps

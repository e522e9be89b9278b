#include <fmt/format.h>

#include <algorithm>

#include "apps/options/transform_options.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/moved.h"
#include "nephele/levelset/io/vdb_io.h"

namespace nephele::apps {
namespace {

void moveMesh(const TransformOptions& options, Run& run) {
  const Mesh result = namingFile(options.input, [&] {
    Mesh turned = moved(readMesh(options.input), options.turn());
    const Similarity shift = options.shift(run.box(boundingBox(turned)));
    return moved(std::move(turned), shift);
  });
  run.begin("write");
  writeMesh(options.output, result);
}

std::vector<VdbGrid> turnedGrids(const TransformOptions& options) {
  std::vector<VdbGrid> grids = readVdbFile(options.input);
  namingFile(options.input, [&] {
    requireWritable(grids);
    for (VdbGrid& grid : grids) grid = moved(grid, options.turn());
  });
  return grids;
}

// Farther off, doubles no longer tell the size of a voxel to a thousandth.
void requireNear(const VdbGrid& grid, const Box& box, const Similarity& shift) {
  constexpr double kMostVoxels = 1e12;
  const double distance = length((box.isEmpty() ? Vec3d{} : Vec3d(box.center())) + shift.shift);
  const VdbGridInfo info = describe(grid);
  const double voxel = double(std::min({info.voxelSize.x, info.voxelSize.y, info.voxelSize.z}));
  require(distance <= kMostVoxels * voxel,
          fmt::format("grid '{}' would be {:g} world units from the origin, too far for voxels of {:g}",
                      info.name, distance, voxel));
}

Box boxOf(const std::vector<VdbGrid>& grids) {
  Box box;
  for (const VdbGrid& grid : grids) box = box.including(contentBox(grid));
  return box;
}

void moveVolume(const TransformOptions& options, Run& run) {
  std::vector<VdbGrid> grids = turnedGrids(options);
  const Box box = run.box(boxOf(grids));
  namingFile(options.input, [&] {
    const Similarity shift = options.shift(box);
    for (VdbGrid& grid : grids) {
      requireNear(grid, box, shift);
      grid = moved(grid, shift);
    }
  });
  run.begin("write");
  writeVdbFile(options.output, grids, run.metadata());
}

Extent extentOfTurned(const TransformOptions& options, Run&) {
  const Box box = isVolumeFile(options.input) ? boxOf(turnedGrids(options))
                                              : boundingBox(moved(readMesh(options.input), options.turn()));
  return {box, double(box.longestSide())};
}

void transform(const TransformOptions& options, Run& run) {
  const bool isVolume = isVolumeFile(options.input);
  if (isVolume != isVolumeFile(options.output))
    throw CLI::ValidationError("--output", isVolume ? "a volume becomes a .vdb" : "a mesh becomes a mesh");
  run.begin("read");
  isVolume ? moveVolume(options, run) : moveMesh(options, run);
  run.result(options.output);
}

}  // namespace

Verb transformVerb() {
  return verbOf("transform", "Moves, turns and scales a mesh or a volume; changes its up axis or unit.",
                "nephele transform examples/hare.obj -o hare.obj --to-up-axis z --to-unit mm --place ground",
                addTransformOptions, transform, {}, extentOfTurned);
}

}  // namespace nephele::apps

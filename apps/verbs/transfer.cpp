#include <fmt/format.h>

#include <memory>

#include "apps/app.h"
#include "apps/options/mesh_options.h"
#include "apps/options/transfer_options.h"
#include "apps/verbs/detail/transfer_report.h"
#include "nephele/levelset/flow/advection_files.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/levelset/warp/warp_grid.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/image/png_io.h"

namespace nephele::apps {
namespace {

/// The map in space, which grids of the distances make fast enough for millions of voxels.
void writeWarp(const TransferArguments& arguments, const Mesh& reference, const Mesh& object, Run& run) {
  if (arguments.warpFile.empty() && arguments.warpedMesh.empty()) return;
  const Box box = boundingBox(object);
  const double voxelSize = run.longestSide(box) / arguments.resolution;
  run.requireMemory(WarpBricks::estimateBytes(box, voxelSize), "use a lower --resolution");
  MeshWarpOptions options = arguments.warp;
  options.quality = WarpQuality::fast;
  // Grids would have to reach from one shape to the other; where that is far, distances stay exact.
  const Box target = boundingBox(reference);
  options.gridded =
      options.align != Alignment::none || target.including(box).longestSide() < 3 * target.longestSide();
  const MeshWarp warp = arguments.warped(reference, object, options, run);
  run.begin("warp grid");
  // In units of the object again.
  const WarpBricks bricks(float(1 / warp.alignment.scale) * warp.object, box, {.voxelSize = voxelSize});
  if (!arguments.warpFile.empty())
    writeVdbFile(arguments.warpFile, {toVdb(bricks.sample(warp.map, run), {.name = "rest"})}, run.metadata());
  if (arguments.warpedMesh.empty()) return;
  run.begin("warped mesh");
  const Mesh mesh = marchingCubes(*bricks.sample(compose(warp.reference, warp.map), run), 0.0f, run);
  if (mesh.faceCount() == 0)
    throw Error(arguments.warpedMesh + ": no surface: the reference does not reach the object");
  writeMesh(arguments.warpedMesh, mesh);
}

void transfer(const TransferArguments& arguments, Run& run) {
  arguments.requireMethod();
  run.begin("read");
  const Mesh reference = readShape(arguments.from, run);
  const Mesh object = subdividedAsAsked(readShape(arguments.to, run), arguments.subdivide, run);
  const TransferOptions options = arguments.chosen(reference, object, run);
  const auto texture = arguments.texture.empty()
                           ? nullptr
                           : std::make_shared<const Image>(readLinearImage(
                                 arguments.texture, arguments.textureEncoding, run.memoryLimitBytes));
  const TextureBakeOptions bakeOptions = texture ? arguments.bakeOptions(*texture) : TextureBakeOptions{};
  arguments.requirePictureMemory(bakeOptions, run);

  const MeshWarp warp = arguments.warped(reference, object, arguments.warp, run);
  const Mesh result = namingFile(fmt::format("{} to {}", arguments.from, arguments.to), [&] {
    return options.names.empty() ? object : transferAttributes(reference, object, warp.images, options, run);
  });
  run.begin("measure");
  const TransferQuality quality = transferQuality(reference, object, warp.images, run);

  writeWarp(arguments, reference, object, run);
  std::shared_ptr<const Image> baked;
  if (!arguments.bakedTexture.empty()) {
    const BakedTexture bake = bakeTexture(reference, *texture, object, warp.images, bakeOptions, run);
    run.stats["texels_covered"] = bake.covered;
    baked = std::make_shared<const Image>(bake.image);
    arguments.writeBaked(*baked, run);
  }
  if (!arguments.preview.empty())
    writePng(arguments.preview,
             arguments.paintsDistortion
                 ? pictureDistortion(reference, object, quality, arguments.picture, run)
                 : pictureTransfer(reference, result, texture, baked, arguments.picture, run),
             {}, run.metadata());
  run.begin("write");
  if (!arguments.output.empty()) writeMesh(arguments.output, result);
  reportTransfer(arguments.name(), warp, quality, run);
}

}  // namespace

Verb transferVerb() {
  return verbOf("transfer", "Carries texture coordinates and other attributes from one mesh to another.",
                "nephele transfer --from examples/clownfish.obj --to examples/whale.obj -o whale_uv.obj "
                "--preview whale.png",
                addTransferOptions, transfer, {},
                [](const TransferArguments& arguments, Run&) { return extentOfFile(arguments.to); });
}

}  // namespace nephele::apps

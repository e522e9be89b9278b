// Both ways sample the given field near its zero surface first. Sweeping solves |grad| = 1 outward from there
// on the same grid (OpenVDB's fast sweeping), with first-order error; rebuilding meshes the surface and
// measures distances to the triangles, exact at several times the cost.
#include "nephele/levelset/cloud/renormalise.h"

#include <openvdb/tools/FastSweeping.h>

#include <algorithm>
#include <cmath>

#include "nephele/levelset/grid/openvdb_bridge.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/levelset/mesh/mesh_distance.h"

namespace nephele {

namespace {

constexpr float kHalfWidthVoxels = 3;

std::shared_ptr<BrickGrid> nearSurface(const ScalarField& level, BakeOptions spec, const Progress& progress) {
  spec.band = {-kHalfWidthVoxels * spec.voxelSize, kHalfWidthVoxels * spec.voxelSize};
  spec.background = spec.band.min;
  return bakeGrid(level, spec, progress);
}

}  // namespace

ScalarField sweptDistance(const ScalarField& level, const BakeOptions& spec, const DistanceBand& band,
                          const Progress& progress) {
  const auto near = nearSurface(level, spec, progress);
  // In voxels: the sweep takes what is below a bound of its own for zero.
  detail::TreeValues values = detail::TreeValues::levelSet(*near, "surface");
  for (float* value : {&values.sign, &values.low, &values.high, &values.background}) *value /= spec.voxelSize;
  const auto source = detail::toOpenVdb(*near, values, "surface");
  const openvdb::math::Transform::Ptr inWorld = source->transformPtr();
  source->setTransform(detail::uniformTransform(1));
  source->setGridClass(openvdb::GRID_LEVEL_SET);
  const float width = std::max(band.exterior, band.interior) / spec.voxelSize - kHalfWidthVoxels;
  const auto distance =
      openvdb::tools::dilateSdf(*openvdb::tools::sdfToSdf(*source), std::max(1, int(std::ceil(width))));
  progress.check();
  distance->setTransform(inWorld);
  return gridField(detail::bricksOf(*distance, -spec.voxelSize), Interpolation::tricubic);
}

ScalarField rebuiltDistance(const ScalarField& level, const BakeOptions& spec, const DistanceBand& band,
                            const Progress& progress) {
  const Mesh mesh = marchingCubes(*nearSurface(level, spec, progress), 0.0f, progress);
  return meshDistance(
      mesh, {.voxelSize = spec.voxelSize, .exteriorBand = band.exterior, .interiorBand = band.interior},
      progress);
}

}  // namespace nephele

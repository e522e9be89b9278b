#pragma once

#include <optional>

#include "nephele/levelset/grid/voxel_grid.h"
#include "nephele/levelset/mesh/surface_geometry.h"
#include "nephele/modeling/base/progress.h"

namespace nephele::detail {

/// Where a signed distance is wanted: up to these distances from the surface, in voxels, >= 1.
struct BandOptions {
  double voxelSize = 0.0;
  double exteriorVoxels = 3.0;
  double interiorVoxels = 3.0;

  float outsideValue() const { return -float(exteriorVoxels * voxelSize); }
  float insideValue() const { return float(interiorVoxels * voxelSize); }
};

/// Exact signed distance to `surface` in a band, clamped to it, positive inside, or nothing if the surface is
/// not closed or its sheets overlap, so that the nearest one does not tell inside from outside.
/// @throws Error if the grid would be too large to index; Cancelled.
std::optional<VoxelGrid<float>> signedBand(const SurfaceGeometry& surface, const BandOptions& options,
                                           const Progress& progress);

/// Signed distance by OpenVDB's meshToVolume, which floods from the outside: slow, and robust where sheets of
/// the mesh overlap. @throws Error; Cancelled.
VoxelGrid<float> floodedBand(const Mesh& mesh, const BandOptions& options, const Progress& progress);

}  // namespace nephele::detail

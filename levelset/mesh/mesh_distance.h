#pragma once

#include "nephele/modeling/base/mesh.h"
#include "nephele/modeling/base/progress.h"
#include "nephele/modeling/field/field.h"

namespace nephele {

struct MeshDistanceOptions {
  /// Finest voxel, world units: used within a few voxels of the surface.
  double voxelSize = 0.0;
  /// World units outside (inside) the surface up to which the distance must hold, at most 10^6 voxels.
  /// Inside, no more than the width of the mesh is used.
  double exteriorBand = 0.0;
  double interiorBand = 0.0;
};

/// Signed distance to a closed mesh as a field, positive inside, world units.
///
/// Fine bricks near the surface and coarser levels behind them, each twice the voxel size of the one before,
/// within 0.05 fine voxels of the exact distance to smooth shapes away from the medial axis, and within 0.3
/// beside the edges of others, where distances curve at once. Beyond the bands: the constant at
/// its edge. Memory follows the surface, not the width of the band.
/// @throws Error for an empty mesh, polygons or positions that are not finite, voxels that are not > 0, bands
/// that are not > 0 or too wide; Cancelled.
ScalarField meshDistance(const Mesh& mesh, const MeshDistanceOptions& options,
                         const Progress& progress = silent());

}  // namespace nephele

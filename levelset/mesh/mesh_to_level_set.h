#pragma once

#include "nephele/levelset/grid/voxel_grid.h"
#include "nephele/modeling/base/mesh.h"
#include "nephele/modeling/base/progress.h"

namespace nephele {

struct MeshToLevelSetOptions {
  /// World units, > 0.
  double voxelSize = 0.0;
  /// Band in voxels on either side of the surface, >= 1.
  double halfWidthVoxels = 3.0;
  /// Share of the mesh's volume by which that of the level set, or of the surface that marching cubes would
  /// make of it, may be off; 1: anything may come. From a hundredth on there is a note.
  double mostVolumeError = 0.1;
};

/// Signed distance to a closed, outward-oriented triangle mesh in a narrow band, positive inside.
/// Exact to float rounding where the sheets of the mesh do not overlap; else OpenVDB's union of them, with a
/// note.
/// @throws Error if the mesh is not closed or encloses nothing, as one inside out, or if the volume differs
/// from the mesh's by more than is allowed, naming both and a voxel size to try; Cancelled.
VoxelGrid<float> meshToLevelSet(const Mesh& mesh, const MeshToLevelSetOptions& options,
                                const Progress& progress = silent());

/// Memory that `meshToLevelSet` will need at its peak, estimated from the area of the mesh: within a factor
/// of two.
double estimateLevelSetBytes(const Mesh& mesh, const MeshToLevelSetOptions& options);

/// Volume enclosed by the zero surface of a level set, world units cubed; its values must be distances near
/// the surface, or grow in proportion to them. Second order in the size of voxels.
double enclosedVolume(const VoxelGrid<float>& levelSet);

}  // namespace nephele

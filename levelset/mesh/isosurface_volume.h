#pragma once

#include <optional>

#include "nephele/levelset/grid/voxel_grid.h"

namespace nephele::detail {

/// Volume that the marching cubes mesh of a level set encloses, world units cubed, without making the mesh.
/// Cost: one pass over the samples. All cores; the same at any number of threads.
double isosurfaceVolume(const VoxelGrid<float>& levelSet);

/// Where a level set is thinnest for its voxels.
struct ThinPlace {
  Vec3d position;
  /// In voxels.
  double thickness;
};

/// The middle of the brick that holds most walls of less than one and a half voxels: samples near the surface
/// around which distance rises nowhere. Nothing if there are none.
std::optional<ThinPlace> thinPlace(const VoxelGrid<float>& levelSet);

}  // namespace nephele::detail

#pragma once

#include "levelset/cumulo_grids.h"
#include "levelset/vdb_io.h"

namespace nephele {

struct CloudDensityOptions {
  /// World units, > 0. Voxel centres lie at integer multiples of it.
  float voxelSize = 0.0f;
  /// Width in world units, > 0, over which the density rises from 0 to 1, half of it to either side of the
  /// surface.
  float edgeThickness = 0.0f;
  bool halfFloat = false;
};

/// The cloud as fog: grid `density`, class fog volume, background 0.
///
/// The value is smoothstep(-edge / 2, edge / 2, l): 1 inside, 0 outside, 1/2 on the surface. l is not a
/// distance but grows faster than one, so the edge is as thick as stated or thinner, at any voxel size. Inner
/// bricks are tiles. Cost grows with the bricks that the edge crosses. All cores; the same bits at any thread
/// count.
/// @throws Error if a length is not > 0; Cancelled.
VdbGrid cloudDensity(const GriddedCumulo& cloud, const CloudDensityOptions& options,
                     const Progress& progress = silent());

/// The displaced level set: grid `surface`, class level set, negative inside as files are, 3 voxels to either
/// side.
///
/// Its values are -l where |l| < 3 voxels. The zero surface is exact; away from it |l| grows faster than the
/// distance (1.2 to 1.8 times), as l is a sum of displacements and not a distance.
/// @throws Error if voxelSize is not > 0; Cancelled.
VdbGrid cloudSurface(const GriddedCumulo& cloud, float voxelSize, bool halfFloat,
                     const Progress& progress = silent());

}  // namespace nephele

#pragma once

#include <optional>
#include <vector>

#include "nephele/levelset/cloud/layers_on_grids.h"
#include "nephele/levelset/grid/narrow_band.h"
#include "nephele/levelset/grid/voxel_grid.h"

namespace nephele {

struct CloudDensityOptions {
  /// World units, > 0. Voxel centres lie at integer multiples of it.
  float voxelSize = 0.0f;
  /// Width in world units, > 0 and bounded, over which the density rises from 0 to 1, half of it to either
  /// side of the surface.
  ScalarField edgeThickness{0.0f};
  /// How the density rises over the edge: t^edgeExponent, t from 0 to 1 over its width; 1 is linear, more is
  /// a thinner rim. > 0. Empty: t t (3 - 2 t).
  std::optional<float> edgeExponent{};
  /// Multiplies the density; nowhere negative. See modeling/cloud/density_profile.h.
  ScalarField factor{1.0f};
};

/// The cloud as fog: densities, 0 outside.
///
/// The value is smoothstep(-edge / 2, edge / 2, l): 1 inside, 0 outside, 1/2 on the surface; or the power of
/// t that the options ask for; times the factor. l is not a distance but grows faster than one, so the edge
/// is as thick as stated or thinner, at any voxel size; an edge thicker than 6 voxels needs
/// CumuloGridOptions::edge. Inner bricks are constant where the factor's range is a single value. Cost grows
/// with the bricks that the edge crosses and those in which the factor varies. All cores; the same bits at
/// any thread count.
/// @throws Error if a length or the exponent is not > 0, or the factor can be negative; Cancelled.
VoxelGrid<float> cloudDensity(const GriddedCumulo& cloud, const CloudDensityOptions& options,
                              const Progress& progress = silent());

/// Voxels to either side of the surface in which `cloudSurface` has values.
inline constexpr float kCloudSurfaceVoxels = 3;

/// The displaced level set, positive inside, 3 voxels to either side.
///
/// Its values are l where |l| < 3 voxels. The zero surface is exact; away from it |l| grows faster than the
/// distance (1.2 to 1.8 times), as l is a sum of displacements and not a distance.
/// @throws Error if voxelSize is not > 0; Cancelled.
VoxelGrid<float> cloudSurface(const GriddedCumulo& cloud, float voxelSize,
                              const Progress& progress = silent());

/// The displaced level set at the voxels of a cloud: all that the density of these voxels needs of the
/// layers.
struct CloudLevels {
  /// l within the half width, which it is beyond: positive inside.
  NarrowBand levels;
  /// The estimate of l (see GriddedCumulo) where it is off by more than it says; 0 elsewhere.
  VoxelGrid<float> estimates;
  float halfWidth = 0, estimateError = 0;
  Box box{};
  std::vector<CumuloLayerReport> layers{};
};

/// Samples a cloud once, for densities whose edges are no thicker than twice `halfWidth` (world units, > 0).
/// Cost as `cloudSurface`, which is what it makes for 3 voxels. @throws Error unless both are > 0; Cancelled.
CloudLevels cloudLevels(const GriddedCumulo& cloud, float voxelSize, float halfWidth,
                        const Progress& progress = silent());

/// The same, bit for bit, as of the cloud that was sampled. Cost: some nanoseconds for each voxel of the
/// bricks at the surface, and what the factor costs. @throws Error also if the voxels are others or the edge
/// is thicker than the levels reach.
VoxelGrid<float> cloudDensity(const CloudLevels& cloud, const CloudDensityOptions& options,
                              const Progress& progress = silent());
VoxelGrid<float> cloudSurface(const CloudLevels& cloud, const Progress& progress = silent());

}  // namespace nephele

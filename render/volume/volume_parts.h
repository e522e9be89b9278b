#pragma once

#include <array>
#include <memory>
#include <vector>

#include "nephele/modeling/base/progress.h"
#include "nephele/render/scene/camera_motion.h"
#include "nephele/render/volume/render_volume.h"

namespace nephele {

/// One of the volumes of a picture: grids of any voxel size and affine map, rotated ones included, that need
/// have nothing in common. What a grid does not cover is its background.
struct VolumePart {
  using Grids = std::array<std::shared_ptr<const BrickGrid>, 3>;

  /// Values below zero count as zero. May be missing where there is something that glows.
  std::shared_ptr<const BrickGrid> density;
  /// Where the samples of the density were given back while it was read; then it must be the only part, as it
  /// is.
  std::shared_ptr<CodedDensity> coded;
  /// Multiplies the density, >= 0: its extinction relative to that of the Medium.
  float share = 1.0f;
  /// Multiplies the medium's albedo, within [0, 1] per colour.
  Vec3f albedo{1, 1, 1};
  /// Multiplies it as well, place by place; clamped to [0, 1]. None: 1.
  Grids colour{};
  /// Light of its own, see VolumeColour, and what it is multiplied by.
  Grids emission{};
  float emissionScale = 1.0f;
  /// Glows as a black body: temperatureScale * value kelvin, in the units of blackBody; added to `emission`.
  std::shared_ptr<const BrickGrid> temperature;
  float temperatureScale = 2000.0f;
  /// World units per frame, and when the shutter is open, in frames from when the grids are right: what is
  /// seen is the mean over that time of all that stands at x - velocity(x) t. Velocities must be known as far
  /// as things move; the light is that of the blurred volume.
  /// Source: notes, Eulerian motion blur.
  Grids velocity{};
  Shutter shutter{};
};

/// @throws Error if the part has neither density nor emission, a share or scale is negative or not finite, an
/// albedo is outside [0, 1], a background of a density or emission is not 0, values are not finite,
/// temperatures exceed 100000 K, or a shutter closes before it opens.
void check(const VolumePart& part);

/// All parts as one volume: densities add up, each times its share, and so do emissions; colours mix by the
/// share that each part has of the density at a place.
///
/// The voxels are those of the part with the finest ones. Grids that stand on the same lattice keep their
/// values exactly; others are interpolated linearly, so that what is marched is what each would be by itself.
/// One part with nothing but a density is returned as it is. The order of the parts does not matter but for
/// the rounding of sums. All cores, the same bits at any number of threads.
/// Cost: some 20 ns per sample, grid and part, and as often as voxels are crossed while a shutter is open, up
/// to 64; memory as the finest voxels take over the union.
/// @throws Error if there is no part, `check` refuses one, or the union is too large to number its bricks;
/// Cancelled.
RenderVolume combine(const std::vector<VolumePart>& parts, const Progress& progress = silent());

/// Bytes that the result of `combine` takes, at most, beside the parts.
double estimateCombinedBytes(const std::vector<VolumePart>& parts);

}  // namespace nephele

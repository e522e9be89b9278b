#pragma once

#include <map>
#include <optional>
#include <vector>

#include "nephele/modeling/base/box.h"
#include "nephele/modeling/base/progress.h"
#include "nephele/modeling/field/field.h"
#include "nephele/render/scene/camera.h"
#include "nephele/render/scene/camera_motion.h"
#include "nephele/render/volume/render_volume.h"

namespace nephele {

/// How finely a field is looked at.
struct FieldVolumeOptions {
  /// Where there may be density, world units; outside there is none.
  Box box;
  /// Voxels across a pixel, at the place nearest to the camera where the picture, whole if there is a crop,
  /// shows density.
  float voxelsPerPixel = 1.0f;
  /// Bytes that the bricks may take; voxels grow until they fit.
  double mostBytes = 1e9;
  /// Voxels are of one of so many sizes while they double, the next smaller one, so that cameras from about
  /// as far away share them. 0: of any size.
  int sizesPerOctave = 0;
};

/// The voxel sizes of a field for one camera after another. Not for several threads at once.
class FieldResolution {
 public:
  /// Cost: ranges of the field over some 10^4 boxes. @throws Error as fieldVoxelSize; Cancelled.
  FieldResolution(const ScalarField& density, const FieldVolumeOptions& options,
                  const Progress& progress = silent());
  /// See fieldVoxelSize. Cost: some milliseconds, and as much as the constructor for a size that is new, to
  /// learn whether it fits into the memory. @throws Cancelled.
  float voxelSize(const Camera& camera, const Progress& progress = silent());

 private:
  bool fits(float voxelSize, const Progress& progress);

  ScalarField density_;
  FieldVolumeOptions options_;
  // Where there may be density.
  std::vector<Box> dense_;
  std::map<float, bool> fits_;
};

/// The voxel size of `fieldVolume`, world units: the width of a pixel there, over voxelsPerPixel, but no less
/// than a 10^5th of the box and as much more as the memory asks for. A 64th of the box where the picture
/// shows no density. Cost: ranges of the field over some 10^4 boxes, and more where the memory is short.
/// @throws Error if the box is empty or unbounded, or a number is not above 0.
float fieldVoxelSize(const ScalarField& density, const Camera& camera, const FieldVolumeOptions& options,
                     const Progress& progress = silent());

/// A density that is a field and not a grid, as finely as the picture of `camera` can show it: nobody has to
/// choose a voxel size. Ranges of the field tell where it is above zero, and only there it is evaluated;
/// values below zero count as zero. Come nearer, and there is more to see, as long as the memory lasts: a
/// camera inside the density gets what `mostBytes` allow.
///
/// Structure narrower than two voxels is sampled and not averaged. Moving cameras are asked for where the
/// shutter opens, is half open and closes. The same bits at any number of threads.
/// @throws Error as fieldVoxelSize and bakeGrid do; Cancelled.
RenderVolume fieldVolume(const ScalarField& density, const Camera& camera, const FieldVolumeOptions& options,
                         const Progress& progress = silent());

/// All that fields may say of a volume. Values below zero count as zero.
struct FieldParts {
  ScalarField density{0.0f};
  /// Where there may be anything.
  Box box;
  /// See VolumePart: its colour, its light, its temperature in kelvin, its velocity in world units per frame.
  std::optional<VectorField> colour{}, emission{}, velocity{};
  std::optional<ScalarField> temperature{};
  float emissionScale = 1.0f;
  /// Blurs what has a velocity.
  Shutter shutter{};
  /// Multiplies the density.
  float share = 1.0f;
};

/// All of it sampled with voxels of one size, world units; velocities as finely as a 128th of the box.
/// @throws Error as bakeGrid and combine do; Cancelled.
RenderVolume sampledVolume(const FieldParts& parts, float voxelSize, const Progress& progress = silent());

/// What rays ask the fields for: no grid is between them and the picture, and detail is as fine as the
/// picture asks for, see FieldDensity and Refinement. Values below zero count as zero; outside of the box
/// there is nothing.
///
/// A colour is asked for wherever the light is read, at most a voxel apart along a ray, and what glows at
/// most half of one. A velocity blurs the fields themselves, see FieldMotion: every sample is then the mean
/// of those on its way, half a voxel apart and at most 64.
///
/// Only the light is worked out on a grid, whose voxels of `voxelSize` (world units) hold the mean of 8
/// places in each: shadows, and what glows as it lights others, are as soft as that. Where nothing else is
/// known, `fieldVoxelSize` for some 2 pixels per voxel is a good choice. Pictures, deep ones and layers come
/// from the fields, normals and what falls on marched objects from the grid; paths see nothing but the
/// fields. Combined volumes take grids only. Cost: 8 evaluations per voxel and ranges of the voxels wherever
/// the density or the emission varies.
/// @throws Error as FieldDensity, bakeGrid and combine do, if a velocity is not finite, or if the grid finds
/// nothing of fields that may not be empty; Cancelled.
RenderVolume gridlessVolume(const FieldParts& parts, float voxelSize, const Progress& progress = silent());
/// The same of a density alone.
RenderVolume gridlessVolume(const ScalarField& density, const Box& box, float voxelSize,
                            const Progress& progress = silent());

}  // namespace nephele

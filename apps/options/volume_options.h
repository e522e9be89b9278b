#pragma once

#include <string>
#include <vector>

#include "apps/app.h"
#include "nephele/render/scene/camera_motion.h"
#include "nephele/render/volume/render_volume.h"

namespace nephele::apps {

/// What of the files given is looked at.
struct VolumeOptions {
  /// Names for every volume in turn, or one for all; "none" for no grid.
  std::vector<std::string> densityGrids, colourGrids, emissionGrids, temperatureGrids, velocityGrids;
  /// Likewise.
  std::vector<double> densityScales;
  double emissionScale = 1, temperatureScale = 2000;
  /// Frames per unit of time.
  double velocityScale = 1.0 / 24;
};

/// Declares the options on `app`.
void addVolumeOptions(CLI::App& app, VolumeOptions& options);

/// Reads the volumes of `paths` as they are marched, all as one, blurred while `shutter` is open.
/// @throws Error naming the path if a grid is missing, a level set, or larger than the memory allowed.
RenderVolume readVolumes(const std::vector<std::string>& paths, const VolumeOptions& options,
                         const Shutter& shutter, Run& run);

}  // namespace nephele::apps

#pragma once

#include <functional>
#include <memory>
#include <optional>
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
  /// An expression that multiplies the albedo, or "".
  std::string color;
  /// Likewise.
  std::vector<double> densityScales;
  double emissionScale = 1, temperatureScale = 2000;
  /// Frames per unit of time; a 24th if not given.
  std::optional<double> velocityScale;

  /// Whether anything but densities is looked at.
  bool hasOthers() const {
    return !(color.empty() && colourGrids.empty() && emissionGrids.empty() && temperatureGrids.empty() &&
             velocityGrids.empty());
  }
  double velocityFactor() const { return velocityScale.value_or(1.0 / 24); }
  /// The grids of so many files that are seen, "" where it is the first that holds numbers.
  /// @throws Error where names are neither one for all nor one for each.
  std::vector<std::string> seenGrids(std::size_t files) const;
};

/// Declares the options on `app`.
void addVolumeOptions(CLI::App& app, VolumeOptions& options);

/// Refuses options that choose grids or colours, where a script declares all of a volume.
/// @throws CLI::ValidationError naming the option.
void requireNoGrids(const VolumeOptions& options);

/// How volumes are read.
struct VolumeReading {
  /// Motion blurs them while it is open.
  Shutter shutter;
  /// Codes a density that stands alone while it is read, see CodedDensity.
  bool coded = false;
  /// Other things stand in the volumes: these keep their place, too thin to be seen, where their scale is 0.
  bool holdsObjects = false;
  /// What an expression finds.
  double time = 0;
  int seed = 0;
};

/// Reads the volumes of `paths` as they are marched, all as one.
/// @throws Error naming the path if a grid is missing, a level set, or larger than the memory allowed.
RenderVolume readVolumes(const std::vector<std::string>& paths, const VolumeOptions& options,
                         const VolumeReading& reading, Run& run);

/// The same of a density that `make` makes, telling of its bricks, as if a file held it and nothing else, as
/// 'density'. @throws Error for names of other grids.
RenderVolume volumeOf(const std::function<std::shared_ptr<const BrickGrid>(const BrickSink&)>& make,
                      const VolumeOptions& options, const VolumeReading& reading, Run& run);

}  // namespace nephele::apps

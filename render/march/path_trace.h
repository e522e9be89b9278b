#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "nephele/modeling/base/progress.h"
#include "nephele/render/march/raymarch.h"
#include "nephele/render/scene/camera_motion.h"
#include "nephele/render/scene/lights.h"
#include "nephele/render/scene/medium.h"
#include "nephele/render/volume/render_volume.h"

namespace nephele {

/// How a picture is path traced.
struct PathOptions {
  /// Paths per pixel, 1 to 2^20. Noise falls with their square root.
  int samplesPerPixel = 64;
  /// Paths end at this scattering; 0: never, but for Russian roulette where little light is left. 1 is single
  /// scattering.
  int maxScatterings = 0;
  /// Chooses the random numbers.
  std::uint64_t seed = 0;
  /// Paths firstSample .. firstSample + samplesPerPixel - 1 of every pixel are traced, so that a picture can
  /// go on where another one of the same seed ended: the picture of N paths is the mean of the first N.
  std::uint64_t firstSample = 0;
  /// As RenderOptions::aovs. All but the light and the transmittance are the marcher's.
  std::vector<std::string> aovs{"Z"};
  /// As RenderOptions::shutter and RenderOptions::volumeMotion.
  Shutter shutter{};
  std::optional<RigidMotion> volumeMotion{};
  /// As RenderOptions::nextCamera.
  std::optional<Camera> nextCamera{};
};

/// The same picture as renderImage with all scattering, without bias and with noise: what the marcher and its
/// octaves are judged against.
///
/// Free paths by delta tracking, light from the suns at every scattering by ratio tracking, the sky where a
/// scattered path leaves. The density is the marcher's, interpolated linearly; alpha is the share of paths
/// that meet anything. Channels as renderImage's. `rays` counts paths, `samples` scatterings. The same at any
/// number of threads. Cost: some 0.3 microseconds per scattering and sun.
/// @throws Error if an option is outside its range or a layer is unknown.
RenderResult pathTraceImage(const RenderVolume& volume, const Medium& medium, const Lights& lights,
                            const Camera& camera, const PathOptions& options = {},
                            const Progress& progress = silent());

}  // namespace nephele

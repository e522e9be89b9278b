#pragma once

#include <cstdint>
#include <memory>

#include "nephele/modeling/base/progress.h"
#include "nephele/render/march/integrator.h"
#include "nephele/render/march/render_options.h"
#include "nephele/render/scene/camera.h"
#include "nephele/render/scene/lights.h"
#include "nephele/render/scene/medium.h"
#include "nephele/render/volume/render_volume.h"

namespace nephele {

/// How a picture is path traced. Octaves and steps have no meaning here; `seed` chooses the random numbers.
struct PathOptions : FrameOptions {
  /// Paths per pixel, 1 to 2^20. Noise falls with their square root.
  int samplesPerPixel = 64;
  /// Paths end at this scattering; 0: never, but for Russian roulette where little light is left. 1 is single
  /// scattering.
  int maxScatterings = 0;
  /// Paths firstSample .. firstSample + samplesPerPixel - 1 of every pixel are traced, so that a picture can
  /// go on where another one of the same seed ended: the picture of N paths is the mean of the first N.
  std::uint64_t firstSample = 0;
  /// Whether light that objects scatter goes on, into the volume and to each other, and they stand in the way
  /// of all light. If not, they are what the marcher makes of them, for comparison: they are lit by what
  /// comes straight from suns, points, spots and the sky through the volume, cast shadows of all these but
  /// the sky into it, and scatter nothing into it. Where paths may scatter once only, both differ by the sky
  /// alone.
  bool objectsScatter = true;
};

/// The same picture as renderImage with all scattering, without bias and with noise: what the marcher is
/// judged against.
///
/// Free paths by delta tracking, light from the suns at every scattering by ratio tracking, the sky where a
/// scattered path leaves. The density is the marcher's, interpolated linearly; alpha is the share of paths
/// that meet anything. Channels as renderImage's. `rays` counts paths, `samples` scatterings. The same at any
/// number of threads. Cost: some 0.3 microseconds per scattering and sun.
/// @throws Error if an option is outside its range or a layer is unknown.
RenderResult pathTraceImage(const RenderVolume& volume, const Medium& medium, const Lights& lights,
                            const Camera& camera, const PathOptions& options = {},
                            const Progress& progress = silent());

/// Bytes that the samples of a deep picture may hold: as many as there are paths, but for what the tolerance
/// puts together. 0 for flat ones.
double estimatePathBytes(const Camera& camera, const PathOptions& options);

/// What follows the paths of such a picture, for nephele::render. @throws Error if an option is outside its
/// range.
std::unique_ptr<Integrator> pathIntegrator(const PathOptions& options);

}  // namespace nephele

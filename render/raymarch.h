#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "modeling/progress.h"
#include "render/camera.h"
#include "render/image.h"
#include "render/lights.h"
#include "render/medium.h"
#include "render/render_volume.h"

namespace nephele {

/// How a picture is made.
struct RenderOptions {
  Octaves octaves;
  /// Longest step in world units; default: one voxel, four where the density hardly varies. Where a voxel is
  /// nearly opaque steps are shorter by themselves, and where a pixel is wider than a step, steps grow with
  /// it. Opacity does not depend on it.
  std::optional<float> step;
  /// Rays per pixel. One goes through the centre; more are spread over a tent two pixels wide.
  int samples = 4;
  /// Moves the pattern of the samples.
  std::uint64_t seed = 0;
  /// Extra layers: "Z" (distance along the line of sight at which the opacity passes 0.5 %, the nearest of
  /// the pixel's rays; +inf where none does), "transmittance" (layer transmittance.R, .G, .B), "light"
  /// (layers light_<name> for every sun and light_sky: their share of R, G, B).
  std::vector<std::string> aovs{"Z"};
};

/// A picture and what it took.
struct RenderResult {
  Image image;
  std::uint64_t rays = 0;
  std::uint64_t samples = 0;
  double lightSeconds = 0;
  double marchSeconds = 0;
};

/// Extinction that suits a volume whatever its units: an optical depth of 150 across its longest side at
/// density 1, or at the typical density where that is larger. It gives a cumulus its crisp edge. 1 for an
/// empty volume.
float defaultExtinction(const RenderVolume& volume);

/// Looks at `volume` through `camera`: light precomputed, then marched, front to back, from every pixel.
///
/// C += T (1 - dT) * sum over lights;  a sun gives  irradiance * sum over octaves of phase * exp(-extinction
/// * column / 2^n) * contribution^n * albedo^(2^n), the sky radiance * albedo * visibility. alpha = 1 - T;
/// rays end at T < 1e-4, what is left stays in alpha. Channels R, G, B, A (half, premultiplied, linear) and
/// `aovs` (float). An empty volume gives a picture of zeros. The same at any number of threads.
/// @throws Error if an option is outside its range or a layer is unknown.
RenderResult renderImage(const RenderVolume& volume, const Medium& medium, const Lights& lights,
                         const Camera& camera, const RenderOptions& options = {},
                         const Progress& progress = silent());

/// Bytes that renderImage will hold beside the volume, at most.
double estimateRenderBytes(const RenderVolume& volume, const Lights& lights, const Camera& camera,
                           const RenderOptions& options);

}  // namespace nephele

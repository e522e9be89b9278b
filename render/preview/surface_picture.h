#pragma once

#include <optional>
#include <vector>

#include "nephele/modeling/base/progress.h"
#include "nephele/render/image/image.h"
#include "nephele/render/scene/camera.h"
#include "nephele/render/scene/surfaces.h"

namespace nephele {

struct SurfacePictureOptions {
  int width = 1280, height = 720;
  /// Where the camera stands; it frames all objects.
  float azimuthDegrees = 0.0f, elevationDegrees = 14.0f;
  /// In place of all these; its lens and shutter are left out.
  std::optional<Camera> camera{};
  /// Share of the frame left free on each side.
  float margin = 0.05f;
  /// Rays per pixel, fewer where there is only open ground.
  int samples = 8;
};

/// Colour of objects that have none of their own, which suits the light of the picture.
constexpr Vec3f kShapeColour{0.62f, 0.6f, 0.57f};

/// Objects without a volume, standing on a ground that fades into the backdrop, in the soft light of a lamp
/// and a sky. Channels R, G, B, A, linear, opaque. The same at any number of threads.
/// @throws Error if there are no objects, one of them cannot be shown (see Surfaces) or an option is outside
/// its range; Cancelled.
Image pictureSurfaces(std::vector<SurfaceObject> objects, const SurfacePictureOptions& options = {},
                      const Progress& progress = silent());

/// The same of surfaces that are kept, by a camera whose lens and shutter are left out.
Image pictureSurfaces(const Surfaces& surfaces, const Camera& camera, int samples,
                      const Progress& progress = silent());

/// Memory, in bytes, that `pictureSurfaces` takes beside its objects. Measured.
constexpr double estimateSurfacePictureBytes(int width, int height) {
  return 130.0 * width * height;
}

}  // namespace nephele

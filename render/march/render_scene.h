#pragma once

#include <string>
#include <vector>

#include "nephele/render/march/render_options.h"
#include "nephele/render/scene/camera.h"
#include "nephele/render/scene/lights.h"
#include "nephele/render/scene/medium.h"
#include "nephele/render/volume/render_volume.h"

namespace nephele {

/// Whether anything of a volume can be seen in any light.
bool isSeen(const RenderVolume& volume, const Medium& medium);

/// All that a picture shows, and from where: plain references, which must outlive every use of it.
struct RenderScene {
  RenderScene(const RenderVolume& volume, const Medium& medium, const Lights& lights, const Camera& camera,
              const FrameOptions& frame);

  const RenderVolume& volume;
  const Medium& medium;
  const Lights& lights;
  const Camera& camera;
  /// Null where there is none.
  const Surfaces* surfaces;
  const Holdout* holdout;
  /// Of the volume's motion; the camera has its own.
  Shutter shutter;
  const RigidMotion* volumeMotion;
  const Camera* nextCamera;

  /// Whether the camera's rays differ in place or time beyond their pixel.
  bool isBlurred() const { return camera.hasLens() || camera.isMoving() || volumeMotion; }
  /// Of every layer light_<name>: those of the lights, then objects where there are any.
  std::vector<std::string> lightNames() const;
  /// @throws Error if a number is outside its range, or there are objects and nothing is seen of the volume.
  void check() const;
  /// The same for what does not depend on the camera.
  static void check(const RenderVolume& volume, const Medium& medium, const Lights& lights,
                    const Surfaces* surfaces);
};

}  // namespace nephele

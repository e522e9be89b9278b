#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <vector>

#include "apps/look/plan.h"
#include "apps/look/shown.h"
#include "nephele/render/scene/surfaces.h"

namespace nephele::apps {

/// What a picture is to be.
struct LookFrame {
  int width = 640, height = 360;
  /// Rays per pixel; 0: as set.
  int samples = 1;
  LookShow show{};
};

struct LookPicture {
  std::shared_ptr<const Image> image;
  Camera camera;
  /// As they were taken, with all that follows from what is seen.
  PictureOptions options;
  Box bounds;
  std::uint64_t rays = 0;
  double voxelSize = 0;
};

/// How long pictures take, from those before.
class LookPace {
 public:
  /// `secondsPerRay`: what is expected first.
  explicit LookPace(double secondsPerRay) : secondsPerRay_(secondsPerRay) {}

  double expectedSeconds(double rays) const { return kSecondsPerPicture + rays * secondsPerRay_; }
  void learn(double rays, double seconds) {
    if (seconds > kSecondsPerPicture)
      secondsPerRay_ = 0.5 * (secondsPerRay_ + (seconds - kSecondsPerPicture) / rays);
  }

 private:
  /// What one takes however few its rays are; measured.
  static constexpr double kSecondsPerPicture = 0.01;

  double secondsPerRay_;
};

/// Surfaces that are looked at again and again.
struct LookSurfaces {
  /// @throws Error as Surfaces; Cancelled.
  LookSurfaces(std::vector<SurfaceObject> objects, const Progress& progress);

  /// What a camera frames.
  Extent extent;
  Surfaces surfaces;
};

/// Seconds since `start`.
double secondsSince(std::chrono::steady_clock::time_point start);

/// The options of a picture of surfaces: colours are shown as they are unless the settings say otherwise.
PictureOptions optionsOfSurfaces(const LookPlan& plan, const LookFrame& frame);

/// A picture of surfaces, in a light of their own; `pace` learns from those of one ray per pixel, which have
/// two here. @throws as pictureSurfaces.
LookPicture pictureOf(const LookSurfaces& shown, PictureOptions options, const LookFrame& frame,
                      LookPace& pace, Run& run);

}  // namespace nephele::apps

#pragma once

#include <map>
#include <string>

#include "nephele/modeling/base/progress.h"
#include "nephele/render/image/image_camera.h"
#include "nephele/render/scene/camera.h"
#include "nephele/render/scene/holdout.h"
#include "nephele/render/scene/lights.h"
#include "nephele/render/volume/render_volume.h"

namespace nephele {

/// What is left of a light at every depth: for each pixel of a picture from the light's place, the optical
/// depth in front of every depth, straight between knots.
///
/// Files are deep OpenEXR images as any compositor reads them: Z, ZBack and A, the pictures worldToCamera and
/// worldToNDC say where the light stood. Source: Lokovic, Veach, "Deep Shadow Maps" (SIGGRAPH 2000).
class DeepShadowMap {
 public:
  struct Options {
    /// Largest error of the transmittance, in (0, 0.5], at the extinction that the map is made for.
    float tolerance = 2e-3f;
  };

  /// The shadow of `volume`, whose extinction at density 1 is `extinction`, in the light of a sun or of a
  /// point or spot that sees it within 75 degrees of its middle. Pixels are as wide as voxels. Followed to an
  /// optical depth of 80. @throws Error naming the light if it stands too near, or an option is outside its
  /// range.
  DeepShadowMap(const RenderVolume& volume, const DistantLight& light, float extinction,
                const Options& options, const Progress& progress = silent());
  DeepShadowMap(const RenderVolume& volume, const LocalLight& light, float extinction, const Options& options,
                const Progress& progress = silent());

  /// @throws Error naming the path if it cannot be read, or does not say where the light stood.
  static DeepShadowMap read(const std::string& path, double mostBytes = 8e9);
  /// @throws Error naming the path; also if the map was itself read.
  void write(const std::string& path, const std::map<std::string, std::string>& metadata = {}) const;

  /// Refuses a map that was read from `path` and made for another light: one whose `worldToCamera` looks
  /// along another way than a sun shines, or stands elsewhere than a point or spot, by more than a
  /// ten-thousandth.
  /// @throws Error naming the path, the light, and both places or ways.
  void requireMadeFor(const DistantLight& light, const std::string& path) const;
  void requireMadeFor(const LocalLight& light, const std::string& path) const;

  /// What making one holds, at most; it depends on how much a pixel of it meets, here 30 samples as a mean.
  static double estimateBytes(const RenderVolume& volume, const DistantLight& light);
  static double estimateBytes(const RenderVolume& volume, const LocalLight& light);
  std::size_t memoryBytes() const;

  /// Between the light and a world-space point; 0 outside of the picture.
  float opticalDepth(const Vec3f& world) const;
  /// Knots of all pixels.
  std::size_t sampleCount() const { return image_ ? image_->sampleCount() : 0; }

 private:
  DeepShadowMap() = default;
  void make(const RenderVolume& volume, const Camera& camera, float extinction, const Options& options,
            const Progress& progress);
  float depthAt(int x, int y, float depth) const;

  /// What `write` writes; not there for maps that were read.
  std::shared_ptr<const DeepImage> image_;
  std::shared_ptr<const Holdout> curves_;
  /// At the light.
  ImageCamera camera_;
};

}  // namespace nephele

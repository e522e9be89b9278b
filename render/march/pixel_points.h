#pragma once

#include <memory>
#include <optional>
#include <span>

#include "nephele/modeling/field/field.h"
#include "nephele/render/march/march_kernels.h"
#include "nephele/render/scene/camera_motion.h"
#include "nephele/render/volume/render_volume.h"

namespace nephele {

/// Where along a ray its opacity is: where half of it is met, and the mean weighted by it; s as in MarchRay.
struct OpacityDistances {
  float median = 0.0f, mean = 0.0f;
};

/// Opacity counts as spread evenly over a step. Nothing for a ray that meets none.
std::optional<OpacityDistances> opacityDistances(const MarchRecord& record);

/// How points of a volume move across the picture: over the time that the shutter is open, per frame, or, if
/// that is an instant, to the camera of the next frame. Zero where nothing is said to move.
class PixelMotion {
 public:
  /// Null where the volume stands still, and where no other camera follows.
  PixelMotion(const Camera& camera, const Shutter& shutter, const RigidMotion* volumeMotion,
              const Camera* nextCamera);

  /// Pixels to the right and down per frame of the point that is at `inVolume` at the frame itself; zero for
  /// points that are behind the camera at either time. `isStill`: of a point that the volume does not carry
  /// along.
  void evaluate(const Vec3d& inVolume, float (&motion)[2], bool isStill = false) const;

 private:
  Camera from_, to_;
  std::optional<RigidMotion> motion_;
  double fromFrames_ = 0, toFrames_ = 0;
  bool isStill_ = true;
};

/// Which way the density faces: minus its gradient, made one long.
class DensityNormals {
 public:
  /// `volume` must outlive it.
  explicit DensityNormals(const RenderVolume& volume);

  /// Normals at points in the space of the volume: differences over two voxels, over eight where the density
  /// does not vary within two, zero where it does not within eight either.
  void evaluate(std::span<const Vec3f> points, std::span<Vec3f> normals) const;

 private:
  void gradients(std::span<const Vec3f> points, float step, std::span<Vec3f> results) const;

  ScalarField density_;
  float voxelSize_;
};

}  // namespace nephele

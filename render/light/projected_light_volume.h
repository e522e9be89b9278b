#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "nephele/modeling/base/progress.h"
#include "nephele/render/scene/camera.h"
#include "nephele/render/scene/lights.h"
#include "nephele/render/volume/render_volume.h"

namespace nephele {

/// How much density lies between every point of a volume and a light at a place: LightVolume in the light's
/// perspective.
///
/// In the light's frame, axes of unit length about its position, a point is q. A face is the pyramid around
/// one half axis of the frame; its lattice coordinates are (q_u / w, q_v / w) * perTangent and w * perDepth,
/// w = side * q_axis > 0, u and v the next axes in turn. A light that sees the volume within 50 degrees of
/// its middle, or shines in such a cone, has one face, all others the six of a cube. Columns of nodes run
/// along light rays.
class ProjectedLightVolume {
 public:
  struct Face {
    int axis = 2;
    float side = 1;
    float perTangent = 1, perDepth = 1;
    /// As of LightVolume.
    Vec3i firstBrick{}, brickCount{};
    std::vector<std::int32_t> table;
    std::vector<float> values;
  };

  /// Cost: one sample of density per half node of the bricks that hold density. @throws Error if the light is
  /// more than 2000 times as far away as the volume is wide, where a sun does as well.
  ProjectedLightVolume(const RenderVolume& volume, const LocalLight& light,
                       const Progress& progress = silent());

  /// As LightVolume::replace.
  void replace(const std::function<float(const Vec3f&)>& column);
  /// As LightVolume::addShade, for rays that start at the light.
  void addShade(const std::function<double(const Ray&)>& distanceToShade, float perDepth);

  /// From world space to the light's frame.
  const Affine& worldToFrame() const { return worldToFrame_; }
  const std::vector<Face>& faces() const { return faces_; }

  /// Integral of density from the light to a world-space point; 0 outside of the faces. Slow; for what is
  /// coarse, and tests.
  float columnDensity(const Vec3f& world) const;
  std::size_t memoryBytes() const;

  /// Upper bound of the bytes that such a volume takes, wherever the light is.
  static double estimateBytes(const RenderVolume& volume);

 private:
  struct Sweep;

  void place(const RenderVolume& volume, const LocalLight& light);
  std::size_t findBricks(const RenderVolume& volume, Face& face, float tangent) const;

  Affine worldToFrame_, frameToIndex_;
  std::vector<Face> faces_;
};

}  // namespace nephele

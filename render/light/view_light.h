#pragma once

#include <memory>
#include <vector>

#include "nephele/render/light/scattered_light.h"
#include "nephele/render/volume/march_scene.h"

namespace nephele::detail {

struct BakedLight;

/// What the scattered light in a volume sends towards one viewpoint, per node of its lattice.
class ViewLight {
 public:
  /// Uses all cores.
  ViewLight(const BakedLight& lit, const Viewpoint& viewpoint);

  /// Lets a march read it. Must outlive that.
  void bind(MarchScene& scene) const;

 private:
  // Shared where the light is.
  using Values = std::shared_ptr<const std::vector<float>>;
  std::vector<Values> scattered_, glow_;
};

}  // namespace nephele::detail

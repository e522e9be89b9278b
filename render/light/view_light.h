#pragma once

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
  void bind(MarchScene& scene) const { scene.scattered = scattered_; }

 private:
  std::vector<std::vector<float>> nodes_;
  std::vector<MarchScene::Scattered> scattered_;
};

}  // namespace nephele::detail

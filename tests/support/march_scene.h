#pragma once

#include "nephele/render/light/light_volume.h"
#include "nephele/render/volume/march_scene.h"
#include "nephele/render/volume/render_volume.h"

namespace nephele::test {

/// What the marching kernels read of a volume, which must outlive the result.
inline MarchScene sceneOf(const RenderVolume& volume) {
  const BrickGrid& grid = volume.density();
  MarchScene scene;
  scene.density = {grid.values().data(), grid.table().data(), grid.brickCount(), volume.coded().codes(),
                   volume.coded().entries()};
  scene.ranges = grid.ranges().data();
  scene.emptiness = volume.emptiness().data();
  scene.uniformity = volume.uniformity().data();
  return scene;
}

/// A sun's columns as they were worked out, for the scalar loop, and coded, for the vectors.
struct SunColumns {
  LightVolume light, coded = light;

  explicit SunColumns(LightVolume itsLight) : light(std::move(itsLight)) { coded.code(); }
};

/// With the sun whose columns are `sun`, which must outlive the result, too.
inline MarchScene sceneOf(const RenderVolume& volume, const SunColumns& sun) {
  MarchScene scene = sceneOf(volume);
  scene.suns.push_back({{sun.light.values().data(), sun.light.table().data(), sun.light.brickCount(),
                         sun.coded.coded().codes(), sun.coded.coded().entries()}});
  return scene;
}

}  // namespace nephele::test

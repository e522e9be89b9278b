#pragma once

#include "render/light_volume.h"
#include "render/march_scene.h"
#include "render/render_volume.h"

namespace nephele::test {

/// What the marching kernels read of a volume, which must outlive the result.
inline MarchScene sceneOf(const RenderVolume& volume) {
  const BrickGrid& grid = volume.density();
  MarchScene scene;
  scene.density = {grid.values.data(), grid.table.data(), grid.brickCount};
  scene.ranges = grid.ranges.data();
  scene.emptiness = volume.emptiness().data();
  scene.uniformity = volume.uniformity().data();
  return scene;
}

/// With the sun whose columns are in `light`.
inline MarchScene sceneOf(const RenderVolume& volume, const LightVolume& light) {
  MarchScene scene = sceneOf(volume);
  scene.suns.push_back({{light.values().data(), light.table().data(), light.brickCount()}});
  return scene;
}

}  // namespace nephele::test

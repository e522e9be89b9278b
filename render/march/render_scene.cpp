#include "nephele/render/march/render_scene.h"

#include <fmt/format.h>

#include <cmath>

#include "nephele/modeling/base/error.h"

namespace nephele {

bool isSeen(const RenderVolume& volume, const Medium& medium) {
  return !volume.isEmpty() && medium.extinction > 0 && medium.extinctionColour != Vec3f{};
}

RenderScene::RenderScene(const RenderVolume& itsVolume, const Medium& itsMedium, const Lights& itsLights,
                         const Camera& itsCamera, const FrameOptions& frame)
    : volume(itsVolume),
      medium(itsMedium),
      lights(itsLights),
      camera(itsCamera),
      surfaces(frame.surfaces.get()),
      holdout(frame.holdout.get()),
      shutter(frame.shutter),
      volumeMotion(frame.volumeMotion ? &*frame.volumeMotion : nullptr),
      nextCamera(frame.nextCamera ? &*frame.nextCamera : nullptr) {}

std::vector<std::string> RenderScene::lightNames() const {
  std::vector<std::string> names = lights.names();
  if (surfaces) names.push_back("objects");
  return names;
}

void RenderScene::check(const RenderVolume& volume, const Medium& medium, const Lights& lights,
                        const Surfaces* surfaces) {
  medium.check();
  lights.check();
  require(isSeen(volume, medium) || !surfaces,
          "objects: need a volume that is not empty and has an extinction");
}

void RenderScene::check() const {
  check(volume, medium, lights, surfaces);
  require(std::isfinite(shutter.open) && std::isfinite(shutter.close) && shutter.open <= shutter.close,
          fmt::format("shutter: expected an opening not after the closing, got {}, {}", shutter.open,
                      shutter.close));
}

}  // namespace nephele

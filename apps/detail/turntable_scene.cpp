#include "apps/detail/turntable_scene.h"

namespace nephele::apps {

TurntableScene::TurntableScene(const TurntableOptions& options, const PictureOptions& picture,
                               const TurntableFrame& frame, Run& run)
    : options_(options), given_(picture) {
  turnTo(frame, run);
}

void TurntableScene::turnTo(const TurntableFrame& frame, Run& run) {
  volume_.reset();
  picture_ = given_;
  SceneOptions scene = options_.scene;
  scene.inputs = frame.inputs;
  // Only what is read knows the frame: an animated camera begins the turn at its own first one.
  if (run.part) run.part->frame = frame.number;
  volume_.emplace(scene.sceneVolume(picture_, run));
  if (run.part) run.part->frame.reset();
  key_ = frame.volumeKey;
  picture_ = picture_.resolved(volume(), run);
  const bool isShown = !options_.preview.empty() || !options_.movie.empty() || !options_.contactSheet.empty();
  scene.addTo(picture_, volume(), isShown, run);
}

void TurntableScene::resample(float voxelSize, const Progress& progress) {
  volume_->resample(voxelSize, progress);
  picture_.render.step = picture_.stepThrough(volume());
}

void TurntableScene::requireMemory(const Camera& start, const Run& run) const {
  // Moving lights are made while those of the frame before are still there.
  const double bytes = picture_.estimateBytes(volume(), start);
  run.requireMemory(double(volume().memoryBytes()) + (options_.orbit == Orbit::camera ? 1 : 2) * bytes,
                    "make the picture smaller (--size), or the volume with larger voxels");
}

}  // namespace nephele::apps

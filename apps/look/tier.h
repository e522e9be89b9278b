#pragma once

#include <map>
#include <memory>
#include <string>

#include "apps/look/picture.h"
#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/render/session/picture_stages.h"

namespace nephele::apps {

/// The steps to pictures of one amount of work, with what was made last.
class LookTier {
 public:
  explicit LookTier(LookPlan::Tier tier) : tier_(tier) {}

  /// Whether a picture only needs to be marched, or its surface to be shaded.
  bool isReady(const LookPlan& plan) const;
  /// Makes what is not there, and the picture. `finer`, if there is one, lends its volume where that is what
  /// is read from a file. @throws Error; Cancelled.
  LookPicture picture(const LookPlan& plan, const LookFrame& frame, LookTier* finer, Run& run);
  /// Of pictures of volumes, or of surfaces.
  const LookPace& pace(bool isVolume) const { return isVolume ? march_ : shading_; }

 private:
  PictureStages::Keys keysOf(const LookPlan& plan) const;
  std::string surfaceKey(const LookPlan& plan) const;
  /// A cloud on its way from the shape to the density.
  struct Growing {
    CloudArguments arguments;
    std::shared_ptr<const Mesh> mesh;
    FieldSources sources;
    CloudOptions options;
    std::shared_ptr<const CloudLevels> levels{};

    Growing(const CloudArguments& itsArguments, std::shared_ptr<const Mesh> itsMesh, LookPlan::Tier tier,
            const Run& run);
    /// `isCoded`: its samples are not asked for.
    RenderVolume volume(const LookPlan& plan, bool isCoded, Run& run);
  };
  std::unique_ptr<Growing> grown(const LookPlan& plan, Run& run);
  /// A script that has been run, kept until it or its parameters change.
  ScriptVolume& script(const LookPlan& plan, Run& run);
  /// Chooses the voxels of a script: those that `picture` asks for, or those that there are, where that is
  /// enough or there is a coarser way.
  void chooseVoxels(const LookPlan& plan, const PictureOptions& picture, bool isFinal, LookTier* finer,
                    Run& run);
  std::shared_ptr<const RenderVolume> volume(const LookPlan& plan, LookTier* finer, Run& run);
  /// What is shown as a surface.
  std::shared_ptr<const Mesh> surface(const LookPlan& plan, LookTier* finer, Run& run);
  LookPicture surfacePicture(const LookPlan& plan, const LookFrame& frame, LookTier* finer, Run& run);

  LookPlan::Tier tier_;
  PictureStages stages_;
  Stage<LookSurfaces> surface_;
  std::unique_ptr<ScriptVolume> script_;
  // Of the script, and of its voxels, which depend on the camera.
  std::string scriptKey_, voxelsKey_;
  float voxels_ = 0;
  // Of a volume of a file that something has needed the samples of; they are held from then on.
  std::string samplesKey_;
  // Whether the stages are those of a cloud that is grown.
  bool isGrown_ = false;
  // How far layers reach, by the keys of shape, layers and volume.
  std::map<std::string, std::string> reaches_;
  LookPace march_{1.5e-6}, shading_{4e-7};
};

}  // namespace nephele::apps

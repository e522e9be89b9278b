#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nephele/levelset/cloud/cloud.h"
#include "nephele/levelset/cloud/kept_layers.h"
#include "nephele/modeling/base/mesh.h"
#include "nephele/modeling/base/progress.h"
#include "nephele/render/march/raymarch.h"
#include "nephele/render/session/stage.h"

namespace nephele {

/// A volume with the light in it, and the volume itself, which the light refers to.
struct LitCloud {
  std::shared_ptr<const RenderVolume> volume;
  LitVolume light;
};

/// What the light in a volume depends on beside the volume.
struct LightSetup {
  Medium medium;
  Lights lights;
  Octaves octaves{};
  std::shared_ptr<const Surfaces> surfaces{};
};

/// The steps from a shape to a picture of the cloud on it, each kept until what it depends on changes:
///
///     shape -> distance -> layers, one by one -> levels -> volume -> light -> picture
///
/// Moving the camera marches again, moving a sun makes its light again and keeps the sky's, another edge
/// keeps the levels, another third layer keeps the first two. Every step is asked for with a key that says
/// what it depends on beside the step before it (see Stage); the steps are asked for in their order. A volume
/// from elsewhere begins the chain. Cancelling leaves all steps that were finished. For one thread at a time.
class PictureStages {
 public:
  /// @param read makes the shape. @throws what it throws.
  std::shared_ptr<const Mesh> shape(const std::string& key, const std::function<Mesh()>& read);
  /// The layers of a cloud on the shape. @throws as makeCloudLevels.
  /// `layerKeys` says what each layer depends on beside the shape and the layers before it, so that those
  /// that have not changed are kept, see KeptLayers; without it all are made again.
  std::shared_ptr<const CloudLevels> levels(const std::string& key, const CloudOptions& options,
                                            const std::vector<std::string>& layerKeys = {},
                                            const Progress& progress = silent());
  /// The volume that is looked at, made from the levels, if there are any, or of something else.
  std::shared_ptr<const RenderVolume> volume(const std::string& key,
                                             const std::function<RenderVolume()>& make);
  /// The same of one that somebody else holds.
  std::shared_ptr<const RenderVolume> volume(const std::string& key,
                                             std::shared_ptr<const RenderVolume> held);
  /// The light in the volume; `mediumKey` says what the medium, octaves and surfaces depend on. Where only
  /// lights have changed, what they have in common with those before is not made again; the rest goes before
  /// the new one comes. @throws as LitVolume.
  std::shared_ptr<const LitCloud> light(const std::string& mediumKey, const std::string& lightsKey,
                                        const LightSetup& setup, const Progress& progress = silent());
  /// A picture of it. @throws as LitVolume::render.
  std::shared_ptr<const RenderResult> picture(const std::string& key, const Camera& camera,
                                              const RenderOptions& options,
                                              const Progress& progress = silent());

  /// Keys of all steps up to the light; empty for steps that there are not.
  struct Keys {
    std::string shape, levels, volume, medium, lights;
  };
  /// Whether the light is there under these keys; a picture then only needs to be marched.
  bool isLit(const Keys& keys) const;
  /// The volume, where it is there under these keys; else null.
  std::shared_ptr<const RenderVolume> volumeAt(const Keys& keys) const;
  /// How many layers the levels took from those before.
  std::size_t layersTaken() const { return layers_.taken(); }
  /// The light that is there, whatever it is of, or null.
  std::shared_ptr<const LitCloud> lit() const { return light_.kept(); }
  /// Lets everything go.
  void forget();

 private:
  void forgetLight();

  Stage<Mesh> shape_;
  KeptLayers layers_;
  Stage<CloudLevels> levels_;
  Stage<RenderVolume> volume_;
  Stage<LitCloud> light_;
  Stage<RenderResult> picture_;
  // Of the light that is kept, or of what is left of one for the next.
  std::string mediumKey_;
  std::optional<LitVolume> left_;
};

}  // namespace nephele

#pragma once

#include <memory>
#include <string>

#include "apps/detail/command.h"
#include "apps/look/settings.h"
#include "apps/look/shown.h"
#include "apps/look/subject.h"
#include "apps/options/cloud_options.h"
#include "apps/options/cut_options.h"
#include "apps/options/picture/render_options.h"
#include "apps/options/picture/scene_options.h"
#include "apps/options/transfer_options.h"
#include "apps/options/wisps_options.h"
#include "nephele/render/session/picture_stages.h"

namespace nephele::apps {

/// Settings, read as the verb of what is shown and the verb render read them, and what the steps to their
/// picture depend on.
struct LookPlan {
  /// @throws LookFault with the sentence of the command line.
  LookPlan(const LookSubject& subject, const LookSettings& settings,
           LookShow::What what = LookShow::What::cloud);
  LookPlan(const LookPlan&) = delete;
  LookPlan& operator=(const LookPlan&) = delete;

  /// How much work a picture may be.
  enum class Tier {
    coarse,  ///< Voxels of 1/64 of the longest side at least, light in few directions.
    fine     ///< As set.
  };
  static constexpr int kCoarseVoxels = 64, kCoarseLightCells = 48, kCoarseDots = 20000;

  LookSubject subject;
  LookSettings settings;
  LookShow::What what;
  /// Of these the ones of the verb of what is shown are read.
  CloudArguments cloud;
  WispsArguments wisps;
  CutArguments cut;
  TransferArguments transfer;
  SceneOptions scene;
  /// Shown through `screen`; resolved for each volume.
  PictureOptions picture;

  /// Whether a cloud is grown for what is shown.
  bool growsCloud() const { return subject.hasCloud() && LookShow::verb(what) == "cloud"; }
  /// The cloud of a tier.
  CloudArguments cloudOf(Tier tier) const;
  WispsArguments wispsOf(Tier tier) const;
  PictureOptions pictureOf(Tier tier) const;
  /// Of all steps; layers reach as far as the edge does, which is not in their key, see cloudEdgeReach.
  PictureStages::Keys keys(Tier tier) const;
  /// Of each layer of the cloud, beside the shape and the layers before it, see PictureStages::levels.
  std::vector<std::string> layerKeys() const;
  /// Of all that a picture depends on beside its light, its size and what it shows.
  std::string cameraKey() const;

 private:
  // The options refer to what they were read from.
  struct Parsed {
    explicit Parsed(Verb of) : verb(std::move(of)), command(verb) {}
    Verb verb;
    Command command;
  };
  static std::unique_ptr<Parsed> parsed(Verb verb, const nlohmann::json& settings,
                                        std::vector<std::string> arguments);
  std::unique_ptr<Parsed> shownCommand_, renderCommand_;
};

/// The verbs with their options as the viewer takes them: nothing that is written, and the camera of `render`
/// for all.
Verb lookCloudVerb(CloudArguments& cloud);
Verb lookWispsVerb(WispsArguments& wisps);
Verb lookCutVerb(CutArguments& cut);
Verb lookTransferVerb(TransferArguments& transfer);
Verb lookRenderVerb(SceneOptions& scene, PictureOptions& picture);

}  // namespace nephele::apps

#pragma once

#include "apps/look/picture.h"
#include "nephele/levelset/warp/transfer_quality.h"
#include "nephele/render/session/stage.h"

namespace nephele::apps {

/// The steps to pictures of pieces and of transfers, with what was made last: what is cut, its pieces, these
/// where they stand; a mesh with what was carried to it, both shapes where they stand. The camera needs none
/// of them again.
class LookShapes {
 public:
  /// Makes what is not there, and the picture. @throws Error; Cancelled.
  LookPicture picture(const LookPlan& plan, const LookFrame& frame, Run& run);
  const LookPace& pace() const { return pace_; }

 private:
  /// An object with the texture coordinates of a reference, and how well they fit.
  struct Carried {
    Mesh reference, object;
    TransferQuality quality;
  };
  LookPicture piecesPicture(const LookPlan& plan, const LookFrame& frame, Run& run);
  LookPicture transferPicture(const LookPlan& plan, const LookFrame& frame, Run& run);
  std::shared_ptr<const Carried> carried(const LookPlan& plan, bool isQuick, std::string& key, Run& run);

  Stage<std::vector<CutPart>> parts_;
  Stage<Pieces> pieces_;
  Stage<Image> texture_;
  // As they are set, and as they are made in a moment.
  Stage<Carried> carried_, quick_;
  Stage<LookSurfaces> surfaces_;
  LookPace pace_{4e-7};
};

}  // namespace nephele::apps

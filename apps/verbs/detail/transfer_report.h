#pragma once

#include <string>

#include "apps/app.h"
#include "nephele/levelset/warp/mesh_warp.h"
#include "nephele/levelset/warp/transfer_quality.h"

namespace nephele::apps {

/// How good a transfer is, into the statistics of `run` and in words about `output`.
void reportTransfer(const std::string& output, const MeshWarp& warp, const TransferQuality& quality,
                    Run& run);

}  // namespace nephele::apps

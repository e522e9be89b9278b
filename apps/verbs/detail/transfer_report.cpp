#include "apps/verbs/detail/transfer_report.h"

#include <fmt/format.h>

namespace nephele::apps {
namespace {

nlohmann::json residuals(const MeshWarp& warp) {
  nlohmann::json all = nlohmann::json::array();
  for (const WarpResidual& r : warp.iterations)
    all.push_back({{"median", r.median}, {"p95", r.p95}, {"p99", r.p99}, {"max", r.max}});
  return all;
}

}  // namespace

void reportTransfer(const std::string& output, const MeshWarp& warp, const TransferQuality& quality,
                    Run& run) {
  run.stats["iterations"] = residuals(warp);
  run.stats["unconverged_fraction"] = warp.unconvergedFraction;
  run.stats["flipped_fraction"] = quality.flippedFraction;
  run.stats["degenerate_fraction"] = quality.degenerateFraction;
  run.stats["stretch_median"] = quality.stretchMedian;
  run.stats["stretch_p95"] = quality.stretchP95;
  run.stats["coverage"] = quality.coverage;
  run.stats["triangles"] = quality.triangleCount;
  run.result(
      fmt::format("{}: {:.2f} % of {} triangles are turned over, {:.2f} % have collapsed; stretch {:.2f} "
                  "(median), {:.2f} (95 %)",
                  output, 100 * quality.flippedFraction, quality.triangleCount,
                  100 * quality.degenerateFraction, quality.stretchMedian, quality.stretchP95));
  run.result(
      fmt::format("{}: shows {:.1f} % of the reference's surface; {:.2f} % of the vertices by closest points",
                  output, 100 * quality.coverage, 100 * warp.unconvergedFraction));
}

}  // namespace nephele::apps

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

nlohmann::json regionOf(const SurfaceRegion& region) {
  const Vec3d& p = region.middle;
  return {{"middle", {p.x, p.y, p.z}}, {"share", region.share}};
}

std::string placeOf(const SurfaceRegion& region) {
  return fmt::format("near ({:.4g}, {:.4g}, {:.4g})", region.middle.x, region.middle.y, region.middle.z);
}

/// Means and medians praise a map that is torn in one place.
void noteWhatIsBad(const std::string& output, const TransferQuality& quality, const Run& run) {
  constexpr double kEnough = 0.95, kLargeRegion = 0.005;
  const bool isTorn = quality.coverage < kEnough, isBad = quality.worst.share >= kLargeRegion;
  if (isTorn)
    run.note(fmt::format(
        "{}: {:.1f} % of the reference is not shown, 5 % would be much; the largest part of "
        "it lies {} of the reference, {:.1f} % of its area",
        output, 100 * (1 - quality.coverage), placeOf(quality.uncovered), 100 * quality.uncovered.share));
  if (isBad)
    run.note(
        fmt::format("{}: {:.1f} % of the object is turned over, collapsed or stretched more than {:g} "
                    "times; the largest region of it lies {} of the object, {:.1f} % of its area",
                    output, 100 * quality.badFraction, double(TransferQuality::kBadStretch),
                    placeOf(quality.worst), 100 * quality.worst.share));
  if (isTorn || isBad) run.note("a preview with --preview-paint distortion shows where");
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
  run.stats["bad_fraction"] = quality.badFraction;
  run.stats["worst_region"] = regionOf(quality.worst);
  run.stats["largest_uncovered_region"] = regionOf(quality.uncovered);
  run.stats["triangles"] = quality.triangleCount;
  run.result(
      fmt::format("{}: {:.2f} % of {} triangles are turned over, {:.2f} % have collapsed; stretch {:.2f} "
                  "(median), {:.2f} (95 %)",
                  output, 100 * quality.flippedFraction, quality.triangleCount,
                  100 * quality.degenerateFraction, quality.stretchMedian, quality.stretchP95));
  run.result(
      fmt::format("{}: shows {:.1f} % of the reference's surface; {:.2f} % of the vertices by closest points",
                  output, 100 * quality.coverage, 100 * warp.unconvergedFraction));
  noteWhatIsBad(output, quality, run);
}

}  // namespace nephele::apps

#include "nephele/levelset/cloud/wisp_volume.h"

#include <algorithm>
#include <cmath>

namespace nephele {
namespace {

/// Dots that are grown at a time.
constexpr std::size_t kPart = std::size_t(1) << 21;
/// Of the time that a part takes.
constexpr double kGrowing = 0.5;

}  // namespace

DotVolume bakeWisps(std::span<const WispGuide> guides, const WispVolumeOptions& options,
                    const Progress& progress) {
  DotVolume volume(options.dots);
  const std::size_t part = std::max<std::size_t>(1, kPart / std::max(1u, options.wisps.dots));
  for (std::size_t first = 0; first < guides.size(); first += part) {
    WispOptions wisps = options.wisps;
    wisps.firstGuide += first;
    const std::size_t count = std::min(part, guides.size() - first);
    const double from = double(first) / double(guides.size()),
                 to = double(first + count) / double(guides.size());
    const double grown = from + kGrowing * (to - from);
    Dots dots = growWisps(guides.subspan(first, count), wisps, SubProgress(progress, from, grown));
    if (options.velocity) addVelocity(dots, *options.velocity);
    volume.add(dots, SubProgress(progress, grown, to));
    if (options.also) options.also(dots);
  }
  return volume;
}

double estimatedWispBytes(std::span<const WispGuide> guides, const WispVolumeOptions& options) {
  const double dots = double(options.wisps.dots), total = dots * double(guides.size());
  const double edge = 8 * double(options.dots.voxelSize);
  const double shutter =
      std::max(std::abs(double(options.dots.shutterOpen)), std::abs(double(options.dots.shutterClose)));
  // A dot reaches 1.4 bricks on average, more if it is large or smeared.
  const double perDot = 1.5 * std::pow(1 + 2 * double(options.dots.radius) / edge, 3);
  double bricks = 0;
  Box box;
  for (const WispGuide& guide : guides) {
    const Box own = wispBox({&guide, 1}, options.wisps);
    const double smear = double(length(guide.velocity)) * shutter;
    // Of its box, a wisp fills about a third, and hardly more than its sphere.
    bricks += std::min(dots * perDot * (1 + smear / edge),
                       std::pow(0.7 * double(own.longestSide()) / edge + 1 + smear / edge, 3));
    box = box.including(own.expanded(float(smear)));
  }
  const double held = std::min(total, double(std::max(kPart, std::size_t(options.wisps.dots))));
  return estimatedDotVolumeBytes(box, bricks, total, options.dots) +
         held * double(3 * sizeof(Vec3f) + sizeof(float));
}

}  // namespace nephele

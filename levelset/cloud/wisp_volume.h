#pragma once

#include <functional>
#include <optional>

#include "nephele/levelset/cloud/dot_volume.h"
#include "nephele/modeling/cloud/wisps.h"

namespace nephele {

struct WispVolumeOptions {
  WispOptions wisps;
  DotVolumeOptions dots;
  /// Added to the velocities of the dots, read where they are.
  std::optional<VectorField> velocity{};
  /// Is given all dots, part by part, in order.
  std::function<void(const DotSpans&)> also{};
};

/// Grows wisps and adds up their dots, guides by guides, so that few dots are held at a time. Colours are
/// kept if `options.dots.withColor`. The same bit for bit at any thread count.
/// @throws Error as growWisps and DotVolume; Cancelled.
DotVolume bakeWisps(std::span<const WispGuide> guides, const WispVolumeOptions& options,
                    const Progress& progress = silent());

/// Memory that `bakeWisps` and the grids of its result need, bytes; right within a factor of two or so.
double estimatedWispBytes(std::span<const WispGuide> guides, const WispVolumeOptions& options);

}  // namespace nephele

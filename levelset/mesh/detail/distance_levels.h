#pragma once

#include <memory>
#include <vector>

#include "nephele/levelset/grid/packed_grid.h"
#include "nephele/modeling/field/field.h"

namespace nephele::detail {

/// One grid of a distance; each is twice as coarse as the one before.
struct DistanceLevel {
  std::shared_ptr<const PackedGrid> grid;
  /// World distance where the next level starts, and over which it takes over.
  float nextStart = 0.0f, nextBlend = 1.0f;
  /// The next level holds more of this side; else the side's band ends within this level.
  bool continuesOutside = false, continuesInside = false;
};

/// All of them, from fine to coarse: at most kMostDistanceLevels.
struct DistanceLevels {
  std::vector<DistanceLevel> all;
  float exteriorBand = 0.0f, interiorBand = 0.0f;
  float voxelSize = 0.0f;
};

/// No band that is allowed needs more.
inline constexpr std::size_t kMostDistanceLevels = 32;

/// The distance that the levels hold together.
ScalarField distanceOfLevels(std::shared_ptr<const DistanceLevels> levels);

}  // namespace nephele::detail

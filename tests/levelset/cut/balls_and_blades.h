#pragma once

#include <cmath>
#include <memory>
#include <vector>

#include "nephele/levelset/cut/knives.h"
#include "nephele/levelset/grid/bake.h"
#include "nephele/modeling/shape/shapes.h"

/// What the tests of cuts cut, and by what.
namespace nephele::test {

inline constexpr Box kBall{{-1, -1, -1}, {1, 1, 1}};
inline constexpr double kBallVolume = 4 * M_PI / 3;

inline ScalarField ball() {
  return sphere({0, 0, 0}, 1);
}

/// The ball of radius 1 with so many voxels along it.
inline std::shared_ptr<BrickGrid> ball(int voxelsPerRadius) {
  const float h = 1.0f / float(voxelsPerRadius);
  return bakeGrid(sphere({0, 0, 0}, 1),
                  {.voxelSize = h, .box = kBall.expanded(4 * h), .band = {-4 * h, 4 * h}});
}

inline std::vector<Knife> flat(const std::vector<BladePlane>& blades) {
  std::vector<Knife> knives;
  for (const BladePlane& blade : blades) knives.push_back(flatKnife(blade));
  return knives;
}

}  // namespace nephele::test

#pragma once

#include <cstdint>

#include "nephele/modeling/base/math.h"

/// The lattice of a noise, and facts of Perlin's. For the implementation of noises.
namespace nephele::detail {

/// Where and which noise: lattice coordinates are toLattice x + offset.
struct PerlinLattice {
  Mat3f toLattice;
  Vec3f offset;
  std::uint32_t seed = 0;
};

/// Rms of the noise before it is divided by it: sqrt(16 A B^2), with A the integral of (1 - s)^2 t^2 and B
/// that of (1 - s)^2 over a unit cell, s the fade curve; the 12 gradients are independent and equally likely.
inline constexpr float kPerlinRms = 0.270035082f;
/// No gradient is longer than this per lattice cell, after division by the rms: 3.75 / rms at the middle of a
/// cell where all gradients point along one axis as well as they can, and a margin of 1 %.
inline constexpr float kPerlinSteepest = 14.03f;

}  // namespace nephele::detail
